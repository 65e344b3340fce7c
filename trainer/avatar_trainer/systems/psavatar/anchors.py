"""The triangle that holds a place off the mesh the steadiest, of all whose normals lead there.

The paper draws a triangle and a distance, and the place follows. In motion the normals of lids, brows and cheeks swing
what stands far off by centimetres, and most places before a face lie on such normals; but those of triangles that hold
still, far behind, lead to nearly all of them, too.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import prange

from avatar_runtime import F64, I64
from avatar_runtime.backends.cpu import Scalar, inlined, kernel

REACH = 0.15  # metres from a triangle to what it may hold
PER_METRE = 0.01  # of swing that a distance counts as: what errors of normals do grows with it
STEPS = 6  # of Newton's method
NEARLY = 1e-7  # metres


class Anchors(NamedTuple):
    """Of M places: x = sum_k b_k (v_k + d n_k)."""

    triangle: I64  # [M]; -1 where no triangle leads there
    barycentric: F64  # [M, 3], none below 0
    distance: F64  # [M] d, metres, above 0


def anchored(place: F64, vertices: F64, normals: F64, triangles: I64, moved: F64, turned: F64) -> Anchors:
    """The anchors of places [M, 3] with the least swing: `moved` + d (`turned` + PER_METRE), both [F].

    `normals` [V, 3] of `vertices` [V, 3], as the mesh has them at rest.
    """
    corner, normal = vertices[triangles], normals[triangles]
    order = np.argsort(moved, kind="stable")
    cost = turned + PER_METRE
    return Anchors(
        *_anchored(place, corner, normal, corner.mean(axis=1), normal.mean(axis=1), order, moved, cost)
    )


@kernel(parallel=True)
def _anchored(
    place: F64, corner: F64, normal: F64, middle: F64, along: F64, order: I64, moved: F64, cost: F64
) -> tuple[I64, F64, F64]:
    n = len(place)
    triangle, distance = np.full(n, -1, np.int64), np.zeros(n)
    barycentric = np.zeros((n, 3))
    for i in prange(n):
        least = np.inf
        weight, x = np.zeros(3), place[i]
        for f in order:
            if moved[f] >= least:
                break  # the triangles after it are less steady
            d = _distance_along(x, middle[f], along[f])
            if d <= 0 or d > REACH or moved[f] + 0.5 * d * cost[f] >= least:
                continue
            if not _may_hold(x, corner[f], normal[f], middle[f], along[f], d):
                continue
            d = _solved(x, corner[f], normal[f], d, weight)
            swing = moved[f] + d * cost[f]
            if 0 < d <= REACH and swing < least:
                least, triangle[i], distance[i] = swing, f, d
                barycentric[i] = weight
    return triangle, barycentric, distance


@inlined
def _distance_along(x: F64, middle: F64, along: F64) -> Scalar:
    """Metres from the middle of a triangle to the foot of x on its normal."""
    up, square = 0.0, 0.0
    for k in range(3):
        up += (x[k] - middle[k]) * along[k]
        square += along[k] * along[k]
    return up / max(square, 1e-12)


@inlined
def _may_hold(x: F64, corner: F64, normal: F64, middle: F64, along: F64, d: float) -> bool:
    """Whether x lies within the circle about the middle of the triangle, d off, in which its corners are."""
    off, radius = 0.0, 0.0
    for k in range(3):
        off += (x[k] - middle[k] - d * along[k]) ** 2
    for c in range(3):
        square = 0.0
        for k in range(3):
            square += (corner[c, k] - middle[k] + d * (normal[c, k] - along[k])) ** 2
        radius = max(radius, square)
    return off <= 1.1 * radius


@inlined
def _solved(x: F64, corner: F64, normal: F64, d: float, weight: F64) -> Scalar:
    """The d at which x is in the triangle of the corners v_k + d n_k, and its `weight` [3] there; -1 if none is."""
    a, b, c = np.empty(3), np.empty(3), np.empty(3)
    height = np.inf
    for _ in range(STEPS):
        for k in range(3):
            a[k] = corner[0, k] + d * normal[0, k] - x[k]
            b[k] = corner[1, k] + d * normal[1, k] - x[k]
            c[k] = corner[2, k] + d * normal[2, k] - x[k]
        across = np.empty(3)
        _cross(b, c, across)
        wa = across.copy()
        _cross(c, a, across)
        wb = across.copy()
        _cross(a, b, across)
        for k in range(3):
            across[k] += wa[k] + wb[k]  # twice the area times the normal of the triangle
        square = across[0] ** 2 + across[1] ** 2 + across[2] ** 2
        if square < 1e-24:
            return -1.0
        rise = height = 0.0
        for k in range(3):
            height += a[k] * across[k]
            rise += (normal[0, k] + normal[1, k] + normal[2, k]) / 3 * across[k]
        if rise <= 0:
            return -1.0
        height /= math.sqrt(square)
        if abs(height) < NEARLY:
            for j, w in enumerate((wa, wb)):
                weight[j] = (w[0] * across[0] + w[1] * across[1] + w[2] * across[2]) / square
            weight[2] = 1 - weight[0] - weight[1]
            return d if min(weight[0], weight[1], weight[2]) >= 0 else -1.0
        d -= height * math.sqrt(square) / rise
    return -1.0


@inlined
def _cross(p: F64, q: F64, out: F64) -> None:
    out[0] = p[1] * q[2] - p[2] * q[1]
    out[1] = p[2] * q[0] - p[0] * q[2]
    out[2] = p[0] * q[1] - p[1] * q[0]
