"""Flat Gaussians on a mesh, one per triangle, so that an avatar without Gaussians can be drawn like any other."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32, F64, I64, U32, Embedding, Gaussians, Rules
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.stages.surface import binding_pose, triangle_shape
from avatar_schema import constants

RULES = Rules("triangle_frame", position="triangle_frame", scale="triangle_linear", sh_direction="world")
# Times the standard deviation of the triangle: neighbours meet at 0.9 opacity, and edges stay sharp.
SPREAD = 2.0
FLATNESS = 0.02  # thickness, and smallest width of a sliver, relative to the length
OPACITY_LOGIT = 4.6  # 0.99, the largest opacity of the rasteriser
LEAST_SINE = 1e-7  # of the angle at a corner; smaller angles define no plane in float32
CLAY = (0.76, 0.63, 0.55)  # display-referred, for a mesh without colours
LIGHT = (0.25, 0.45, 0.85)  # direction to the light on the clay, mesh space
AMBIENT = 0.45


def surfels(vertices: F32, triangles: U32, colour: F32 | None) -> tuple[Gaussians, Embedding]:
    """(Gaussians, embedding): for each triangle a Gaussian with its second moments, times SPREAD; they move by RULES.

    `vertices` [V, 3] metres, the binding pose; `colour` [V, 3] display-referred, None: clay, lit in that pose.
    Triangles without area get none. Raises AvatarError if no triangle has an area.
    """
    chosen = _sound(vertices, triangles)
    if not len(chosen):
        raise AvatarError(
            "no triangle of the mesh has an area, so there is nothing to draw", field="triangles"
        )
    angle, length, width = _ellipses(vertices, triangles, chosen)
    n, zero = len(chosen), np.zeros(len(chosen))
    embedding = Embedding(
        canonical_vertices=vertices,
        triangles=triangles,
        triangle=chosen.astype(np.uint32),
        barycentric=np.full((n, 3), 1 / 3, np.float32),
        displacement=np.zeros(0, np.float32),
        local_offset=np.zeros((n, 3), np.float32),
        local_quat_wxyz=np.stack([np.cos(angle / 2), zero, -np.sin(angle / 2), zero], axis=1).astype(
            np.float32
        ),
    )
    mean, quat_wxyz = binding_pose(embedding, RULES, 1.0)
    scale = np.stack([length, FLATNESS * length, np.maximum(width, FLATNESS * length)], axis=1)
    shown = _clay(vertices, triangles[chosen]) if colour is None else colour[triangles[chosen]].mean(axis=1)
    return Gaussians(
        mean=mean,
        log_scale=np.log(SPREAD * scale).astype(np.float32),
        quat_wxyz=quat_wxyz,
        opacity_logit=np.full(n, OPACITY_LOGIT, np.float32),
        sh=((shown - 0.5) / constants()["sh_c0"][0]).astype(np.float32)[:, None],
    ), embedding


def _sound(vertices: F32, triangles: U32) -> I64:
    corner = vertices.astype(np.float64)[triangles]
    e, f = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    across = np.linalg.norm(np.cross(e, f), axis=1)
    sound = across > LEAST_SINE * np.linalg.norm(e, axis=1) * np.linalg.norm(f, axis=1)
    return np.flatnonzero(sound).astype(np.int64)


def _ellipses(vertices: F32, triangles: U32, chosen: I64) -> tuple[F64, F64, F64]:
    """(angle of the longer axis from the first axis of the frame to the third; standard deviations along both)."""
    frame = triangle_shape(vertices, triangles[chosen], RULES).frame
    corner = vertices.astype(np.float64)[triangles[chosen]]
    offset = corner - corner.mean(axis=1, keepdims=True)
    x, y = np.moveaxis(offset @ frame[:, :, [0, 2]], -1, 0)  # [n, 3] in the triangle's plane
    xx, xy, yy = (np.sum(product, axis=1) / 12 for product in (x * x, x * y, y * y))
    mean, spread = (xx + yy) / 2, np.hypot((xx - yy) / 2, xy)
    return np.arctan2(2 * xy, xx - yy) / 2, np.sqrt(mean + spread), np.sqrt(np.maximum(mean - spread, 0))


def _clay(vertices: F32, triangles: U32) -> F64:
    corner = vertices.astype(np.float64)[triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    lit = np.maximum(normal @ (np.array(LIGHT) / np.linalg.norm(LIGHT)), 0)
    result: F64 = np.array(CLAY) * (AMBIENT + (1 - AMBIENT) * lit)[:, None]
    return result
