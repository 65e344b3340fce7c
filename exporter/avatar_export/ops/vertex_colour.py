"""Colours for the mesh of an avatar, from the Gaussians near each vertex in the binding pose.

The mesh in files for engines has no texture; with these colours it resembles the avatar.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, Avatar, Gaussians, Rig
from avatar_runtime.stages.activate import sigmoid
from avatar_schema import constants

LEVELS = 8  # grids, each twice as coarse as the previous
FINEST = 256  # cells along the diagonal of the mesh's box
ENOUGH = 1.0  # sum of opacities near a vertex that is enough for a colour
GREY = 0.6  # display-referred, for vertices without Gaussians nearby


def vertex_colours(avatar: Avatar, rig: Rig) -> F32:
    """Display-referred colours [V, 3], 0..1, of the rig's vertices.

    Each is the mean degree-0 colour of the Gaussians around it, weighted by opacity, in the finest grid whose
    cells around the vertex hold ENOUGH opacity.
    """
    vertices = rig.vertices if avatar.embedding is None else avatar.embedding.canonical_vertices
    low, high = vertices.min(axis=0).astype(np.float64), vertices.max(axis=0).astype(np.float64)
    cell = max(float(np.linalg.norm(high - low)), 1e-9) / FINEST
    weighted = _weighted_colours(avatar.gaussians)
    result = np.full((len(vertices), 3), GREY)
    open_rows = np.arange(len(vertices))
    for level in range(LEVELS):
        sums = _around(avatar.gaussians.mean, weighted, vertices[open_rows], low, cell * 2**level)
        enough = sums[:, 3] >= ENOUGH
        result[open_rows[enough]] = sums[enough, :3] / sums[enough, 3:]
        open_rows = open_rows[~enough]
        if not len(open_rows):
            break
    return result.astype(np.float32)


def linear_from_display(colour: npt.NDArray[np.floating]) -> F64:
    """sRGB transfer to linear light, 0..1."""
    c = colour.astype(np.float64)
    result: F64 = np.where(c <= 0.04045, c / 12.92, ((c + 0.055) / 1.055) ** 2.4)
    return result


def _weighted_colours(gaussians: Gaussians) -> F64:
    """[N, 4]: opacity times colour, and opacity."""
    opacity = sigmoid(gaussians.opacity_logit).astype(np.float64)[:, None]
    colour = np.clip(0.5 + constants()["sh_c0"][0] * gaussians.sh[:, 0].astype(np.float64), 0, 1)
    return np.concatenate([opacity * colour, opacity], axis=1)


def _around(mean: F32, weighted: F64, vertices: F32, low: F64, cell: float) -> F64:
    """[V, 4] sums over the 2 x 2 x 2 cells nearest to each vertex, with trilinear weights."""
    key = _keys(np.floor((mean - low) / cell))
    cells, inverse = np.unique(key, return_inverse=True)
    sums = np.stack([np.bincount(inverse, column, len(cells)) for column in weighted.T], axis=1)
    place = (vertices - low) / cell - 0.5
    corner, part = np.floor(place), place - np.floor(place)
    total = np.zeros((len(vertices), 4))
    for step in np.ndindex(2, 2, 2):
        share = np.prod(np.where(np.array(step) == 1, part, 1 - part), axis=1)
        wanted = _keys(corner + step)
        at = np.minimum(np.searchsorted(cells, wanted), len(cells) - 1)
        total += np.where(cells[at] == wanted, share, 0)[:, None] * sums[at]
    return total


def _keys(cells: F64) -> npt.NDArray[np.int64]:
    """One number for each cell [..., 3]; distant cells share a border cell."""
    x, y, z = np.clip(cells, -(1 << 19), (1 << 19) - 1).astype(np.int64).T + (1 << 19)
    result: npt.NDArray[np.int64] = (x << 40) | (y << 20) | z
    return result
