"""Spherical harmonics turned with a Gaussian, and turned back."""

from __future__ import annotations

from functools import cache

import numpy as np

from avatar_runtime.avatar import F32, F64
from avatar_runtime.stages.project import sh_colour

PIECE = 1 << 18  # coefficients' rows that are turned at once
SEED = 3


def turned_sh(sh: F32, rotation: F32) -> F32:
    """SH [..., K, 3] of the function f'(d) = f(R^T d), for rotations R [..., 3, 3] that broadcast over the rows.

    The turned function is sampled in K directions, which determine its coefficients exactly.
    """
    count = sh.shape[-2]
    if count == 1:
        return sh
    lead = sh.shape[:-2]
    rows = sh.reshape(-1, count, 3)
    turns = np.broadcast_to(rotation, (*lead, 3, 3)).reshape(-1, 3, 3)
    direction, inverse = _samples(count)
    out = np.empty_like(rows)
    for first in range(0, len(rows), PIECE):
        part = slice(first, first + PIECE)
        seen = [
            sh_colour(rows[part], d.astype(np.float32) @ turns[part], _degree(count)) - np.float32(0.5)
            for d in direction
        ]
        out[part] = np.einsum("ki,inc->nkc", inverse.astype(np.float32), np.stack(seen))
    return out.reshape(sh.shape)


def _degree(count: int) -> int:
    return int(np.sqrt(count)) - 1


@cache
def _samples(count: int) -> tuple[F64, F64]:
    """(directions [K, 3], inverse of the basis in these directions [K, K]), the best conditioned of a few."""
    rng = np.random.default_rng(SEED)
    best: tuple[float, F64, F64] | None = None
    for _ in range(200):
        direction = rng.normal(size=(count, 3))
        direction /= np.linalg.norm(direction, axis=1, keepdims=True)
        unit = np.eye(count, dtype=np.float32)
        basis = np.stack(
            [
                sh_colour(np.repeat(unit[k][None, :, None], count, axis=0).repeat(3, axis=2),
                          direction.astype(np.float32), _degree(count))[:, 0] - 0.5
                for k in range(count)
            ],
            axis=1,
        ).astype(np.float64)  # fmt: skip
        condition = float(np.linalg.cond(basis))
        if best is None or condition < best[0]:
            best = (condition, direction, np.linalg.inv(basis).astype(np.float64))
    assert best is not None
    return best[1], best[2]
