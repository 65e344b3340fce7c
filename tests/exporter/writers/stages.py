"""Stages of small avatars for tests of USD files, and where their Gaussians reach."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from avatar_export.writers.usd.stage import rig_usdc
from avatar_runtime.avatar import Avatar
from tests.oracles.usd_pose import stage_of


def written(avatar: Avatar) -> Any:
    """A stage that may be edited, of what is written for an avatar."""
    with TemporaryDirectory() as folder:
        file = Path(folder, "rig.usdc")
        file.write_bytes(rig_usdc(avatar))
        return stage_of(str(file))


def ends(avatar: Avatar) -> Any:
    """Both ends of every Gaussian's axes at three standard deviations."""
    g, found = avatar.gaussians, []
    for mean, log_scale, (w, x, y, z) in zip(g.mean, g.log_scale, unit(g.quat_wxyz), strict=True):
        axes = np.array(
            [
                [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
                [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
                [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
            ]
        )
        reach = 3 * np.exp(log_scale.astype(np.float64))[:, None] * axes
        found += [mean + reach, mean - reach]
    return np.concatenate(found)


def unit(quat: Any) -> Any:
    return quat / np.linalg.norm(quat.astype(np.float64), axis=1, keepdims=True)
