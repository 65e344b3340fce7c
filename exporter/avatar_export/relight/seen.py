"""From where each Gaussian is seen, over poses and views: what is seen faces the viewer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_export.levels.compositing import contribution
from avatar_export.levels.views import SIZE, flattened, views
from avatar_export.ops.normals import unit
from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.player import Player
from avatar_runtime.rotation import matrix_from_quat

VIEWS, STRIDE = 30, 3  # pixels


@dataclass(frozen=True)
class Seen:
    """How much of each Gaussian images show, and from where."""

    weight: F64  # [N] pixels, summed over the views
    towards: (
        F64  # [N, 3] mean direction to the viewers, in the axes of each Gaussian; 0 to 1 long, 0 where unseen
    )


def seen(avatar: Avatar) -> Seen:
    """`Seen` of an avatar."""
    n, size, player = avatar.gaussians.count, SIZE // STRIDE, Player(avatar)
    weight, towards = np.zeros(n), np.zeros((n, 3))
    for view in views(avatar, VIEWS):
        splats = player.animate(view.pose)
        flat = flattened(avatar, splats, view.camera, STRIDE)
        here, row = contribution(flat, size, size), flat.row
        turn = matrix_from_quat(splats.quat_wxyz[row].astype(np.float64))
        to = unit(view.camera.centre.astype(np.float64) - splats.mean[row])
        weight[row] += here
        towards[row] += here[:, None] * np.einsum("nji,nj->ni", turn, to)
    return Seen(weight, towards / np.maximum(weight, 1e-9)[:, None])
