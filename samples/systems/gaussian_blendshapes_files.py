"""Gaussian Blendshapes checkpoints as files, in both layouts that the released code writes."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_trainer.head import GAUSSIAN_SHAPES
from samples.subjects.containers import Chunks, Parameter, save_npy, save_npy_dict, save_torch
from samples.systems.gaussian_blendshapes import (
    CHUNK,
    DELTAS,
    INIT,
    LEARNED,
    RAW_STATIC,
    Fields,
    Model,
    chunks,
    fold,
)

Array = npt.NDArray[Any]

ITERATION = 40000
# The order of the learned tensors in the checkpoint's tuple, items 10 to 14.
LEARNED_ORDER = ("xyz_b", "features_b", "scaling_b", "rotation_b", "opacity_b")
ACC_NAME = {"pose": "pose_blendshape", "eye": "eye_blendshape", "mask": "expr_mask_tensor"}
# The optimiser's groups: name, tensor, learning rate.
GROUPS = (
    ("xyz", "xyz", 0.00016),
    ("f_dc", "features_dc", 0.0025),
    ("f_rest", "features_rest", 0.000125),
    ("opacity", "opacity", 0.05),
    ("scaling", "scaling", 0.005),
    ("rotation", "rotation", 0.001),
    ("xyz_b", "xyz_b", 3.2e-07),
    ("f_b", "features_b", 0.00125),
    ("opacity_b", "opacity_b", 5e-05),
    ("scaling_b", "scaling_b", 0.0005),
    ("rotation_b", "rotation_b", 0.0001),
)


def save_dump(model: Model, folder: Path) -> None:
    """The folders that test.py writes for the viewer: rows without a NaN, deltas folded."""
    kept = model.kept
    out = folder / f"fix_chkpnt{ITERATION}"
    save_static({name: model.face[name][kept] for name in RAW_STATIC}, out)
    for name, array in {
        "pos_t": model.face["pose"][:, kept],
        "W": model.face["W"][kept],
        "eyelid": model.face["eye"][kept],
    }.items():
        save_npy(out / f"{name}.npy", Chunks.of(array))
    n = int(kept.sum())
    shapes = {name: (n, *LEARNED[learned], GAUSSIAN_SHAPES) for name, (learned, _) in DELTAS.items()}
    files = {
        name: np.lib.format.open_memmap(out / f"{name}.npy", "w+", np.float32, s)
        for name, s in shapes.items()
    }
    first = 0
    for rows, raw in chunks(model):
        end = first + int(kept[rows].sum())
        for name, delta in fold(raw).items():
            files[name][first:end] = delta[kept[rows]]
        first = end
    for k, fields in enumerate(model.mouth):
        save_static(fields, folder / f"mouth{k}_chkpnt{ITERATION}")


def save_static(fields: Fields, folder: Path) -> None:
    """pos, shs, scale, rot and opacity of one set."""
    folder.mkdir(parents=True, exist_ok=True)
    for name, array in {
        "pos": fields["xyz"],
        "shs": np.concatenate([fields["features_dc"], fields["features_rest"]], axis=1),
        "scale": fields["scaling"],
        "rot": fields["rotation"],
        "opacity": fields["opacity"],
    }.items():
        save_npy(folder / f"{name}.npy", Chunks.of(array))


def save_raw(model: Model, folder: Path) -> None:
    """The training output: fix_chkpnt*.pth, acc*.npy, mouth0 and mouth1_chkpnt*.pth."""
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as spool:
        fields = {name: Chunks.of(a) for name, a in model.face.items()} | spooled(model, Path(spool))
        first_points = (
            len(model.samples.face) * 4 // 5
        )  # densification keeps those of the initial points only
        tensors = (
            *statistics(model.count),
            *(Parameter(fields[name]) for name in LEARNED_ORDER),
            Chunks.of(model.samples.face[:first_points].astype(np.int64)),
            Chunks.of(model.samples.bary[:first_points].astype(np.float32)),
        )
        parameters = tuple(Parameter(fields[name]) for name in RAW_STATIC)
        state = (3, *parameters, *tensors, optimiser(fields, GROUPS), 1.0)
        save_torch(folder / f"fix_chkpnt{ITERATION}.pth", (state, ITERATION))
        names = ("init_rot", "init_sh", "init_xyz", "pose", "eye", "mask", "W")
        save_npy_dict(folder / f"acc{ITERATION}.npy", {ACC_NAME.get(n, n): fields[n] for n in names})
    for k, mouth in enumerate(model.mouth):
        fields = {name: Chunks.of(a) for name, a in mouth.items()}
        parameters = tuple(Parameter(fields[name]) for name in RAW_STATIC)
        state = (3, *parameters, *statistics(len(mouth["xyz"])), optimiser(fields, GROUPS[:6]), 1.0)
        save_torch(folder / f"mouth{k}_chkpnt{ITERATION}.pth", (state, ITERATION))


def spooled(model: Model, folder: Path) -> dict[str, Chunks]:
    """The moved fields as Chunks over files in `folder`: they are made once and read in several orders."""
    names = {**LEARNED, **INIT, "mask": ()}
    files = {name: (folder / name).open("wb") for name in names}
    for _, raw in chunks(model):
        for name, file in files.items():
            file.write(np.ascontiguousarray(raw[name], "<f4").data)
    for file in files.values():
        file.close()
    return {n: from_file(folder / n, (model.count, *s, GAUSSIAN_SHAPES)) for n, s in names.items()}


def from_file(path: Path, shape: tuple[int, ...]) -> Chunks:
    """An array that lies in a file, CHUNK rows at a time."""

    def pieces() -> Iterator[Array]:
        row = int(np.prod(shape[1:]))
        with path.open("rb") as file:
            for first in range(0, shape[0], CHUNK):
                rows = min(CHUNK, shape[0] - first)
                yield np.fromfile(file, "<f4", rows * row).reshape(rows, *shape[1:])

    return Chunks(shape, pieces)


def statistics(count: int) -> tuple[Chunks, Chunks, Chunks]:
    """The densification's counters: largest radius [P], gradient sum [P, 1], number of views [P, 1]."""
    ramp = np.linspace(0, 1, count, dtype=np.float32)
    return (
        Chunks.of(ramp * 20),
        Chunks.of(ramp[:, None] * np.float32(1e-4)),
        Chunks.of(np.ones((count, 1), np.float32)),
    )


