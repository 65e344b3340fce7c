"""Scans and meshes: rigid alignment by keypoints, refined to the surface, and the scan-to-mesh error of the face."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from avatar_runtime import F64, I64
from avatar_trainer.asm.kernels.closest import Nearest, TriangleTree, nearest

# The seven points that NoW marks on a scan, and which of iBUG's landmarks they are; right is the person's.
KEYPOINTS = {
    "right_eye_outer": "ibug_36",
    "right_eye_inner": "ibug_39",
    "left_eye_inner": "ibug_42",
    "left_eye_outer": "ibug_45",
    "nose_bottom": "ibug_33",
    "mouth_right": "ibug_48",
    "mouth_left": "ibug_54",
}
UP_THE_NOSE, RADII = 0.3, 0.7  # of the facial region, see `face_region`
ROUNDS, ENOUGH = 30, 1e-8  # of rigid refinement; a step below ENOUGH metres is the last
FLAT = 1e-12  # metres; nearer to the surface, its normal is the direction of the distance

Keypoints = Mapping[str, F64]  # name -> [3]


@dataclass(frozen=True)
class Scan:
    """The scan of a face: points, and the triangles between them if there are any."""

    name: str
    points: F64  # [N, 3]
    triangles: I64 | None  # [F, 3] of the points
    keypoints: Keypoints  # KEYPOINTS at least
    vertex: I64 | None = (
        None  # [N] the template's vertex that each point is, where that is known; -1 where not
    )


class Placement(NamedTuple):
    """p -> scale R p + t."""

    rotation: F64  # [3, 3]
    translation: F64  # [3] metres
    scale: float = 1.0

    def apply(self, points: F64) -> F64:
        """Points [..., 3] after the motion."""
        placed: F64 = self.scale * points @ self.rotation.T + self.translation
        return placed

    def inverse(self) -> Placement:
        """The inverse."""
        back = self.rotation.T
        return Placement(back, -(back @ self.translation) / self.scale, 1 / self.scale)

    def after(self, first: Placement) -> Placement:
        """`first`, then this."""
        return Placement(
            self.rotation @ first.rotation, self.apply(first.translation), self.scale * first.scale
        )


@dataclass(frozen=True)
class ScanError:
    """How far the points of a scan in the facial region lie from a mesh."""

    rows: I64  # [n] of the scan's points
    distance: F64  # [n] metres
    placement: Placement  # of the scan, relative to its first position

    @property
    def mean_mm(self) -> float:
        """The scan-to-mesh error of the paper's Tables 2, 3 and 7."""
        return float(1e3 * self.distance.mean())


def placed_by_pairs(points: F64, goal: F64, similarity: bool = False) -> Placement:
    """The rigid motion, with `similarity` also the scale, that brings `points` [N, 3] nearest to `goal` [N, 3].

    Least squares (Kabsch 1976, Umeyama 1991), never a reflection. Raises ValueError for fewer than three points or
    points on a line, which do not determine the motion.
    """
    if points.shape != goal.shape or points.ndim != 2 or len(points) < 3:
        raise ValueError(f"points {points.shape} and goal {goal.shape}; [N, 3] and at least 3 are needed")
    middle, aim = points.mean(axis=0), goal.mean(axis=0)
    u, spread, vt = np.linalg.svd((goal - aim).T @ (points - middle))
    if spread[1] <= 1e-9 * max(float(spread[0]), 1e-300):
        raise ValueError("the points lie on a line")
    sign = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation: F64 = (u * sign) @ vt
    scale = float(np.sum(spread * sign) / np.sum((points - middle) ** 2)) if similarity else 1.0
    return Placement(rotation, aim - scale * rotation @ middle, scale)


def keypoint_rows(keypoints: Keypoints) -> F64:
    """KEYPOINTS as rows [7, 3]. Raises ValueError for a missing one."""
    missing = [name for name in KEYPOINTS if name not in keypoints]
    if missing:
        raise ValueError(f"keypoint {missing[0]} is missing")
    return np.stack([np.asarray(keypoints[name], np.float64) for name in KEYPOINTS])


