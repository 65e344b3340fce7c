"""Photometric consistency of texels seen by many cameras: `systems.asm_views_energy.photometric_energy`, projection
and sampling included, in one pass for the value and all gradients."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F32, F64, I64
from avatar_runtime.backends.cpu import kernel
from avatar_trainer.kernels.arrays import plain

NEAR = 1e-3  # metres; what is nearer is projected as if it were there
PATCH = 9  # texels


class Scene(NamedTuple):
    """N images of one K, and X texels of a map of M x M."""

    images: F32  # [N, H, W] grey
    focal: F64  # [2] pixels of these images
    principal: F64  # [2] pixel centres at half integers
    row: I64  # [X] of each texel in the flat map
    corner: I64  # [X, 3] vertices of the triangle it lies in
    barycentric: F32  # [X, 3]
    valid: F32  # [N, M, M] 1 where the 3 x 3 texels about a texel are all seen, else 0; 0 on the map's border
    flat: float  # deviation of a patch below which it says little


def consistency(vertices: Tensor, rotation: Tensor, translation: Tensor, scene: Scene) -> Tensor:
    """E_pc, a scalar, of a mesh with `vertices` [V, 3] seen by x_camera = rotation [N, 3, 3] x + translation [N, 3].

    float32 on the CPU, differentiable in all three. Does not depend on the number of threads. Raises ValueError for
    another type or shape and for fewer than two views.
    """
    if len(scene.images) < 2:
        raise ValueError("photometric consistency needs two views")
    value: Tensor = _Consistency.apply(vertices, rotation, translation, scene)  # type: ignore[no-untyped-call]
    return value


class _Consistency(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, vertices: Tensor, rotation: Tensor, translation: Tensor, scene: Scene) -> Tensor:
        n, x, m = len(scene.images), len(scene.row), scene.valid.shape[1]
        mesh = plain(vertices, len(vertices), 3)
        points = np.empty((x, 3), np.float32)
        _place(mesh, scene, points)
        given = points, plain(rotation, n, 3, 3), plain(translation, n, 3)
        grey, slope = np.zeros((n, m, m), np.float32), np.zeros((n, x, 2), np.float32)
        _sample(*given, scene, grey.reshape(n, m * m), slope)
        total, energy = np.zeros((m, m, PATCH)), np.zeros(m)
        _sum_patches(grey, scene, total, energy)
        by_grey, by_place = np.zeros((n, m, m)), np.zeros((n, x, 3))
        _back_to_grey(grey, scene, total, by_grey)
        back = np.zeros(mesh.shape), np.zeros((n, 3, 3)), np.zeros((n, 3))
        _back_to_place(*given, scene, by_grey.reshape(n, m * m), slope, by_place, *back[1:])
        _spread(given[1], scene, by_place, back[0])
        share = 1 / (n * (n - 1) * max(x, 1))
        ctx.back = [torch.from_numpy(share * part).float() for part in back]
        return torch.tensor(share * energy.sum(), dtype=torch.float32)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        return *(gradients[0] * part for part in ctx.back), None


@kernel()
def _place(vertices: F32, scene: Scene, points: F32) -> None:
    """`points` [X, 3]: the texels on the mesh."""
    for i in range(len(points)):
        for a in range(3):
            total = 0.0
            for k in range(3):
                total += scene.barycentric[i, k] * vertices[scene.corner[i, k], a]
            points[i, a] = total


@kernel(parallel=True)
def _sample(points: F32, rotation: F32, translation: F32, scene: Scene, grey: F32, slope: F32) -> None:
    """`grey` [N, M M] bilinear in the images, and its change `slope` [N, X, 2] by a pixel."""
    count, height, width = scene.images.shape
    for n in numba.prange(count):
        r, t, image = rotation[n], translation[n], scene.images[n]
        for i in range(len(points)):
            p = points[i]
            z = max(r[2, 0] * p[0] + r[2, 1] * p[1] + r[2, 2] * p[2] + t[2], np.float32(NEAR))
            u = (
                (r[0, 0] * p[0] + r[0, 1] * p[1] + r[0, 2] * p[2] + t[0]) / z * scene.focal[0]
                + scene.principal[0]
                - 0.5
            )
            v = (
                (r[1, 0] * p[0] + r[1, 1] * p[1] + r[1, 2] * p[2] + t[1]) / z * scene.focal[1]
                + scene.principal[1]
                - 0.5
            )
            x, y = min(max(u, 0.0), width - 1.0), min(max(v, 0.0), height - 1.0)
            left, top = min(int(x), width - 2), min(int(y), height - 2)
            sx, sy = x - left, y - top
            a, b = image[top, left], image[top, left + 1]
            c, d = image[top + 1, left], image[top + 1, left + 1]
            grey[n, scene.row[i]] = (a * (1 - sx) + b * sx) * (1 - sy) + (c * (1 - sx) + d * sx) * sy
            if x == u:
                slope[n, i, 0] = (b - a) * (1 - sy) + (d - c) * sy
            if y == v:
                slope[n, i, 1] = (c - a) * (1 - sx) + (d - b) * sx


@kernel(parallel=True)
def _sum_patches(grey: F32, scene: Scene, total: F64, energy: F64) -> None:
    """`total` [M, M, 9] the sum of the views' normalised patches; `energy` [M] of each row of the map."""
    size = grey.shape[1]
    for y in numba.prange(1, size - 1):
        patch = np.empty(PATCH)
        for x in range(1, size - 1):
            seen, own = 0, 0.0
            for n in range(len(grey)):
                if scene.valid[n, y, x] == 0:
                    continue
                seen += 1
                squared, inverse = _patch(grey[n], y, x, scene.flat, patch)
                own += squared * inverse * inverse
                for k in range(PATCH):
                    total[y, x, k] += patch[k] * inverse
            if seen:
                energy[y] += seen * (seen - 1) + own - np.sum(total[y, x] ** 2)


