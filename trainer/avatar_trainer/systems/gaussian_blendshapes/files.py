"""A trained model in the layout of the released code, and rules.json beside it (notes: face_gs_model.py:118-140, 751).

`fix_chkpnt{N}.pth` is (tuple of 19, iteration), `mouth0_` and `mouth1_chkpnt{N}.pth` (tuple of 12, iteration),
`acc{N}.npy` a pickled dict of untrained values. All arrays are dense: [P, ..., K] for every Gaussian and expression.
Dense arrays are laid out in files that are mapped, so memory holds the sparse model only.
"""

from __future__ import annotations

import argparse
import json
import os
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor, nn

from avatar_export.readers import rules_file
from avatar_trainer.systems.gaussian_blendshapes.npy import write_npy_dict
from avatar_trainer.systems.gaussian_blendshapes.rows import Entries, Rows
from avatar_trainer.tensors import Gaussians

Array = npt.NDArray[Any]

STORED_DEGREE = 3  # of the SH in the files; item 0 of the tuple is the active degree
COEFFICIENTS = (STORED_DEGREE + 1) ** 2
FEATURES = 36  # of the pose: R - I of four joints
BLOCK = 4096  # entries laid out at a time
# Attribute -> (its name in the tuple, shape of a Gaussian's values), in the tuple's order.
LEARNED: dict[str, tuple[str, tuple[int, ...]]] = {
    "mean": ("xyz_b", (3,)),
    "sh": ("features_b", (COEFFICIENTS, 3)),
    "log_scale": ("scaling_b", (3,)),
    "quat_wxyz": ("rotation_b", (4,)),
    "opacity_logit": ("opacity_b", (1,)),
}
STATIC_GROUPS = ("xyz", "f_dc", "f_rest", "opacity", "scaling", "rotation")  # of the optimiser
DELTA_GROUPS = ("xyz_b", "f_b", "opacity_b", "scaling_b", "rotation_b")


@dataclass(frozen=True)
class Model:
    """What is saved."""

    gaussians: Gaussians  # [N] in draw order, SH of any degree
    rows: Rows
    learned: Mapping[str, Tensor]  # attribute -> [E', ...]; missing ones are 0
    mask: Tensor  # [E'] what scales all of it
    init_sh: Tensor | None  # [E, K, 3]; None: 0
    parts: tuple[slice, ...]  # rows of the face, and of the upper and lower teeth if there are any
    statistics: tuple[Tensor, Tensor, Tensor]  # [N] largest radius, gradient sum, counter
    sh_degree: int  # active
    expressions: int  # K
    first_points: tuple[
        Tensor, Tensor
    ]  # triangle i64[P0] and barycentric [P0, 3] of the face's first Gaussians
    extent: float
    rates: Mapping[str, float]  # parameter group -> learning rate
    config: Mapping[str, Any]  # cfg_args
    rules: Mapping[str, str]
    training_per_metre: float = 1.0


def save_model(model: Model, system: str, folder: Path, iteration: int) -> None:
    """Write `model` into `folder`; every file appears whole, fix_chkpnt*.pth (which readers look for) last."""
    folder.mkdir(parents=True, exist_ok=True)
    with _written(folder / "rules.json") as path:
        document = {"system": system, rules_file.UNITS: model.training_per_metre, "rules": dict(model.rules)}
        path.write_text(json.dumps(document, indent=1) + "\n", "utf-8")
    with _written(folder / "cfg_args") as path:
        path.write_text(repr(argparse.Namespace(**model.config)), "utf-8")
    for index, rows in enumerate(model.parts[1:]):
        if rows.start == rows.stop:
            continue  # density control has removed them all; this layout has no file for an empty set
        with _written(folder / f"mouth{index}_chkpnt{iteration}.pth") as path:
            torch.save(((*_static(model, rows), *_optimiser(model)), iteration), path)
    with tempfile.TemporaryDirectory(dir=folder, prefix=".dense-") as spool:
        dense = _Dense(model, Path(spool))
        with _written(folder / f"acc{iteration}.npy") as path:
            write_npy_dict(path, _fixed(model, dense))
        with _written(folder / f"fix_chkpnt{iteration}.pth") as path:
            torch.save((_face(model, dense), iteration), path)


@contextmanager
def _written(path: Path) -> Iterator[Path]:
    """A name to write to; afterwards the file is at `path`, whole."""
    partial = path.with_name(f".{path.name}.partial")
    try:
        yield partial
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


