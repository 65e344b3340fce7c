"""Backend `cpu` up to activate: every rule against the reference, and against what released code computed."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from typing import Any

import numba
import numpy as np
import numpy.typing as npt
import pytest

from avatar_runtime.avatar import Avatar, Blendshapes, Expression, Rules, SparseRows
from avatar_runtime.backends import cpu, make_backend, reference
from avatar_runtime.backends.cpu import skinned, threads
from avatar_runtime.backends.cpu.jit import SOURCES
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.posed import Clock, Posed
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.rules import ANCHOR_RULES, QUATERNION_SIGNS, SH_DIRECTIONS, SKIN_ROTATIONS, SURFACE_RULES
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.groups import group_transforms
from tests.avatars import COUNT, full_avatar, surface_avatar
from tests.golden import FRAMES, BlendshapesGolden
from tests.measured import Measure
from tests.runtime.golden_model import GoldenModel, golden_joints

Array = npt.NDArray[Any]
FIELDS = ("mean", "scale", "quat_wxyz", "opacity", "sh", "sh_rotation")
RELATIVE = 1e-5
CAMERA = Camera.orbit(np.zeros(3), 0.6, 0.3, 0.1, 0.5, 48, 40)


def random_pose(avatar: Avatar, seed: int) -> Pose:
    """About half of the weights 0, every joint turned and moved; every second pose is placed in the world."""
    rng = np.random.default_rng(seed)
    names = avatar.expression_names
    weights = np.where(rng.uniform(size=len(names)) < 0.5, 0, rng.uniform(-0.4, 1.2, len(names)))
    joints = avatar.rig.joint_names if avatar.rig else ()
    turns = {j: homogeneous(matrix_from_rotvec(rng.normal(0, 0.5, 3)), rng.normal(0, 0.01, 3)) for j in joints}
    lids = {name: float(rng.uniform(0, 1)) * (seed % 3 > 0) for name in avatar.late_morph_names}
    world = homogeneous(matrix_from_rotvec(rng.normal(0, 1, 3)), rng.normal(0, 0.1, 3))
    return Pose(dict(zip(names, weights, strict=True)), turns, lids, world if seed % 2 else np.eye(4))


def wide_avatar() -> Avatar:
    """`full_avatar` with each Gaussian 45 times over and 130 expressions: many blocks, more columns than mask bits."""
    avatar = full_avatar(5)
    rows = np.concatenate([np.tile(np.arange(g.first, g.first + g.count), 45) for g in avatar.groups])
    g, b = avatar.gaussians, avatar.blendshapes

    def apart(sparse: SparseRows) -> SparseRows:
        taken = sparse.take(rows)
        return replace(taken, column=(taken.column * 43).astype(np.uint16), columns=130)

    return replace(
        avatar,
        gaussians=replace(
            g, **{name: getattr(g, name)[rows] for name in (*FIELDS[:1], *("log_scale", "quat_wxyz"), "sh")}
        ),
        blendshapes=b,
    )