@kernel(parallel=True)
def _back_to_grey(grey: F32, scene: Scene, total: F64, by_grey: F64) -> None:
    """`by_grey` [N, M, M]: how the energy changes with each texel's grey."""
    size = grey.shape[1]
    for n in numba.prange(len(grey)):
        patch, push = np.empty(PATCH), np.empty(PATCH)
        for y in range(1, size - 1):
            for x in range(1, size - 1):
                if scene.valid[n, y, x] == 0:
                    continue
                _, inverse = _patch(grey[n], y, x, scene.flat, patch)
                along, mean = 0.0, 0.0
                for k in range(PATCH):
                    push[k] = -2 * (total[y, x, k] - patch[k] * inverse) * inverse
                    along += push[k] * patch[k]
                for k in range(PATCH):
                    push[k] -= patch[k] * along * inverse * inverse
                    mean += push[k] / PATCH
                for k in range(PATCH):
                    by_grey[n, y - 1 + k // 3, x - 1 + k % 3] += push[k] - mean


@kernel()
def _patch(grey: F32, y: int, x: int, flat: float, patch: F64) -> tuple[float, float]:
    """(squared length of the patch without its mean, 1 over the length it is divided by); `patch` [9] changed."""
    mean, squared = 0.0, 0.0
    for k in range(PATCH):
        patch[k] = grey[y - 1 + k // 3, x - 1 + k % 3]
        mean += patch[k] / PATCH
    for k in range(PATCH):
        patch[k] -= mean
        squared += patch[k] * patch[k]
    return squared, 1 / math.sqrt(squared + PATCH * flat * flat)


@kernel(parallel=True)
def _back_to_place(
    points: F32,
    rotation: F32,
    translation: F32,
    scene: Scene,
    by_grey: F64,
    slope: F32,
    by_place: F64,
    by_rotation: F64,
    by_translation: F64,
) -> None:
    """`by_place` [N, X, 3]: how the energy changes with each texel's place in each camera's space; and the cameras."""
    for n in numba.prange(len(rotation)):
        r, t = rotation[n], translation[n]
        for i in range(len(points)):
            force = by_grey[n, scene.row[i]]
            if force == 0:
                continue
            p = points[i]
            x = r[0, 0] * p[0] + r[0, 1] * p[1] + r[0, 2] * p[2] + t[0]
            y = r[1, 0] * p[0] + r[1, 1] * p[1] + r[1, 2] * p[2] + t[1]
            z = r[2, 0] * p[0] + r[2, 1] * p[1] + r[2, 2] * p[2] + t[2]
            if z < NEAR:
                continue
            to = by_place[n, i]
            to[0] = force * slope[n, i, 0] * scene.focal[0] / z
            to[1] = force * slope[n, i, 1] * scene.focal[1] / z
            to[2] = -(to[0] * x + to[1] * y) / z
            for a in range(3):
                by_translation[n, a] += to[a]
                for b in range(3):
                    by_rotation[n, a, b] += to[a] * p[b]


@kernel()
def _spread(rotation: F32, scene: Scene, by_place: F64, by_vertices: F64) -> None:
    """The gradient of the vertices [V, 3], summed over views, then over texels."""
    for i in range(len(scene.row)):
        for b in range(3):
            total = 0.0
            for n in range(len(rotation)):
                for a in range(3):
                    total += by_place[n, i, a] * rotation[n, a, b]
            for k in range(3):
                by_vertices[scene.corner[i, k], b] += scene.barycentric[i, k] * total
