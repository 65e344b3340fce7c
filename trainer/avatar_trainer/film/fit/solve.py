"""One Gauss-Newton step of a fit: identity and focal length of the whole film, pose and expression of each frame.

Frames depend on each other through identity and focal length alone, so these are solved first (Schur complement).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from avatar_runtime import F32, F64, I64
from avatar_trainer.film.fit.pose import Fit
from avatar_trainer.film.fit.surface import SurfacePoints

POSE = 6  # rotation and translation come before the weights
MOST_TURN, MOST_SHIFT, MOST_WEIGHT, MOST_IDENTITY, MOST_ZOOM = 0.3, 0.1, 0.4, 1.0, 0.15  # of a step
EXACT = 1e-9  # a weight this near 0 or 1 stands at its bound


@dataclass(frozen=True)
class Rows:
    """R residuals (seen - predicted, times the root of their weight) of each of T frames."""

    point: I64  # [R] the surface point that each is of
    residual: F32  # [T, R]
    by_place: F32  # [T, R, 3] the prediction's derivative by the point's place in camera space
    by_focal: F32  # [T, R] and by the logarithm of the focal length


@dataclass(frozen=True)
class Prior:
    """What is known before: weights [T, K] with deviations [T, K]; identity and log focal length about these."""

    weights: F64
    weight_sigma: F64
    strength: float  # of the priors of identity and focal length: as so many frames' worth
    focal: float  # pixels
    focal_sigma: float  # of its logarithm; 0: the focal length is known
    identity: bool = True  # solve for the identity; else it and the focal length stay


def step(points: SurfacePoints, fit: Fit, rows: Sequence[Rows], prior: Prior, damping: float = 1e-3) -> Fit:
    """`fit` after one step."""
    joined = Rows(
        np.concatenate([part.point for part in rows]),
        np.concatenate([part.residual for part in rows], axis=1),
        np.concatenate([part.by_place for part in rows], axis=1),
        np.concatenate([part.by_focal for part in rows], axis=1),
    )
    local, in_head = _by_frame(points, fit, joined)
    normal = _products(local, local)  # [T, 6 + K, 6 + K]
    right = _products(local, joined.residual[..., None])[..., 0]
    normal, right, held = _with_prior(normal, right, fit, prior, damping)
    if not prior.identity:
        return _moved(fit, np.linalg.solve(normal, right[..., None])[..., 0].astype(np.float64))
    shared = np.concatenate(
        [_per_point(in_head, points.identity[joined.point]), joined.by_focal[..., None]], axis=-1
    )
    cross = np.where(held[:, :, None], 0, _products(local, shared))
    own = _products(shared, shared).sum(axis=0)
    own_right = _products(shared, joined.residual[..., None]).sum(axis=0)[:, 0]
    own, own_right, cross = _shared_prior(own, own_right, cross, fit, prior)
    solved = np.linalg.solve(normal, np.concatenate([cross, right[..., None]], axis=-1))
    by_shared, alone = solved[..., :-1], solved[..., -1]
    change = np.linalg.solve(
        own - np.einsum("tpq,tpr->qr", cross, by_shared), own_right - np.einsum("tpq,tp->q", cross, alone)
    )
    zoom = float(np.clip(change[-1], -MOST_ZOOM, MOST_ZOOM))
    return replace(
        _moved(fit, alone - by_shared @ change),
        identity=fit.identity + np.clip(change[:-1], -MOST_IDENTITY, MOST_IDENTITY),
        focal=fit.focal * float(np.exp(zoom)),
    )


def _products(a: F32, b: F32) -> F64:
    """[T, P, Q] the products a^T b of each frame, [T, R, P] and [T, R, Q]."""
    return np.stack([one.T @ two for one, two in zip(a, b, strict=True)]).astype(np.float64)


def _per_point(in_head: F32, modes: F32) -> F32:
    """[T, R, M] of rows by place in head space [T, R, 3] and modes [R, M, 3]."""
    product: F32 = np.matmul(in_head.transpose(1, 0, 2), modes.transpose(0, 2, 1)).transpose(1, 0, 2)
    return product


def _by_frame(points: SurfacePoints, fit: Fit, rows: Rows) -> tuple[F32, F32]:
    """(derivatives by pose and weights [T, R, 6 + K], by the place in head space [T, R, 3])."""
    turned = fit.in_camera(points.posed(fit.identity, fit.weights)) - fit.translation[:, None]
    in_head = np.matmul(rows.by_place, fit.rotation.astype(np.float32))
    by_turn = np.cross(turned[:, rows.point].astype(np.float32), rows.by_place)
    by_weight = _per_point(in_head, points.expression[rows.point])
    return np.concatenate([by_turn, rows.by_place, by_weight], axis=-1), in_head


def _with_prior(normal: F64, right: F64, fit: Fit, prior: Prior, damping: float) -> tuple[F64, F64, F64]:
    """The equations with priors and damping; parameters that stand at a bound and push outwards are held."""
    frames, count = right.shape
    diagonal = np.arange(count)
    stiff = 1 / prior.weight_sigma**2
    normal[:, diagonal[POSE:], diagonal[POSE:]] += stiff
    right[:, POSE:] += (prior.weights - fit.weights) * stiff
    normal[:, diagonal, diagonal] *= 1 + damping
    normal[:, diagonal, diagonal] += 1e-9
    push = right[:, POSE:]
    stuck = ((fit.weights <= EXACT) & (push < 0)) | ((fit.weights >= 1 - EXACT) & (push > 0))
    held = np.concatenate([np.zeros((frames, POSE), bool), stuck], axis=1)
    normal = np.where(held[:, :, None] | held[:, None, :], 0, normal)
    frame, parameter = np.nonzero(held)
    normal[frame, parameter, parameter] = 1
    return normal, np.where(held, 0, right), held


def _shared_prior(own: F64, own_right: F64, cross: F64, fit: Fit, prior: Prior) -> tuple[F64, F64, F64]:
    modes = np.arange(len(fit.identity))
    own[modes, modes] += prior.strength
    own_right[modes] -= prior.strength * fit.identity
    if prior.focal_sigma:
        stiff = prior.strength / prior.focal_sigma**2
        own[-1, -1] += stiff
        own_right[-1] -= stiff * np.log(fit.focal / prior.focal)
    else:
        own[-1], own[:, -1], cross[:, :, -1] = 0, 0, 0
        own[-1, -1], own_right[-1] = 1, 0
    return own, own_right, cross


def _moved(fit: Fit, change: F64) -> Fit:
    return fit.moved(
        np.clip(change[:, :3], -MOST_TURN, MOST_TURN),
        np.clip(change[:, 3:POSE], -MOST_SHIFT, MOST_SHIFT),
        np.clip(change[:, POSE:], -MOST_WEIGHT, MOST_WEIGHT),
    )


def place_rows(fit: Fit, camera: F64) -> F32:
    """[T, P, 2, 3] the derivative of a pixel by the point's place in camera space [T, P, 3]."""
    depth = 1 / camera[..., 2]
    result = np.zeros((*camera.shape[:-1], 2, 3), np.float32)
    result[..., 0, 0] = result[..., 1, 1] = fit.focal * depth
    result[..., 0, 2] = -fit.focal * camera[..., 0] * depth**2
    result[..., 1, 2] = -fit.focal * camera[..., 1] * depth**2
    return result
