"""A small person of LHM on a small body of SMPL-X's layout, written field by field."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from samples.systems import lhm as sample
from samples.systems.ply import ply_bytes

from avatar_export.options import ReadOptions
from tests.exporter.bodies import body_files

Array = npt.NDArray[Any]

COUNT, IDENTITY = 90, 10


def options(folder: Path) -> ReadOptions:
    """What a user gives beside person.ply. The Gaussians are random: they fit no body."""
    return ReadOptions(dataset=folder / "pretrained_models", shape=folder / "betas.npy", accept_misfit=True)


class Person:
    """A body of 55 joints, sampled points and Gaussians on it."""

    def __init__(self, folder: Path, joints: tuple[int, ...] = sample.PARENTS) -> None:
        rng = np.random.default_rng(8)
        self.body = body_files.body(joints)
        v = len(self.body["v_template"])
        self.dirs = rng.normal(0, 0.01, (v, 3, 2 * IDENTITY)).astype("f4")
        self.betas = rng.normal(0, 1, IDENTITY)
        half = rng.integers(0, len(joints), len(self.body["weights"][::2]))
        self.body["weights"][::2] = np.eye(len(joints))[half]
        self.points = rng.normal(0, 0.3, (COUNT, 3)).astype("f4")
        self.mean = (self.points + rng.normal(0, 0.02, (COUNT, 3))).astype("f4")
        self.quat = rng.normal(0, 1, (COUNT, 4)).astype("f4")
        self.file, self.models = folder / "person.ply", folder / "pretrained_models"
        columns = dict(zip("xyz", self.mean.T, strict=True)) | {f"n{axis}": np.zeros(COUNT) for axis in "xyz"}
        columns |= {name: rng.normal(0, 1, COUNT) for name in ("f_dc_0", "f_dc_1", "f_dc_2", "opacity")}
        columns |= {f"scale_{k}": rng.normal(-4, 1, COUNT) for k in range(3)}
        columns |= {f"rot_{k}": self.quat[:, k] for k in range(4)}
        (self.models / "dense_sample_points").mkdir(parents=True)
        self.file.write_bytes(ply_bytes(columns))
        self.store(self.points)
        np.save(folder / "betas.npy", self.betas)
        tree = {"shapedirs": self.dirs, "kintree_table": np.array([joints, range(len(joints))])}
        kept = ("v_template", "triangles", "posedirs", "regressor", "weights")
        body_files.write_body(
            self.models / "SMPLX_NEUTRAL.npz", {name: self.body[name] for name in kept} | tree
        )
        self.options = options(folder)

    def store(self, points: Array) -> None:
        stored = ply_bytes(dict(zip("xyz", points.T, strict=True)))
        (self.models / "dense_sample_points" / f"1_{COUNT}.ply").write_bytes(stored)
