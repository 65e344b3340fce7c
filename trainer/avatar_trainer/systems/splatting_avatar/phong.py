"""The point of a Phong surface that carries a given point of space: SplattingAvatar's Eq. 15.

Minimises |V(k,u,v) + d N(k,u,v) - x|^2 over triangle k, weights u v and displacement d: damped Gauss-Newton steps,
each of which walks on the triangles (walk.py) and is taken only if it brings the point nearer.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numba import prange

from avatar_runtime import F64, I32, I64
from avatar_runtime.backends.cpu import kernel
from avatar_trainer.systems.splatting_avatar.walk import Neighbours, walk_one

STEPS = 60  # of a point, at most; most need 5
NEAR_ENOUGH = 1e-7  # of the triangle's longest edge
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-4, 1e-9, 1e7


@dataclass(frozen=True)
class PhongSurface:
    """A mesh in one pose, any unit of length."""

    neighbours: Neighbours
    triangles: I64  # [F, 3]
    vertices: F64  # [V, 3]
    normals: F64  # [V, 3]
    unit_normal: (
        bool  # whether the interpolated normal is made unit (rule `normal`) or not (the paper's Eq. 2)
    )


@dataclass(frozen=True)
class Embedded:
    """The embedding of points on a surface."""

    triangle: I64  # [N]
    barycentric: F64  # [N, 3]
    displacement: F64  # [N] along the interpolated normal
    distance: F64  # [N] from the point asked for, that could not be undone


def embed(surface: PhongSurface, points: F64, triangle: I64, barycentric: F64, displacement: F64) -> Embedded:
    """The embeddings nearest to `points` [N, 3] that a descent from the given ones [N], [N, 3], [N] reaches.

    A local minimum: beside a border, or in a fold, the point itself may not be reached.
    """
    rows, weights = triangle.astype(np.int64), barycentric.astype(np.float64)
    displaced, distance = displacement.astype(np.float64), np.zeros(len(triangle))
    _embed_all(
        surface.neighbours.triangle,
        surface.neighbours.edge,
        surface.triangles,
        surface.vertices,
        surface.normals,
        surface.unit_normal,
        points.astype(np.float64),
        rows,
        weights,
        displaced,
        distance,
    )
    return Embedded(rows, weights, displaced, distance)


@kernel(parallel=True)
def _embed_all(
    over: I32, over_edge: I32, triangles: I64, vertices: F64, normals: F64, unit_normal: bool,
    points: F64, rows: I64, weights: F64, displaced: F64, distance: F64,
) -> None:  # fmt: skip
    for i in prange(len(rows)):
        rows[i], displaced[i], distance[i] = _embed_one(
            over, over_edge, triangles, vertices, normals, unit_normal, points[i], rows[i], weights[i], displaced[i]
        )  # fmt: skip


@kernel()
def _embed_one(
    over: I32, over_edge: I32, triangles: I64, vertices: F64, normals: F64, unit_normal: bool,
    point: F64, triangle: int, b: F64, d: float,
) -> Any:  # fmt: skip
    """(triangle, displacement, distance left) of one point; `b` [3] is changed in place."""
    residual, slopes, step = np.empty(3), np.empty((3, 3)), np.empty(3)
    other_residual, other_slopes = np.empty(3), np.empty((3, 3))
    other_b, shift = np.empty(3), np.empty(3)
    damping = FIRST_DAMPING
    cost = _place(triangles[triangle], vertices, normals, unit_normal, point, b, d, residual, slopes)
    for _ in range(STEPS):
        edge = np.sqrt(max(_dot(slopes[0], slopes[0]), _dot(slopes[1], slopes[1])))
        if np.sqrt(cost) <= NEAR_ENOUGH * edge or damping > MOST_DAMPING:
            break
        _damped_step(slopes, residual, damping, step)
        _slide(over[triangle], b, slopes, residual, damping, step)
        for x in range(3):
            other_b[x] = b[x]
        shift[0], shift[1], shift[2] = step[0], step[1], -(step[0] + step[1])
        other, _ = walk_one(over, over_edge, triangle, other_b, shift, 1.0)
        other_d = d + step[2]
        other_cost = _place(
            triangles[other], vertices, normals, unit_normal, point, other_b, other_d, other_residual, other_slopes
        )  # fmt: skip
        if other_cost < cost:
            triangle, d, cost = other, other_d, other_cost
            for x in range(3):
                b[x] = other_b[x]
            residual, other_residual = other_residual, residual
            slopes, other_slopes = other_slopes, slopes
            damping = max(damping / 10, LEAST_DAMPING)
        else:
            damping *= 10
    return triangle, d, np.sqrt(cost)


@kernel()
def _place(
    corner: I64, vertices: F64, normals: F64, unit_normal: bool, point: F64, b: F64, d: float,
    residual: F64, slopes: F64,
) -> float:  # fmt: skip
    """Squared distance of V + d N to `point`; fills the residual [3] and its derivatives by u, v, d [3, 3]."""
    first, second, last, n = corner[0], corner[1], corner[2], slopes[2]
    for x in range(3):
        n[x] = b[0] * normals[first, x] + b[1] * normals[second, x] + b[2] * normals[last, x]
    length = max(np.sqrt(_dot(n, n)), 1e-30) if unit_normal else 1.0
    total = 0.0
    for x in range(3):
        n[x] /= length
        foot = b[0] * vertices[first, x] + b[1] * vertices[second, x] + b[2] * vertices[last, x]
        residual[x] = foot + d * n[x] - point[x]
        total += residual[x] * residual[x]
    for c in range(2):
        for x in range(3):
            slopes[c, x] = (normals[corner[c], x] - normals[last, x]) / length
        lost = _dot(n, slopes[c]) if unit_normal else 0.0  # a unit normal only turns
        for x in range(3):
            turn = slopes[c, x] - lost * n[x]
            slopes[c, x] = vertices[corner[c], x] - vertices[last, x] + d * turn
    return total


@kernel()
def _damped_step(slopes: F64, r: F64, damping: float, step: F64) -> None:
    """-(J^T J + damping diag(J^T J))^-1 J^T r, by Cramer's rule; no step if that is singular."""
    a, g = np.empty((3, 3)), np.empty(3)
    for c in range(3):
        g[c] = -_dot(slopes[c], r)
        for k in range(3):
            a[c, k] = _dot(slopes[c], slopes[k])
        a[c, c] *= 1 + damping
    determinant = _triple(a[0], a[1], a[2])
    step[0], step[1], step[2] = 0.0, 0.0, 0.0
    if determinant > 0:
        step[0] = _triple(g, a[1], a[2]) / determinant
        step[1] = _triple(a[0], g, a[2]) / determinant
        step[2] = _triple(a[0], a[1], g) / determinant