def optimiser(fields: dict[str, Chunks], groups: tuple[tuple[str, str, float], ...]) -> dict[str, Any]:
    """Adam's state_dict with both moments of every tensor."""
    state, param_groups = {}, []
    for k, (name, field, rate) in enumerate(groups):
        state[k] = {
            "step": ITERATION,
            "exp_avg": mapped(fields[field], lambda x: x * np.float32(1e-3)),
            "exp_avg_sq": mapped(fields[field], lambda x: x * x * np.float32(1e-6)),
        }
        group = {"lr": rate, "name": name, "betas": (0.9, 0.999), "eps": 1e-15, "weight_decay": 0}
        param_groups.append({**group, "amsgrad": False, "params": [k]})
    return {"state": state, "param_groups": param_groups}


def mapped(array: Chunks, function: Callable[[Array], Array]) -> Chunks:
    """The function of an array, piece by piece."""
    return Chunks(array.shape, lambda: map(function, array.make()), array.dtype)


def save_cfg_args(folder: Path) -> None:
    """The Namespace that training prints into the model folder."""
    folder.mkdir(parents=True, exist_ok=True)
    settings = {
        "sh_degree": 3,
        "source_path": "data/head",
        "model_path": "output/head",
        "white_bkgd": False,
        "iterations": ITERATION,
        "use_nerfBS": False,
        "use_HR": False,
        "back_head_file": "data/FLAME2020/back_of_head.txt",
        "update_consistency": False,
        "num_shape_params": 300,
        "num_exp_params": 100,
    }
    (folder / "cfg_args").write_text(repr(argparse.Namespace(**settings)))
