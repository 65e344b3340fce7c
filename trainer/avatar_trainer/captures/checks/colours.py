"""Whether a point of the tracked mesh has the same colour in all images.

If cameras and poses are right, each point of the skin shows the same spot in every image, and its colours differ by
light alone. If they are wrong, it slides over the face. The measure is the median over the points of the variance of
a point's colours, relative to the variance between points: about 0.01 for right captures, 1 for wrong ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_runtime import F32, F64, I64
from avatar_trainer.captures.checks.conventions import View
from avatar_trainer.captures.checks.silhouette import Seen

FACING = 0.4  # cosine of the largest angle between the normal and the direction to the camera
BEHIND = 0.02  # metres behind the nearest point of a cell: hidden
FEWEST = 3  # images in which a point must be seen
ENOUGH = 50  # points that must be seen so often


@dataclass(frozen=True)
class Colours:
    """Sums over the images in which each of P points is seen."""

    count: F64  # [P]
    sums: F64  # [P, 3]
    squares: F64  # [P, 3]

    @staticmethod
    def none(points: int) -> Colours:
        """Of no image."""
        return Colours(np.zeros(points), np.zeros((points, 3)), np.zeros((points, 3)))

    def add(self, points: I64, colours: F64) -> None:
        """Add the colours [n, 3] of some points [n] in one image."""
        self.count[points] += 1
        self.sums[points] += colours
        self.squares[points] += colours**2


def visible(seen: Seen, points: F64, normals: F64, centre: F64) -> I64:
    """Which of the points [P, 3] with unit `normals` [P, 3] face `centre` [3], the camera, with nothing before them."""
    away = centre - points
    cosine = np.einsum("px,px->p", normals, away) / np.maximum(np.linalg.norm(away, axis=1), 1e-12)
    chosen = np.flatnonzero((seen.cell >= 0) & (cosine > FACING))
    nearest = np.full(seen.cell.max(initial=0) + 1, np.inf)
    np.minimum.at(nearest, seen.cell[chosen], seen.depth[chosen])
    result: I64 = chosen[seen.depth[chosen] < nearest[seen.cell[chosen]] + BEHIND]
    return result


def centre_of(view: View) -> F64:
    """The camera's position in avatar space."""
    matrix = view.camera_from_world @ view.world_from_avatar
    centre: F64 = np.linalg.solve(matrix, np.array([0.0, 0.0, 0.0, 1.0]))[:3]
    return centre


def sample(image: F32, place: F64) -> F64:
    """Colours [n, C] of an image [H, W, C] at places [n, 2] in pixels, bilinear, clamped at its border."""
    size = np.array([image.shape[1], image.shape[0]])
    at = np.clip(place - 0.5, 0, size - 1)
    low = np.minimum(at.astype(np.int64), np.maximum(size - 2, 0))
    high, share = np.minimum(low + 1, size - 1), at - low
    upper = _mixed(image[low[:, 1], low[:, 0]], image[low[:, 1], high[:, 0]], share[:, :1])
    lower = _mixed(image[high[:, 1], low[:, 0]], image[high[:, 1], high[:, 0]], share[:, :1])
    return _mixed(upper, lower, share[:, 1:])


def change(colours: Colours, points: I64) -> float | None:
    """Variance in a point, median over `points`, relative to that between points; None: too few are seen."""
    points = points[colours.count[points] >= FEWEST]
    if len(points) < ENOUGH:
        return None
    count = colours.count[points][:, None]
    mean = colours.sums[points] / count
    within = np.maximum(colours.squares[points] / count - mean**2, 0) * count / (count - 1)
    between = float(mean.var(axis=0).sum())
    return float(np.median(within.sum(axis=1))) / max(between, 1e-9)


def _mixed(a: F32 | F64, b: F32 | F64, share: F64) -> F64:
    result: F64 = a * (1 - share) + b * share
    return result
