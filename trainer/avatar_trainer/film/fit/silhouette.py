"""The third fit: the outline of the head lies on the edge of the mask.

Hair lies over the scalp, so the scalp's outline counts less than that of cheeks, jaw and ears; the neck does not count.
"""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
import numpy.typing as npt

from avatar_runtime import F32, F64, I64
from avatar_trainer.film.fit.images import looked_up
from avatar_trainer.film.fit.pose import Fit
from avatar_trainer.film.fit.solve import Rows, place_rows
from avatar_trainer.film.fit.surface import SurfacePoints
from avatar_trainer.head import Head, neck_height

SIGMA = 0.015  # of the height of the face: how well a mask's edge is known
FAR = 4.0  # deviations: farther edges are hair, shoulders, other things
SCALP = 0.08  # weight of the scalp beside that of cheeks, jaw and ears
TOGETHER = 0.15  # weight: neighbouring points are not independent
EDGE_ON = 0.25  # cosine of the angle to the camera below which a point can be on the outline
OUTER = 2.0  # pixels from the drawn head's edge at which a point is on the outline
ABOVE_NECK = -0.055  # metres of `neck_height`
EACH = 4  # one vertex in so many is compared

Grey = npt.NDArray[np.uint8]


def candidates(head: Head) -> tuple[I64, F64]:
    """(vertices [C] that can be on the outline, the weight of each)."""
    scalp = head.in_part("head") & ~head.in_part("face")
    rows = np.flatnonzero((head.in_part("face") | scalp) & (neck_height(head.vertices) > ABOVE_NECK))[::EACH]
    return rows, np.where(scalp[rows], SCALP, 1.0)


def edge_distance(mask: Grey) -> F32:
    """[3, H, W] pixels inside the edge of a mask (outside: negative), and the derivatives of that by x and y."""
    inside = (mask > 127).astype(np.uint8)
    within, without = (np.asarray(cv2.distanceTransform(one, cv2.DIST_L2, 5)) for one in (inside, 1 - inside))
    distance = np.asarray(cv2.GaussianBlur(within - without, (0, 0), 1.0))
    result = np.zeros((3, *mask.shape), np.float32)
    result[0] = distance
    result[1, :, 1:-1] = (distance[:, 2:] - distance[:, :-2]) / 2
    result[2, 1:-1] = (distance[2:] - distance[:-2]) / 2
    return result


def outline(fit: Fit, vertices: F64, triangles: I64, size: tuple[int, int], points: F64, normals: F64) -> F64:
    """[T, C] 1 for each of the `points` [T, C, 3] with `normals` [C, 3] that is on the outline of the drawn head.

    `vertices` [T, V, 3] of the drawn head, `points` and normals in head space.
    """
    places, camera = fit.pixels(fit.in_camera(vertices)), fit.in_camera(points)
    pixels = fit.pixels(camera)
    facing = np.einsum("tij,cj,tci->tc", fit.rotation, normals, camera, optimize=True)
    edge_on = np.abs(facing) < EDGE_ON * np.linalg.norm(camera, axis=-1)
    inside = ((pixels > OUTER) & (pixels < np.array(size) - OUTER)).all(axis=-1)
    on_edge = np.zeros(edge_on.shape, bool)
    for t, place in enumerate(places):
        drawn = np.zeros(size[::-1], np.uint8)
        for triangle in np.round((place[triangles] - 0.5) * 16).astype(np.int32):
            cv2.fillConvexPoly(drawn, triangle, 1, shift=4)
        depth = cv2.distanceTransform(np.pad(drawn, 1), cv2.DIST_L2, 3)[1:-1, 1:-1]
        x, y = np.clip(np.round(pixels[t] - 0.5), 0, np.array(size) - 1).astype(np.int64).T
        on_edge[t] = depth[y, x] <= OUTER
    found: F64 = (on_edge & edge_on & inside).astype(np.float64)
    return found


def rows(
    fit: Fit,
    points: SurfacePoints,
    index: I64,
    weight: F64,
    edges: Sequence[F32],
    face: float,
) -> Rows:
    """One residual for each of the surface points `index` [C]: how far it is from the mask's edge; weight [T, C]."""
    camera = fit.in_camera(points.posed(fit.identity, fit.weights)[:, index])
    places = fit.pixels(camera)
    found = np.stack([looked_up(edge, at) for edge, at in zip(edges, places, strict=True)]).astype(np.float64)
    off = found[:, 0] / (SIGMA * face)
    root = np.sqrt(TOGETHER * weight) / (1 + (off / FAR) ** 2) / (SIGMA * face)
    slope = np.stack([found[:, 1], found[:, 2]], axis=-1) * root[..., None]
    by_place = np.einsum("tpc,tpcx->tpx", slope.astype(np.float32), place_rows(fit, camera))
    by_focal = ((places - fit.principal) * slope).sum(axis=-1)
    return Rows(index, (-found[:, 0] * root).astype(np.float32), by_place, by_focal.astype(np.float32))
