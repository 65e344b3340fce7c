"""The second fit: a point of the skin looks the same in all frames.

The pictures are band-passed, so light hardly counts; landmarks stay at a low weight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from avatar_runtime import F32, F64, I64
from avatar_trainer.film.fit.images import looked_up
from avatar_trainer.film.fit.pose import Fit
from avatar_trainer.film.fit.solve import Rows, place_rows
from avatar_trainer.film.fit.surface import SurfacePoints

SIGMA, HUBER = 0.7, 0.4  # of a band-passed value; a residual beyond HUBER counts less
FACING = (0.15, 0.5)  # cosine of the angle to the camera between which a point becomes visible
OFTEN = 0.15  # share of the frames in which a point must be seen to have a look of its own
EDGE = 2.5  # pixels at the image's edge that are not used
TOGETHER = 0.25  # weight: neighbouring points are not independent


@dataclass(frozen=True)
class Look:
    """The band-passed value that each of P points has on average."""

    value: F64  # [P]
    known: F64  # [P] 0 or 1


def visible(fit: Fit, camera: F64, normals: F64, size: tuple[int, int]) -> F64:
    """[T, P] how well each point faces the camera, 0..1; 0 outside the image. normals [P, 3] in head space."""
    towards = -np.einsum("tij,pj,tpi->tp", fit.rotation, normals, camera, optimize=True)
    cosine = towards / np.linalg.norm(camera, axis=-1)
    low, high = FACING
    places = fit.pixels(camera)
    inside = ((places > EDGE) & (places < np.array(size) - EDGE)).all(axis=-1)
    seen: F64 = np.clip((cosine - low) / (high - low), 0, 1) * inside
    return seen


def sampled(images: Sequence[F32], places: F64) -> F32:
    """[T, 3, P] of one image [3, H, W] a frame."""
    return np.stack([looked_up(image, at) for image, at in zip(images, places, strict=True)])


def look_of(value: F64, seen: F64) -> Look:
    """The robust mean of values [T, P] where they are `seen`."""
    mean = (value * seen).sum(axis=0) / np.maximum(seen.sum(axis=0), 1e-3)
    for _ in range(3):
        weight = seen / np.maximum(1, np.abs(value - mean) / HUBER)
        mean = (value * weight).sum(axis=0) / np.maximum(weight.sum(axis=0), 1e-3)
    return Look(mean, (seen.sum(axis=0) > OFTEN * len(value)).astype(np.float64))


def rows(
    fit: Fit,
    points: SurfacePoints,
    dense: I64,
    normals: F64,
    images: Sequence[F32],
    look: Look | None,
    weight: float = 1.0,
) -> tuple[Rows, Look]:
    """One residual for each of the surface points `dense` [P]; without a `look` that of these frames."""
    camera = fit.in_camera(points.posed(fit.identity, fit.weights)[:, dense])
    places = fit.pixels(camera)
    found = sampled(images, places).astype(np.float64)
    value, right, down = found[:, 0], found[:, 1], found[:, 2]
    seen = visible(fit, camera, normals, images[0].shape[:0:-1])
    look = look or look_of(value, seen)
    away = look.value - value
    root = np.sqrt(weight * TOGETHER * seen * look.known / np.maximum(1, np.abs(away) / HUBER)) / SIGMA
    slope = np.stack([right, down], axis=-1) * root[..., None]
    by_place = np.einsum("tpc,tpcx->tpx", slope.astype(np.float32), place_rows(fit, camera))
    by_focal = ((places - fit.principal) * slope).sum(axis=-1)
    return (
        Rows(dense, (away * root).astype(np.float32), by_place, by_focal.astype(np.float32)),
        look,
    )
