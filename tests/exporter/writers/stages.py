"""Stages of small avatars for tests of USD files, and where their Gaussians reach."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from avatar_export.writers.usd.stage import rig_usdc
from avatar_runtime.avatar import Avatar
from tests.oracles.gltf_pose import quaternion_matrix
from tests.oracles.usd_pose import stage_of


def written(avatar: Avatar) -> Any:
    """A stage that may be edited, of what is written for an avatar."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "rig.usdc")
        file.write_bytes(rig_usdc(avatar))
        return stage_of(str(file))


def ends(avatar: Avatar) -> Any:
    """Both ends of every Gaussian's axes at three standard deviations."""
    reach = 3 * np.exp(avatar.gaussians.log_scale.astype(np.float64))
    turns = np.array([quaternion_matrix([x, y, z, w]) for w, x, y, z in unit(avatar.gaussians.quat_wxyz)])
    axes = np.moveaxis(turns * reach[:, None], 2, 0)
    return np.concatenate([*(avatar.gaussians.mean + axes), *(avatar.gaussians.mean - axes)])


def unit(quat: Any) -> Any:
    return quat / np.linalg.norm(quat.astype(np.float64), axis=1, keepdims=True)