@kernel()
def _slide(over: I32, b: F64, slopes: F64, r: F64, damping: float, step: F64) -> None:
    """If `step` would cross the border that the point lies on, the best step along that border."""
    for c in range(3):
        change = -(step[0] + step[1]) if c == 2 else step[c]
        if b[c] <= 0 and change < 0 and over[(c + 1) % 3] < 0:
            du, dv = 0.0 if c == 0 else 1.0, 1.0 if c == 0 else 0.0 if c == 1 else -1.0
            along, up = np.empty(3), slopes[2]
            for x in range(3):
                along[x] = du * slopes[0, x] + dv * slopes[1, x]
            aa, bb, ab = (1 + damping) * _dot(along, along), (1 + damping) * _dot(up, up), _dot(along, up)
            ra, rb = _dot(along, r), _dot(up, r)
            determinant = aa * bb - ab * ab
            t = (ab * rb - bb * ra) / determinant
            step[0], step[1], step[2] = t * du, t * dv, (ab * ra - aa * rb) / determinant
            break


@kernel()
def _triple(a: F64, b: F64, c: F64) -> Any:
    x = a[0] * (b[1] * c[2] - b[2] * c[1])
    y = a[1] * (b[2] * c[0] - b[0] * c[2])
    z = a[2] * (b[0] * c[1] - b[1] * c[0])
    return x + y + z


@kernel()
def _dot(a: F64, b: F64) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
