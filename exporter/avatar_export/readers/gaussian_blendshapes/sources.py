"""The two on-disk forms of a Gaussian Blendshapes model, both read as blocks of Gaussians.

A block is {"static", "geometry", "appearance", "correctives", "late_morphs", "skin"} -> attribute -> array,
rows first: static [B, ...], the others [B, columns, ...].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from avatar_export.formats.npy import RowSource, open_npy
from avatar_export.formats.pickle.arrays import read_pickled_npy
from avatar_export.formats.pth import read_checkpoint
from avatar_export.readers.gaussian_blendshapes.layout import (
    ACC_KEYS,
    DUMP_SHAPES,
    FACE_TUPLE,
    FACE_TUPLE_LENGTH,
    MOUTH_FIELDS,
    MOUTH_TUPLE_LENGTH,
    RAW_SHAPES,
    SYSTEM,
    Model,
    mouth_paths,
)
from avatar_runtime.avatar import F32
from avatar_runtime.io.errors import AvatarError

Block = dict[str, dict[str, F32]]


@dataclass(frozen=True)
class FaceSource:
    """The face Gaussians, read by blocks: `block(start, stop)`."""

    file: Path
    form: str
    count: int
    coefficients: int
    expressions: int
    sh_degree: int
    block: Callable[[int, int], Block] = field(repr=False)


@dataclass(frozen=True)
class MouthSource:
    """The Gaussians of the upper or lower teeth, in memory."""

    file: Path
    name: str
    binding: str
    static: dict[str, F32] = field(repr=False)

    @property
    def count(self) -> int:
        """The number of Gaussians."""
        return len(self.static["mean"])


def open_face(model: Model) -> FaceSource:
    """The face, with consistent sizes. Raises AvatarError that names file and field."""
    return _open_dump(model.face) if model.form == "dump" else _open_raw(model)


def open_mouths(model: Model) -> list[MouthSource]:
    """Upper and lower teeth, if their files exist. Raises AvatarError for unsound files."""
    read = {"": _dump_mouth, ".pth": _raw_mouth}
    return [
        MouthSource(path, name, binding, read[path.suffix](path))
        for path, name, binding in mouth_paths(model)
    ]


def _open_dump(folder: Path) -> FaceSource:
    arrays: dict[str, RowSource] = {name: open_npy(folder / f"{name}.npy") for name in DUMP_SHAPES}
    sizes = _sizes(arrays, DUMP_SHAPES, folder)

    def block(start: int, stop: int) -> Block:
        a = {name: v.rows(start, stop, axis=1 if name == "pos_t" else 0) for name, v in arrays.items()}
        return {
            "static": _static(a["pos"], a["shs"], a["scale"], a["rot"], a["opacity"]),
            "geometry": {"mean": _k(a["xyz_t"]), "quat_wxyz": _k(a["rot_t"])},
            "appearance": {
                "log_scale": _k(a["scale_t"]),
                "opacity_logit": _k(a["opacity_t"])[..., 0],
                "sh": _k(a["shs_t"]),
            },
            **_motion(a["pos_t"], a["eyelid"], a["W"]),
        }

    degree = round(sizes["C"] ** 0.5) - 1
    return FaceSource(folder, "dump", sizes["P"], sizes["C"], sizes["K"], degree, block)


def _open_raw(model: Model) -> FaceSource:
    face = _tuple(model.face, FACE_TUPLE_LENGTH)
    acc_file = model.folder / f"acc{model.iteration}.npy"
    if not acc_file.is_file():
        raise AvatarError(f"is missing; it belongs to {model.face.name}", file=acc_file, owner=SYSTEM)
    acc = read_pickled_npy(acc_file)
    arrays: dict[str, RowSource] = {
        name: _source(face[index], model.face, f"item {index}") for name, index in FACE_TUPLE.items()
    }
    for key in ACC_KEYS:
        if key not in acc:
            raise AvatarError("is missing", file=acc_file, field=key, owner=SYSTEM)
        arrays[key] = _source(acc[key], acc_file, key)
    sizes = _sizes(arrays, RAW_SHAPES, model.face)

    def block(start: int, stop: int) -> Block:
        a = {
            name: v.rows(start, stop, axis=1 if name == "pose_blendshape" else 0)
            for name, v in arrays.items()
        }
        mask = a["expr_mask_tensor"][:, None]  # has no upper limit: 7.4 occurs

        def fold(learned: str, init: str | None = None) -> F32:
            """init + mask * learned, face_gs_model.py:768."""
            delta = a[learned]
            delta *= mask if delta.ndim == 3 else mask[:, None]
            if init:
                delta += a[init]
            return _k(delta)

        sh = np.concatenate([a["features_dc"], a["features_rest"]], axis=1)
        return {
            "static": _static(a["xyz"], sh, a["scaling"], a["rotation"], a["opacity"]),
            "geometry": {"mean": fold("xyz_b", "init_xyz"), "quat_wxyz": fold("rotation_b", "init_rot")},
            "appearance": {
                "log_scale": fold("scaling_b"),
                "opacity_logit": fold("opacity_b")[..., 0],
                "sh": fold("features_b", "init_sh"),
            },
            **_motion(a["pose_blendshape"], a["eye_blendshape"], a["W"]),
        }

    degree = _degree(face[0], sizes["C"], model.face)
    return FaceSource(model.face, "raw", sizes["P"], sizes["C"], sizes["K"], degree, block)


def _dump_mouth(folder: Path) -> dict[str, F32]:
    arrays: dict[str, RowSource] = {name: open_npy(folder / f"{name}.npy") for name in MOUTH_FIELDS}
    count = _sizes(arrays, {name: DUMP_SHAPES[name] for name in MOUTH_FIELDS}, folder)["P"]
    a = {name: v.rows(0, count) for name, v in arrays.items()}
    return _static(a["pos"], a["shs"], a["scale"], a["rot"], a["opacity"])


def _raw_mouth(file: Path) -> dict[str, F32]:
    items = _tuple(file, MOUTH_TUPLE_LENGTH)
    names = [name for name, index in FACE_TUPLE.items() if index <= 6]
    arrays: dict[str, RowSource] = {name: _source(items[FACE_TUPLE[name]], file, name) for name in names}
    count = _sizes(arrays, {name: RAW_SHAPES[name] for name in names}, file)["P"]
    a = {name: v.rows(0, count) for name, v in arrays.items()}
    sh = np.concatenate([a["features_dc"], a["features_rest"]], axis=1)
    return _static(a["xyz"], sh, a["scaling"], a["rotation"], a["opacity"])


def _tuple(file: Path, length: int) -> tuple[object, ...]:
    loaded = read_checkpoint(file)
    if not (isinstance(loaded, tuple) and len(loaded) == 2 and isinstance(loaded[0], tuple)):
        raise AvatarError("is not a pair (tuple, iteration)", file=file, owner=SYSTEM)
    if len(loaded[0]) != length:
        raise AvatarError(
            f"has a tuple of {len(loaded[0])} items, expected {length}", file=file, owner=SYSTEM
        )
    return loaded[0]


def _source(value: object, file: Path, field_name: str) -> RowSource:
    if not (hasattr(value, "rows") and hasattr(value, "shape")):
        raise AvatarError(
            f"is a {type(value).__name__}, expected an array", file=file, field=field_name, owner=SYSTEM
        )
    return value  # type: ignore[return-value]


def _degree(value: object, coefficients: int, file: Path) -> int:
    stored = round(coefficients**0.5) - 1
    if type(value) is not int or not 0 <= value <= stored:
        raise AvatarError(
            f"active SH degree {value!r} is outside 0..{stored}", file=file, field="item 0", owner=SYSTEM
        )
    return value


def _sizes(arrays: dict[str, RowSource], shapes: dict[str, tuple[object, ...]], file: Path) -> dict[str, int]:
    """The sizes P, C and K. Raises AvatarError for arrays with inconsistent shapes."""
    sizes: dict[str, int] = {}
    for name, expected in shapes.items():
        shape = arrays[name].shape
        ok = len(shape) == len(expected)
        for got, want in zip(shape, expected, strict=False):
            if want == "C - 1":
                got, want = got + 1, "C"
            ok &= got == (sizes.setdefault(want, got) if isinstance(want, str) else want)
        if not ok:
            known = ", ".join(f"{k} = {v}" for k, v in sizes.items())
            raise AvatarError(
                f"has shape {list(shape)}, expected [{', '.join(map(str, expected))}] with {known}",
                file=file,
                field=name,
                owner=SYSTEM,
            )
    if sizes["C"] not in (1, 4, 9, 16) or not sizes["P"]:
        raise AvatarError(
            f"has {sizes['P']} rows of {sizes['C']} SH coefficients; 1, 4, 9 or 16 coefficients are expected",
            file=file,
            field="shs",
            owner=SYSTEM,
        )
    return sizes


def _static(mean: F32, sh: F32, log_scale: F32, quat: F32, opacity: F32) -> dict[str, F32]:
    return {"mean": mean, "log_scale": log_scale, "quat_wxyz": quat, "opacity_logit": opacity[:, 0], "sh": sh}


def _motion(pose: F32, eyelid: F32, weights: F32) -> Block:
    return {
        "correctives": {"mean": np.swapaxes(pose, 0, 1)},
        "late_morphs": {"mean": _k(eyelid)},
        "skin": {"weight": weights},
    }


def _k(values: F32) -> F32:
    """[B, ..., K] -> [B, K, ...]."""
    return np.moveaxis(values, -1, 1)
