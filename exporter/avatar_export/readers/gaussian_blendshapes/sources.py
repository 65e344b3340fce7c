"""The two on-disk forms of a Gaussian Blendshapes model, brought to one shape: blocks of Gaussians.

A block is {"static", "geometry", "appearance", "correctives", "late_morphs", "skin"} -> attribute -> array,
rows first: static [B, ...], the others [B, columns, ...].
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from avatar_export.formats.npy import RowSource, open_npy
from avatar_export.formats.pickle.arrays import read_pickled_npy
from avatar_export.formats.pth import read_checkpoint
from avatar_runtime.avatar import F32
from avatar_runtime.io.errors import AvatarError

SYSTEM = "gaussian_blendshapes"
Block = dict[str, dict[str, F32]]

# Items of the raw face checkpoint, face_gs_model.py:118-140.
FACE_TUPLE = {
    "xyz": 1,
    "features_dc": 2,
    "features_rest": 3,
    "scaling": 4,
    "rotation": 5,
    "opacity": 6,
    "xyz_b": 10,
    "features_b": 11,
    "scaling_b": 12,
    "rotation_b": 13,
    "opacity_b": 14,
}
FACE_TUPLE_LENGTH, MOUTH_TUPLE_LENGTH = 19, 12
ACC_KEYS = ("init_rot", "init_sh", "init_xyz", "pose_blendshape", "eye_blendshape", "expr_mask_tensor", "W")
MOUTHS = (("mouth0", "upper_teeth", "anchor"), ("mouth1", "lower_teeth", "joint_mix"))

# Shapes by field; P rows, C coefficients, K expressions.
DUMP_SHAPES: dict[str, tuple[object, ...]] = {
    "pos": ("P", 3),
    "shs": ("P", "C", 3),
    "scale": ("P", 3),
    "rot": ("P", 4),
    "opacity": ("P", 1),
    "xyz_t": ("P", 3, "K"),
    "shs_t": ("P", "C", 3, "K"),
    "scale_t": ("P", 3, "K"),
    "rot_t": ("P", 4, "K"),
    "opacity_t": ("P", 1, "K"),
    "pos_t": (36, "P", 3),
    "W": ("P", 5),
    "eyelid": ("P", 3, 2),
}
MOUTH_FIELDS = ("pos", "shs", "scale", "rot", "opacity")
RAW_SHAPES: dict[str, tuple[object, ...]] = {
    "xyz": ("P", 3),
    "features_dc": ("P", 1, 3),
    "features_rest": ("P", "C - 1", 3),
    "scaling": ("P", 3),
    "rotation": ("P", 4),
    "opacity": ("P", 1),
    "xyz_b": ("P", 3, "K"),
    "features_b": ("P", "C", 3, "K"),
    "scaling_b": ("P", 3, "K"),
    "rotation_b": ("P", 4, "K"),
    "opacity_b": ("P", 1, "K"),
    "init_xyz": ("P", 3, "K"),
    "init_rot": ("P", 4, "K"),
    "init_sh": ("P", "C", 3, "K"),
    "pose_blendshape": (36, "P", 3),
    "eye_blendshape": ("P", 3, 2),
    "expr_mask_tensor": ("P", "K"),
    "W": ("P", 5),
}


@dataclass(frozen=True)
class Model:
    """Where a model lies: `dump` or `raw` files of one iteration."""

    folder: Path
    iteration: str
    form: str  # "dump" | "raw"
    face: Path


@dataclass(frozen=True)
class FaceSource:
    """The face Gaussians, readable by blocks."""

    file: Path
    form: str
    count: int
    coefficients: int
    expressions: int
    sh_degree: int
    block: Callable[[int, int], Block] = field(repr=False)


@dataclass(frozen=True)
class MouthSource:
    """Upper or lower teeth, whole."""

    file: Path
    name: str
    binding: str
    static: dict[str, F32] = field(repr=False)

    @property
    def count(self) -> int:
        return len(self.static["mean"])


def locate(path: Path) -> Model | None:
    """The latest iteration under `path` (a model folder, its dump folder or its fix_chkpnt*.pth).

    Where both forms of it exist the dump is taken: init and mask are folded in already. Name the .pth to force
    the raw form.
    """
    if path.is_file():
        found = _iteration(path, ".pth")
        return Model(path.parent, found, "raw", path) if found is not None else None
    if not path.is_dir():
        return None
    here = _iteration(path, "")
    if here is not None and (path / "xyz_t.npy").is_file():
        return Model(path.parent, here, "dump", path)
    candidates = []
    for entry in sorted(path.iterdir()):
        dump, raw = _iteration(entry, ""), _iteration(entry, ".pth")
        if dump is not None and (entry / "xyz_t.npy").is_file():
            candidates.append((int(dump), 1, Model(path, dump, "dump", entry)))
        if raw is not None and entry.is_file():
            candidates.append((int(raw), 0, Model(path, raw, "raw", entry)))
    return max(candidates, key=lambda c: c[:2])[2] if candidates else None


def open_face(model: Model) -> FaceSource:
    """The face, sizes checked against each other. Raises AvatarError naming file and field."""
    return _open_dump(model.face) if model.form == "dump" else _open_raw(model)


def open_mouths(model: Model) -> list[MouthSource]:
    """Upper and lower teeth, as many as there are files."""
    read = {"": _dump_mouth, ".pth": _raw_mouth}
    return [
        MouthSource(path, name, binding, read[path.suffix](path))
        for path, name, binding in _mouth_paths(model)
    ]


def model_files(model: Model) -> dict[str, Path]:
    """Every file of the model that is read, by its name inside the model folder."""
    paths = [path for path, _, _ in _mouth_paths(model)] + [model.face]
    if model.form == "raw":
        paths.append(model.folder / f"acc{model.iteration}.npy")
    files = []
    for path in paths:
        fields = DUMP_SHAPES if path == model.face else MOUTH_FIELDS
        files += [path / f"{name}.npy" for name in fields] if path.suffix == "" else [path]
    return {file.relative_to(model.folder).as_posix(): file for file in files}


def _mouth_paths(model: Model) -> list[tuple[Path, str, str]]:
    """(folder or .pth, group, binding); for a dump its folder comes first."""
    suffixes = ("", ".pth") if model.form == "dump" else (".pth",)
    found = []
    for stem, name, binding in MOUTHS:
        paths = [model.folder / f"{stem}_chkpnt{model.iteration}{suffix}" for suffix in suffixes]
        found += [(path, name, binding) for path in paths if path.is_dir() or path.is_file()][:1]
    return found


def _iteration(path: Path, suffix: str) -> str | None:
    match = re.fullmatch(r"fix_chkpnt(\d{1,12})" + re.escape(suffix), path.name)
    return match.group(1) if match else None


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
        raise AvatarError(f"belongs to {model.face.name} and is missing", file=acc_file, owner=SYSTEM)
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
        mask = a["expr_mask_tensor"][:, None]  # no upper limit: 7.4 was seen

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
            f"its tuple has {len(loaded[0])} items, {length} are known", file=file, owner=SYSTEM
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
    """P, C and K, after every array's shape was held against the others'."""
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
            f"{sizes['P']} rows of {sizes['C']} SH coefficients", file=file, field="shs", owner=SYSTEM
        )
    return sizes


def _static(mean: F32, sh: F32, log_scale: F32, quat: F32, opacity: F32) -> dict[str, F32]:
    return {
        "mean": mean,
        "log_scale": log_scale,
        "quat_wxyz": quat,
        "opacity_logit": opacity[:, 0],
        "sh": sh,
    }


def _motion(pose: F32, eyelid: F32, weights: F32) -> Block:
    return {
        "correctives": {"mean": np.swapaxes(pose, 0, 1)},
        "late_morphs": {"mean": _k(eyelid)},
        "skin": {"weight": weights},
    }


def _k(values: F32) -> F32:
    """[B, ..., K] -> [B, K, ...]."""
    return np.moveaxis(values, -1, 1)
