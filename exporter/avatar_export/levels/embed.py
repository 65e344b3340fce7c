"""Embeds Gaussians again after their means have moved in the binding pose."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from avatar_export.ops.rings import rings
from avatar_runtime.avatar import F64, I64, Embedding, Rules
from avatar_runtime.rotation import quat_multiply
from avatar_runtime.rules import NORMAL_POSITIONS
from avatar_runtime.stages.surface import binding_pose, prepare, triangle_shape, vertex_normals

STEPS = 8  # of Newton's method; the map is nearly linear inside a triangle
OUTSIDE = 1e-3  # by which a barycentric may lie below 0, as trained ones do
STAY = 0.1  # of the change of height, against the distance that is left; among the neighbours only
BLOCK = 1 << 13  # Gaussians at once


def embedded(
    start: Embedding,  # [n] rows: where each Gaussian was, or the Gaussian that it is made of mostly
    rules: Rules,
    training_per_bundle: float,
    mean: F64,  # [n, 3] wanted in the binding pose
    quat_wxyz: F64,  # [n, 4] wanted in the binding pose
) -> Embedding:
    """The embedding that gives `mean` and `quat_wxyz` in the binding pose.

    A Gaussian stays on its triangle if its mean lies over it. Otherwise the neighbour that shares a vertex is taken
    over which it lies, with the height most like before. Where it lies over none (beyond a border), the nearest point
    over one of them is taken.
    """
    triangle = start.triangle.astype(np.int64)
    result = start
    if rules.position in NORMAL_POSITIONS:
        chosen, weight, height = triangle.copy(), np.empty((len(mean), 3)), np.empty(len(mean))
        solver = _Solver(start, rules, training_per_bundle)
        for at in range(0, len(mean), BLOCK):
            rows = slice(at, at + BLOCK)
            chosen[rows], weight[rows], height[rows] = solver.solve(rows, mean[rows])
        result = replace(
            start,
            triangle=chosen.astype(np.uint32),
            barycentric=weight.astype(np.float32),
            displacement=height.astype(np.float32),
        )
    else:
        shape = triangle_shape(start.canonical_vertices, start.triangles, rules)
        corner = start.canonical_vertices.astype(np.float64)[start.vertex_ids]
        foot = np.einsum("nc,ncx->nx", start.barycentric, corner)
        offset = np.einsum("nji,nj->ni", shape.frame[triangle], mean - foot) / shape.size[triangle, None]
        result = replace(start, local_offset=offset.astype(np.float32))
    still = np.tile(np.array([1, 0, 0, 0], np.float32), (len(mean), 1))
    unturned = replace(result, local_quat_wxyz=still)
    turn = binding_pose(unturned, rules, training_per_bundle)[1].astype(np.float64)
    local = quat_multiply(turn * [1, -1, -1, -1], quat_wxyz)
    return replace(result, local_quat_wxyz=local.astype(np.float32))


class _Solver:
    """Finds triangle, barycentrics and displacement for means over a mesh with vertex normals."""

    def __init__(self, start: Embedding, rules: Rules, training_per_bundle: float) -> None:
        surface = prepare(start, rules, training_per_bundle)
        self.start = start
        self.points = start.canonical_vertices.astype(np.float64)
        self.normals = vertex_normals(surface, start.canonical_vertices)
        self.flat = ~(surface.canonical.size > 0)
        self.unit = rules.position == "normal"
        self.around = rings(start.triangles, len(start.canonical_vertices))

    def solve(self, rows: slice, mean: F64) -> tuple[I64, F64, F64]:
        """(triangle [n], barycentric [n, 3], displacement [n]) of the Gaussians `rows`."""
        own = self.start.triangle[rows].astype(np.int64)
        at, before = (
            self.start.barycentric[rows].astype(np.float64),
            self.start.displacement[rows].astype(np.float64),
        )
        weight, height, apart = self._on(own, mean, at, before)
        chosen, moved = own.copy(), np.flatnonzero(apart > 1e-7)
        if len(moved):
            candidates = self.around[own[moved]]
            count = candidates.shape[1]
            third = np.full((len(moved), count, 3), 1 / 3)
            former = np.repeat(before[moved, None], count, axis=1)
            third[:, 0] = at[moved]
            found = self._on(candidates, np.repeat(mean[moved, None], count, axis=1), third, former)
            score = found[2] + STAY * np.abs(found[1] - former)
            best = np.argmin(np.where(np.isfinite(score), score, np.inf), axis=1)
            pick = (np.arange(len(moved)), best)
            chosen[moved], weight[moved], height[moved] = candidates[pick], found[0][pick], found[1][pick]
        lost = ~(np.isfinite(weight).all(axis=1) & np.isfinite(height))
        chosen[lost], weight[lost], height[lost] = own[lost], at[lost], before[lost]
        return chosen, weight, height

    @np.errstate(all="ignore")
    def _on(self, triangle: I64, mean: F64, weight: F64, height: F64) -> tuple[F64, F64, F64]:
        """(barycentric, displacement, distance from the mean) over `triangle` [...], limited to what lies over it."""
        corner = self.start.triangles[triangle]
        points, normals = self.points[corner], self.normals[corner]
        weight, height = _newton(points, normals, mean, self.unit, weight, height)
        weight = np.maximum(weight, -OUTSIDE / 2)
        weight = weight / weight.sum(axis=-1, keepdims=True)
        normal = np.einsum("...c,...cx->...x", weight, normals)
        if self.unit:
            normal = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
        rest = mean - np.einsum("...c,...cx->...x", weight, points)
        height = np.sum(rest * normal, axis=-1) / np.sum(normal * normal, axis=-1)
        apart = np.linalg.norm(rest - height[..., None] * normal, axis=-1)
        return weight, height, np.where(self.flat[triangle] | ~np.isfinite(apart), np.inf, apart)


def _newton(
    points: F64, normals: F64, mean: F64, unit_normal: bool, weight: F64, height: F64
) -> tuple[F64, F64]:
    """(barycentric [..., 3], height [...]) with foot + height * normal = mean; not finite without a foot."""
    for _ in range(STEPS):
        normal = np.einsum("...c,...cx->...x", weight, normals)
        slope = normals
        if unit_normal:
            length = np.linalg.norm(normal, axis=-1)[..., None]
            normal = normal / length
            along = np.einsum("...cx,...x->...c", normals, normal)
            slope = (normals - along[..., None] * normal[..., None, :]) / length[..., None]
        rest = mean - np.einsum("...c,...cx->...x", weight, points) - height[..., None] * normal
        moved = points + height[..., None, None] * slope
        u, v = moved[..., 1, :] - moved[..., 0, :], moved[..., 2, :] - moved[..., 0, :]
        across = np.cross(u, v)
        volume = np.sum(across * normal, axis=-1)
        b = np.sum(np.cross(rest, v) * normal, axis=-1) / volume
        c = np.sum(np.cross(u, rest) * normal, axis=-1) / volume
        height = height + np.sum(across * rest, axis=-1) / volume
        step = np.clip(np.stack([-b - c, b, c], axis=-1), -1, 1)
        weight = weight + step - step.sum(axis=-1, keepdims=True) / 3
    return weight, height