def face_region(keypoints: Keypoints) -> tuple[F64, float]:
    """(centre [3], radius) of the ball that counts as the face, as NoW's evaluation cuts its scans.

    The centre lies three tenths up from the bottom of the nose to between the inner corners of the eyes; the radius
    is 0.7 of (distance of the outer corners + length of the nose).
    """
    outer_right, inner_right, inner_left, outer_left, bottom, _, _ = keypoint_rows(keypoints)
    bridge = (inner_right + inner_left) / 2
    spread = np.linalg.norm(outer_right - outer_left) + np.linalg.norm(bridge - bottom)
    return bottom + UP_THE_NOSE * (bridge - bottom), float(RADII * spread)


def in_face(points: F64, keypoints: Keypoints, widened: float = 1.0) -> I64:
    """Rows of the points [N, 3] in the facial region, its radius times `widened`."""
    centre, radius = face_region(keypoints)
    return np.flatnonzero(np.sum((points - centre) ** 2, axis=1) <= (widened * radius) ** 2)


def refined(points: F64, vertices: F64, tree: TriangleTree) -> tuple[Placement, F64]:
    """(the rigid motion that brings `points` nearest to the mesh, their distances [N] then).

    Least squares of the distances by Gauss-Newton, from the present positions; a step that does not help is halved.
    """
    placement = Placement(np.eye(3), np.zeros(3))
    found = nearest(points, vertices, tree)
    damping = 1.0
    for _ in range(ROUNDS):
        placed = placement.apply(points)
        step = _step(placed, vertices, tree, found, damping)
        tried = step.after(placement)
        again = nearest(tried.apply(points), vertices, tree, found.triangle)
        if again.squared_distance.sum() >= found.squared_distance.sum():
            damping /= 2
            if damping < 1 / 64:
                break
            continue
        moved = np.abs(tried.apply(points) - placed).max()
        placement, found, damping = tried, again, min(1.0, 2 * damping)
        if moved < ENOUGH:
            break
    return placement, np.sqrt(found.squared_distance)


def scan_to_mesh(scan: Scan, vertices: F64, tree: TriangleTree) -> ScanError:
    """The scan-to-mesh error: distances of a scan's points in the facial region to a mesh in the scan's frame.

    Defined as: the points of the scan within `face_region` of its own keypoints; moved rigidly, without scale, to
    where the sum of their squared distances to the mesh is least, from their present position; then the unsquared
    distance of each to the nearest point of the mesh. All points count, so a hole of the mesh increases the error.
    Raises ValueError for a scan without points there.
    """
    rows = in_face(scan.points, scan.keypoints)
    if not len(rows):
        raise ValueError(f"scan {scan.name} has no point in the facial region")
    placement, distance = refined(scan.points[rows], vertices, tree)
    return ScanError(rows, distance, placement)


def _step(points: F64, vertices: F64, tree: TriangleTree, found: Nearest, damping: float) -> Placement:
    """One Gauss-Newton step of the points' distances, about their middle."""
    corner = vertices[tree.triangles[found.triangle]]
    off = points - np.einsum("nk,nkx->nx", found.barycentric, corner)
    distance = np.linalg.norm(off, axis=1)
    upright = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    way = np.where((distance > FLAT)[:, None], off, upright)
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-300)
    middle = points.mean(axis=0)
    arm = points - middle
    reach = max(float(np.sqrt(np.mean(arm**2))), 1e-12)
    slope = np.concatenate([np.cross(arm, way) / reach, way], axis=1)
    turn, shift = np.split(-damping * np.linalg.lstsq(slope, distance, rcond=None)[0], 2)
    rotation = _turned(turn / reach)
    return Placement(rotation, middle + shift - rotation @ middle)


def _turned(rotation_vector: F64) -> F64:
    """The rotation [3, 3] of a rotation vector in radians."""
    x, y, z = rotation_vector
    angle = float(np.linalg.norm(rotation_vector))
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    sine, rest = (
        np.sinc(angle / np.pi),
        0.5 * np.sinc(angle / (2 * np.pi)) ** 2,
    )  # sin a / a, (1 - cos a) / a^2
    matrix: F64 = np.eye(3) + sine * cross + rest * cross @ cross
    return matrix
