"""The first fit: MediaPipe's landmarks, over frames that are spread over the film."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from avatar_runtime import F64, I64
from avatar_trainer.film.fit.pose import Fit
from avatar_trainer.film.fit.solve import Prior, Rows, place_rows, step
from avatar_trainer.film.fit.surface import SurfacePoints

HUBER = 2.5  # deviations beyond which a landmark counts less
TOGETHER = 0.35  # weight of a landmark: 468 points on one face are not 468 measurements
FACE_METRES = 0.18  # from forehead (landmark 10) to chin (152) of a mean face
FOREHEAD, CHIN = 10, 152


@dataclass(frozen=True)
class Landmarks:
    """Where the landmarks of T frames are seen, and how well."""

    places: F64  # [T, L, 2] pixels
    sigma: F64  # [T, L] pixels
    point: I64  # [L] the surface point of each


def face_pixels(places: F64) -> float:
    """The height of the face, forehead to chin, in the median of the frames; places [T, 468+, 2]."""
    return float(np.nanmedian(np.linalg.norm(places[:, FOREHEAD] - places[:, CHIN], axis=-1)))


def rows(fit: Fit, points: SurfacePoints, seen: Landmarks, weight: float) -> Rows:
    """Two residuals a landmark, x before y."""
    camera = fit.in_camera(points.posed(fit.identity, fit.weights)[:, seen.point])
    away = seen.places - fit.pixels(camera)
    off = np.linalg.norm(away, axis=-1) / seen.sigma
    root = np.sqrt(weight / np.maximum(1, off / HUBER)) / seen.sigma
    by_place = place_rows(fit, camera) * root[..., None, None].astype(np.float32)
    by_focal = (fit.pixels(camera) - fit.principal) * root[..., None]
    frames, count = off.shape
    return Rows(
        np.repeat(seen.point, 2),
        (away * root[..., None]).reshape(frames, 2 * count).astype(np.float32),
        by_place.reshape(frames, 2 * count, 3),
        by_focal.reshape(frames, 2 * count).astype(np.float32),
    )


def begin(places: F64, rotation: F64, principal: F64, focal: float, names: int, modes: int) -> Fit:
    """A fit to start from: MediaPipe's rotations [T, 3, 3], the distance by the height of the face."""
    height = np.linalg.norm(places[:, FOREHEAD] - places[:, CHIN], axis=-1)
    depth = focal * FACE_METRES / np.maximum(height, 1)
    middle = (places[:, :468].mean(axis=1) - principal) / focal * depth[:, None]
    return Fit(
        focal,
        principal,
        np.zeros(modes),
        np.zeros((len(places), names)),
        rotation,
        np.concatenate([middle, depth[:, None]], axis=1),
    )


def fitted(
    fit: Fit,
    points: SurfacePoints,
    seen: Landmarks,
    prior: Prior,
    steps: int,
    said: Callable[[str], None] = lambda text: None,
) -> Fit:
    """`fit` after some steps."""
    for _ in range(steps):
        fit = step(points, fit, [rows(fit, points, seen, TOGETHER)], prior)
    camera = fit.in_camera(points.posed(fit.identity, fit.weights)[:, seen.point])
    away = np.linalg.norm(seen.places - fit.pixels(camera), axis=-1)
    said(
        f"landmarks: {away.mean():.2f} px, focal length {fit.focal:.0f} px, identity {np.linalg.norm(fit.identity):.2f}"
    )
    return fit
