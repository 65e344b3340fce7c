"""How much images show of each Gaussian's colour, and from which directions."""

from __future__ import annotations

import weakref
from dataclasses import dataclass

import numpy as np

from avatar_export.levels.compositing import shown
from avatar_export.levels.views import SIZE, flattened, views
from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.player import Player
from avatar_runtime.stages.project import colour_directions, sh_colour

VIEWS = 24  # most from the front, some from all around
STRIDE = 2  # pixels
LEAST = 0.01  # of the mean weight: a Gaussian that no view shows may be seen in another pose
ALL_AROUND = 0.02  # part of the directions that are taken to be everywhere alike
_kept: list[tuple[weakref.ref[Avatar], Seen]] = []
KEPT = 4  # avatars whose result is kept


@dataclass(frozen=True)
class Seen:
    """What an error of spherical harmonics e [T] of Gaussian n costs in images: weight[n] * e^T directions e."""

    weight: F64  # [N] mean 1
    directions: F64  # [T, T] symmetric, positive definite; its diagonal has the mean 1


def seen(avatar: Avatar) -> Seen:
    """`Seen` of an avatar, over poses within its ranges. The last few avatars' are kept."""
    for known, found in _kept:
        if known() is avatar:
            return found
    found = _measured(avatar)
    _kept[:] = [(weakref.ref(avatar), found), *_kept[: KEPT - 1]]
    return found


def _measured(avatar: Avatar) -> Seen:
    n, terms = avatar.gaussians.count, avatar.gaussians.sh.shape[1]
    entries = np.diff(avatar.blendshapes.appearance.row_ptr)
    one_each = np.eye(terms, dtype=np.float32)[None]
    weight, directions = np.zeros(n), np.zeros((terms, terms))
    player, size = Player(avatar), SIZE // STRIDE
    for view in views(avatar, VIEWS):
        splats = player.animate(view.pose)
        flat = flattened(avatar, splats, view.camera, STRIDE)
        here = np.zeros(n)
        here[flat.row] = shown(flat, size, size)
        weight += here
        basis = sh_colour(one_each, colour_directions(splats, view.camera.centre), avatar.sh_degree) - 0.5
        basis[~np.isfinite(basis).all(axis=1)] = 0  # of Gaussians that this pose moves beyond float32
        directions += np.einsum("n,nj,nk->jk", here * entries, basis, basis, optimize=True)
    weight /= max(float(weight.mean()), 1e-30)
    directions /= max(float(directions.trace()) / terms, 1e-30)
    even = ALL_AROUND * np.eye(terms)
    return Seen(np.maximum(weight, LEAST), (1 - ALL_AROUND) * directions + even)
