"""What cameras see of a mesh: texels, contour vertices, and the contour points that match them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import torch

from avatar_runtime import F32, F64, I64
from avatar_trainer.asm.kernels.zbuffer import covering, depth_buffers, in_front
from avatar_trainer.asm.views.energy import Pairs, Texels
from avatar_trainer.normals import vertex_normals

SLACK = 0.004  # metres that a point may lie behind the depth buffer and still be seen
CONTOUR = float(
    np.sin(np.radians(10.0))
)  # the paper's threshold: least cosine of a vertex that is not on a contour
GRAZING = float(np.cos(np.radians(72.0)))  # texels at a steeper angle are not compared: they cover few pixels
THINNED = 4  # every so many of the mask's points are matched: they are denser than vertices
FEWEST_VIEWS = 2  # that see a texel

Bools = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Sight:
    """A mesh before N cameras."""

    in_camera: F64  # [N, V, 3] metres
    facing: F64  # [N, V] cosine between each vertex's normal and its way to the camera
    pixels: F64  # [N, V, 2]
    buffers: F32  # [N, H, W] depth, metres
    focal: F64  # [2]
    principal: F64  # [2]


def sight(
    vertices: F64,  # [V, 3] world
    triangles: I64,
    rotation: F64,  # [N, 3, 3]
    translation: F64,  # [N, 3]
    intrinsics: F64,  # [3, 3]
    size: tuple[int, int],  # width, height
) -> Sight:
    """The mesh as the cameras see it; triangles are counter-clockwise from outside."""
    x = vertices @ rotation.transpose(0, 2, 1) + translation[:, None]
    normal = vertex_normals(vertices, triangles) @ rotation.transpose(0, 2, 1)
    way = -x / np.linalg.norm(x, axis=-1, keepdims=True)
    focal, principal = np.diag(intrinsics)[:2], intrinsics[:2, 2]
    pixels = x[..., :2] / np.maximum(x[..., 2:], 1e-3) * focal + principal
    buffers = depth_buffers(x, triangles, intrinsics, size)
    return Sight(x, np.sum(normal * way, axis=-1), pixels, buffers, focal, principal)


def seen_texels(found: Sight, texels: Texels) -> Bools:
    """V [N, X] of Eq. 21: texels that a camera sees, not too slanted."""
    corner, share = texels.corner.numpy(), texels.barycentric.double().numpy()
    place = np.einsum("xk,nxkc->nxc", share, found.in_camera[:, corner])
    facing = np.einsum("xk,nxk->nx", share, found.facing[:, corner])
    pixels = place[..., :2] / np.maximum(place[..., 2:], 1e-3) * found.focal + found.principal
    seen: Bools = (facing > GRAZING) & in_front(found.buffers, pixels, place[..., 2], SLACK)
    return seen


def whole_patches(seen: Bools, texels: Texels) -> Bools:
    """[N, M - 2, M - 2] inner texels of the map whose 3 x 3 texels are all seen."""
    m = texels.size
    flat = np.zeros((len(seen), m * m), bool)
    flat[:, texels.row.numpy()] = seen
    maps = flat.reshape(-1, m, m)
    whole: Bools = np.logical_and.reduce(
        [maps[:, y : m - 2 + y, x : m - 2 + x] for y in range(3) for x in range(3)]
    )
    return whole


def contour_points(mask: F32) -> list[F64]:
    """E^n of Eq. 20: pixel centres [P, 2] on the edge of each mask [N, H, W], except for the image's own border."""
    inside = mask >= 0.5
    core = inside[:, 1:-1, 1:-1]
    ringed = inside[:, :-2, 1:-1] & inside[:, 2:, 1:-1] & inside[:, 1:-1, :-2] & inside[:, 1:-1, 2:]
    return [np.argwhere(edge)[:, ::-1].astype(np.float64) + 1.5 for edge in core & ~ringed]


def contour_pairs(found: Sight, contours: list[F64], reach: float) -> Pairs:
    """Each contour vertex with the nearest point of the mask's contour, and the other way, at most `reach` pixels.

    Contour vertices are the visible ones with |cosine| < CONTOUR. Farther pairs do not count: the nose in front of
    the cheek is an edge of the mesh but not of the mask; the mesh may lack edges of the mask, such as ears and hair.
    """
    kept: list[tuple[Any, ...]] = []
    seen = in_front(found.buffers, found.pixels, found.in_camera[..., 2], SLACK)
    for n, points in enumerate(contours):
        rows = np.flatnonzero(seen[n] & (np.abs(found.facing[n]) < CONTOUR))
        if not len(rows) or not len(points):
            continue
        place = found.pixels[n, rows]
        squared = np.sum((place[:, None] - points) ** 2, axis=-1)
        for axis in (1, 0):
            near = squared.argmin(axis=axis)
            close = squared.min(axis=axis) <= reach**2
            if not axis:
                close[np.arange(len(close)) % THINNED != 0] = False
            vertex, point = (rows, points[near]) if axis else (rows[near], points)
            count = int(close.sum())
            if count:
                kept.append((np.full(count, n), vertex[close], point[close], np.full(count, 1 / count)))
    view, vertex, point, weight = (
        (np.concatenate(part) for part in zip(*kept, strict=True))
        if kept
        else (np.zeros(0, np.intp), np.zeros(0, np.intp), np.zeros((0, 2)), np.zeros(0))
    )
    return Pairs(
        torch.from_numpy(view.astype(np.int64)),
        torch.from_numpy(vertex.astype(np.int64)),
        torch.from_numpy(point).float(),
        torch.from_numpy(weight).float(),
    )


def texel_map(uv: F64, triangles: I64, size: int) -> Texels:
    """The texels of a size x size map of 0..1 x 0..1 whose centres lie on the mesh; where charts overlap, the first."""
    triangle, barycentric = covering(uv * size, triangles, size)
    row = np.flatnonzero(triangle.ravel() >= 0)
    return Texels(
        size,
        torch.from_numpy(row),
        torch.from_numpy(triangles[triangle.ravel()[row]]),
        torch.from_numpy(barycentric.reshape(-1, 3)[row]).float(),
    )