class _Dense:
    """Dense arrays [P, ..., K] in files of a folder."""

    def __init__(self, model: Model, folder: Path) -> None:
        self._folder, self._rows, self._columns = folder, model.parts[0].stop, model.expressions

    def array(self, name: str, shape: tuple[int, ...], entries: Entries, values: Tensor | None) -> Array:
        """[P, *shape, K]: `values` [E, ...] of the entries (SH may have fewer coefficients than `shape`), else 0."""
        size = (self._rows, *shape, self._columns)
        if not np.prod(size):
            return np.zeros(size, np.float32)
        file = self._folder / name
        with file.open("wb") as stream:
            stream.truncate(4 * int(np.prod(size)))
        out = np.memmap(file, np.float32, "r+", shape=size)
        if values is not None:
            self._fill(out.reshape(self._rows, shape[0] if shape else 1, -1, self._columns), entries, values)
        return np.asarray(out)

    @staticmethod
    def _fill(out: Array, entries: Entries, values: Tensor) -> None:
        row, column = entries.row().numpy(), entries.column.numpy()
        for first in range(0, len(values), BLOCK):
            at = slice(first, first + BLOCK)
            block = values[at].detach()
            block = block.reshape(len(block), -1, out.shape[2])
            out[row[at], : block.shape[1], :, column[at]] = block.numpy()


def _face(model: Model, dense: _Dense) -> tuple[object, ...]:
    """The tuple of 19."""
    learned = [
        _parameter(torch.from_numpy(dense.array(stored, shape, model.rows.learned, model.learned.get(name))))
        for name, (stored, shape) in LEARNED.items()
    ]
    return (
        *_static(model, model.parts[0]),
        *learned,
        *model.first_points,
        *_optimiser(model, (*STATIC_GROUPS, *DELTA_GROUPS)),
    )


def _fixed(model: Model, dense: _Dense) -> dict[str, Array]:
    rows, face = model.rows, model.parts[0]
    late = torch.zeros(face.stop, 3, 2)
    pose = torch.zeros(FEATURES, face.stop, 3)
    pose[: len(rows.corrective)] = rows.corrective[:, face]
    late[:, :, : len(rows.late)] = rows.late[:, face].permute(1, 2, 0)
    return {
        "init_rot": dense.array("init_rot", (4,), rows.init, rows.init_values[:, 3:]),
        "init_sh": dense.array("init_sh", (COEFFICIENTS, 3), rows.init, model.init_sh),
        "init_xyz": dense.array("init_xyz", (3,), rows.init, rows.init_values[:, :3]),
        "pose_blendshape": pose.numpy(),
        "eye_blendshape": late.numpy(),
        "expr_mask_tensor": dense.array("mask", (), rows.learned, model.mask),
        "W": rows.skin_weights[face].numpy(),
    }


def _static(model: Model, rows: slice) -> tuple[object, ...]:
    """Items 0 to 9 of both tuples."""
    g = model.gaussians
    sh = torch.zeros(rows.stop - rows.start, COEFFICIENTS, 3)
    sh[:, : g.sh.shape[1]] = g.sh[rows].detach()
    tensors = (
        g.mean[rows],
        sh[:, :1],
        sh[:, 1:],
        g.log_scale[rows],
        g.quat_wxyz[rows],
        g.opacity_logit[rows, None],
    )
    radius, *counters = (counter[rows].to(torch.float32) for counter in model.statistics)
    return (
        model.sh_degree,
        *(_parameter(t.detach().clone(memory_format=torch.contiguous_format)) for t in tensors),
        radius.clone(),
        *(counter[:, None].clone() for counter in counters),
    )


def _optimiser(model: Model, groups: tuple[str, ...] = STATIC_GROUPS) -> tuple[dict[str, Any], float]:
    """Adam's state without its moments, which would treble the file (a run goes on from its own checkpoints), and
    what scales the rates of positions."""
    common = {"betas": (0.9, 0.999), "eps": 1e-15, "weight_decay": 0, "amsgrad": False}
    rates = [
        {"lr": model.rates[name], "name": name, **common, "params": [k]} for k, name in enumerate(groups)
    ]
    return {"state": {}, "param_groups": rates}, model.extent


def _parameter(values: Tensor) -> nn.Parameter:
    return nn.Parameter(values)
