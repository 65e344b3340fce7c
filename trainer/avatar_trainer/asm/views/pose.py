"""A camera's pose from landmarks of a known shape: perspective-n-point without a first guess, in NumPy."""

from __future__ import annotations

import numpy as np

from avatar_runtime import F64
from avatar_runtime import rotation as runtime_rotation

ROUNDS = 50  # of Levenberg and Marquardt; a face takes about 10
FEWEST = 4  # points
DAMPING, LEAST, MOST = 1e-3, 1e-12, 1e12


def pose_from_points(points: F64, pixels: F64, intrinsics: F64) -> tuple[F64, F64]:
    """(R [3, 3], t [3] metres), x_camera = R x + t, that project `points` [N, 3] nearest to `pixels` [N, 2].

    First a weak-perspective camera (linear, then the nearest rotation), then Levenberg-Marquardt minimises the squared
    distances in pixels. Raises ValueError for fewer than FEWEST points, and for points or
    pixels that lie on one line.
    """
    if len(points) < FEWEST or len(points) != len(pixels):
        raise ValueError(f"{len(points)} points and {len(pixels)} pixels: {FEWEST} of each are the fewest")
    rotation, translation = weak_perspective(points, pixels, intrinsics)
    damping, error, jacobian = DAMPING, *_residual(points, pixels, intrinsics, rotation, translation)
    for _ in range(ROUNDS):
        normal = jacobian.T @ jacobian
        step = -np.linalg.solve(normal + damping * np.diag(np.diag(normal)), jacobian.T @ error)
        turned, moved = runtime_rotation.matrix_from_rotvec(step[:3]) @ rotation, translation + step[3:]
        tried = _residual(points, pixels, intrinsics, turned, moved)
        if tried[0] @ tried[0] < error @ error:
            gained = 1 - (tried[0] @ tried[0]) / (error @ error)
            rotation, translation, (error, jacobian) = turned, moved, tried
            damping = max(damping / 10, LEAST)
            if gained < 1e-12:
                break
        else:
            damping *= 10
            if damping > MOST:
                break
    return rotation, translation


def weak_perspective(points: F64, pixels: F64, intrinsics: F64) -> tuple[F64, F64]:
    """The pose under which all points have the depth of their mean: least squares, then the nearest rotation.

    Raises ValueError as `pose_from_points`.
    """
    focal, principal = np.diag(intrinsics)[:2], intrinsics[:2, 2]
    plane = (pixels - principal) / focal
    centre, middle = points.mean(axis=0), plane.mean(axis=0)
    spread = np.linalg.svd(points - centre, compute_uv=False)
    seen = np.linalg.svd(plane - middle, compute_uv=False)
    if not (spread[1] > 1e-6 * spread[0] and seen[1] > 1e-6 * seen[0]):
        raise ValueError("the points or the pixels lie on one line")
    affine = np.linalg.lstsq(points - centre, plane - middle, rcond=None)[0].T  # [2, 3], rows R / depth
    u, scale, vt = np.linalg.svd(affine, full_matrices=False)
    rows = u @ vt
    rotation = np.stack([*rows, np.cross(rows[0], rows[1])])
    depth = 1 / scale.mean()
    translation = depth * np.array([*middle, 1.0]) - rotation @ centre
    return rotation, translation


def _residual(points: F64, pixels: F64, intrinsics: F64, rotation: F64, translation: F64) -> tuple[F64, F64]:
    """(projected minus seen [2 N], its Jacobian [2 N, 6] by a turn before the camera and a shift)."""
    turned = points @ rotation.T
    x = turned + translation
    if (x[:, 2] <= 0).any():  # behind the camera: worse than anything in front of it
        return np.full(2 * len(points), 1e12), np.zeros((2 * len(points), 6))
    focal, principal = np.diag(intrinsics)[:2], intrinsics[:2, 2]
    off = x[:, :2] / x[:, 2:] * focal + principal - pixels
    by_place = np.zeros((len(points), 2, 3))
    by_place[:, 0, 0], by_place[:, 1, 1] = focal[0] / x[:, 2], focal[1] / x[:, 2]
    by_place[:, :, 2] = -x[:, :2] * focal / x[:, 2:] ** 2
    by_turn = np.cross(turned[:, None, :], by_place)  # d(w x p) . g = w . (p x g)
    return off.ravel(), np.concatenate([by_turn, by_place], axis=2).reshape(-1, 6)
