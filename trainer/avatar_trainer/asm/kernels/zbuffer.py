"""What of a mesh several cameras see: the depth of the nearest surface at every pixel, and points held against it."""

from __future__ import annotations

import math

import numba
import numpy as np
import numpy.typing as npt

from avatar_runtime import F32, F64, I64
from avatar_runtime.backends.cpu import inlined, kernel

NEAR = 0.01  # metres; triangles that reach nearer are left out


def depth_buffers(points: F64, triangles: I64, intrinsics: F64, size: tuple[int, int]) -> F32:
    """[N, H, W] metres along the optical axis to the nearest triangle at each pixel's centre, infinite for none.

    points [N, V, 3] in the space of each camera (OpenCV), triangles [F, 3] seen from both sides, intrinsics [3, 3]
    without skew, size (width, height). Does not depend on the number of threads. Raises ValueError for other shapes
    and for triangles that name vertices beyond the points.
    """
    if points.ndim != 3 or points.shape[2] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ValueError(
            f"points {points.shape}, triangles {triangles.shape}; [N, V, 3] and [F, 3] are needed"
        )
    if triangles.size and not 0 <= triangles.min() <= triangles.max() < points.shape[1]:
        raise ValueError(f"triangles name vertices beyond the {points.shape[1]} there are")
    depth = np.full((len(points), size[1], size[0]), np.inf, np.float32)
    focal, principal = np.diag(intrinsics)[:2].copy(), intrinsics[:2, 2].copy()
    _draw(
        np.ascontiguousarray(points, np.float64),
        np.ascontiguousarray(triangles, np.int64),
        focal,
        principal,
        depth,
    )
    return depth


def in_front(buffers: F32, pixels: F64, depth: F64, slack: float) -> npt.NDArray[np.bool_]:
    """[N, P] whether points at `pixels` [N, P, 2] and `depth` [N, P] are in the image, and at most `slack` metres
    behind what buffers [N, H, W] hold there."""
    height, width = buffers.shape[1:]
    column, row = (
        np.floor(np.nan_to_num(pixels[..., i], nan=-1.0)).clip(-1, 1e6).astype(np.int64) for i in (0, 1)
    )
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height) & (depth > NEAR)
    view = np.arange(len(buffers))[:, None]
    before = depth <= buffers[view, row.clip(0, height - 1), column.clip(0, width - 1)] + slack
    result: npt.NDArray[np.bool_] = inside & before
    return result


def covering(corners: F64, triangles: I64, size: int) -> tuple[I64, F64]:
    """(triangle [S, S], barycentric [S, S, 3]) that hold each pixel's centre of a square image; -1 where none does.

    corners [V, 2] pixels, triangles [F, 3]; where triangles overlap, the first. Raises ValueError as `depth_buffers`.
    """
    if corners.ndim != 2 or corners.shape[1] != 2 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise ValueError(
            f"corners {corners.shape}, triangles {triangles.shape}; [V, 2] and [F, 3] are needed"
        )
    if triangles.size and not 0 <= triangles.min() <= triangles.max() < len(corners):
        raise ValueError(f"triangles name vertices beyond the {len(corners)} there are")
    triangle, barycentric = np.full((size, size), -1, np.int64), np.zeros((size, size, 3))
    _cover(
        np.ascontiguousarray(corners, np.float64),
        np.ascontiguousarray(triangles, np.int64),
        triangle,
        barycentric,
    )
    return triangle, barycentric


@kernel(parallel=True)
def _draw(points: F64, triangles: I64, focal: F64, principal: F64, depth: F32) -> None:
    count, height, width = depth.shape
    for n in numba.prange(count):
        place = np.empty((points.shape[1], 3))  # pixels, 1 / depth
        for v in range(points.shape[1]):
            z = points[n, v, 2]
            place[v, 2] = 1 / z if z > NEAR else -1.0
            for i in range(2):
                place[v, i] = points[n, v, i] / z * focal[i] + principal[i] if z > NEAR else 0.0
        for f in range(len(triangles)):
            a, b, c = place[triangles[f, 0]], place[triangles[f, 1]], place[triangles[f, 2]]
            if a[2] < 0 or b[2] < 0 or c[2] < 0:
                continue
            area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
            if area == 0:
                continue
            left, right, top, bottom = _box(a, b, c, width, height)
            for y in range(top, bottom):
                for x in range(left, right):
                    to_a, to_b = _shares(a, b, c, x + 0.5, y + 0.5, area)
                    to_c = 1 - to_a - to_b
                    if to_a < 0 or to_b < 0 or to_c < 0:
                        continue
                    z = np.float32(1 / (to_a * a[2] + to_b * b[2] + to_c * c[2]))
                    if z < depth[n, y, x]:
                        depth[n, y, x] = z


@kernel()
def _cover(corners: F64, triangles: I64, triangle: I64, barycentric: F64) -> None:
    height, width = triangle.shape
    for f in range(len(triangles)):
        a, b, c = corners[triangles[f, 0]], corners[triangles[f, 1]], corners[triangles[f, 2]]
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0:
            continue
        left, right, top, bottom = _box(a, b, c, width, height)
        for y in range(top, bottom):
            for x in range(left, right):
                u, v = _shares(a, b, c, x + 0.5, y + 0.5, area)
                if u < 0 or v < 0 or 1 - u - v < 0 or triangle[y, x] >= 0:
                    continue
                triangle[y, x] = f
                barycentric[y, x, 0], barycentric[y, x, 1], barycentric[y, x, 2] = u, v, 1 - u - v


@inlined
def _box(a: F64, b: F64, c: F64, width: int, height: int) -> tuple[int, int, int, int]:
    """Left, right, top, bottom of the pixels that may lie in a triangle, ends excluded.

    In floats until they are within the image: a vertex may project anywhere.
    """
    left = int(max(math.floor(min(a[0], b[0], c[0])), 0.0))
    right = int(min(math.ceil(max(a[0], b[0], c[0])), float(width)))
    top = int(max(math.floor(min(a[1], b[1], c[1])), 0.0))
    bottom = int(min(math.ceil(max(a[1], b[1], c[1])), float(height)))
    return left, right, top, bottom


@inlined
def _shares(a: F64, b: F64, c: F64, x: float, y: float, area: float) -> tuple[float, float]:
    u = ((b[0] - x) * (c[1] - y) - (b[1] - y) * (c[0] - x)) / area
    v = ((c[0] - x) * (a[1] - y) - (c[1] - y) * (a[0] - x)) / area
    return u, v
