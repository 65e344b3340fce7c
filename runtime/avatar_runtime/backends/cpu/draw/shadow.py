"""Stage `shadow` of the `cpu` backend: how near the first light splats and mesh are, at the texels that they cover.

Each worker has a map of its own; the least of all is the same for every number of workers.
"""

from __future__ import annotations

import math

import numpy as np

from avatar_runtime.avatar import F32, I64, U32
from avatar_runtime.backends.cpu.arrays import read_only
from avatar_runtime.backends.cpu.jit import inlined, kernel
from avatar_runtime.backends.cpu.lanes import take_next
from avatar_runtime.backends.cpu.rotation import matrix_from_quat
from avatar_runtime.backends.cpu.workers import share
from avatar_runtime.light import SHADOW_SIZE, LightArrays
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.light import FAR, REACH, SPAN, TINY, shadow_points
from avatar_schema import constants

f32 = np.float32
CHUNK = 1024  # splats or triangles that a worker takes at a time
SIZE = SHADOW_SIZE
ALPHA, LOW_PASS = (f32(constants()[name]) for name in ("shadow_alpha", "shadow_low_pass"))
ONE, TWO, LAST = f32(1), f32(2), f32(SIZE - 1)


def shadow_map(splats: Splats, given: LightArrays, mesh: tuple[F32, U32] | None, workers: int) -> F32:
    """[S, S] least distance from the first light; mesh: vertices [V, 3] in the world, triangles [F, 3]."""
    found = np.full((workers, SIZE, SIZE), FAR, np.float32)
    if mesh is not None and len(mesh[1]):
        texel, distance, _ = shadow_points(mesh[0], given)
        points = read_only(np.column_stack([texel, distance]))
        share(mesh_share, workers, np.zeros(1, np.int64), points, read_only(mesh[1], np.uint32), found)
    arrays = (splats.mean, splats.scale, splats.quat_wxyz, splats.opacity, given.shadow_row)
    share(shadow_share, workers, np.zeros(1, np.int64), *map(read_only, arrays), found)
    result: F32 = found.min(axis=0)
    return result


@inlined
def shadow_point(
    x: np.float32, y: np.float32, z: np.float32, rows: F32
) -> tuple[np.float32, np.float32, np.float32, np.float32]:
    """Column and row in texels, distance and 1 / w of a point in the world."""
    scale = ONE / (rows[3, 0] * x + rows[3, 1] * y + rows[3, 2] * z + rows[3, 3])
    column = (rows[0, 0] * x + rows[0, 1] * y + rows[0, 2] * z + rows[0, 3]) * scale
    row = (rows[1, 0] * x + rows[1, 1] * y + rows[1, 2] * z + rows[1, 3]) * scale
    return column, row, rows[2, 0] * x + rows[2, 1] * y + rows[2, 2] * z + rows[2, 3], scale


@kernel()
def shadow_share(
    worker: int,
    counter: I64,  # [1] the next chunk; all workers take from it
    mean: F32,  # [N, 3]
    scale: F32,  # [N, 3]
    quat_wxyz: F32,  # [N, 4]
    opacity: F32,  # [N]
    rows: F32,  # [4, 4]
    found: F32,  # [workers, S, S] in and out
) -> None:
    """Draw chunks of splats into the worker's map until none is left."""
    while True:
        chunk = CHUNK * take_next(counter)
        if chunk >= len(mean):
            return
        for i in range(chunk, min(chunk + CHUNK, len(mean))):
            most = TWO * math.log(max(opacity[i], TINY) / ALPHA)
            if most > f32(0):
                _cast(found[worker], i, most, mean, scale, quat_wxyz, rows)


@inlined
def _cast(found: F32, i: int, most: np.float32, mean: F32, scale: F32, quat_wxyz: F32, rows: F32) -> None:
    """Draw the ellipse of one splat, a plane in the map: the texels where its form is at most `most`."""
    column, row, distance, inverse = shadow_point(mean[i, 0], mean[i, 1], mean[i, 2], rows)
    if not (-REACH <= column <= LAST + REACH and -REACH <= row <= LAST + REACH):  # nor what is no number
        return
    m = matrix_from_quat((quat_wxyz[i, 0], quat_wxyz[i, 1], quat_wxyz[i, 2], quat_wxyz[i, 3]), ONE)
    xx, xy, yy, away_x, away_y = LOW_PASS, f32(0), LOW_PASS, f32(0), f32(0)
    for k in range(3):
        u, v, away = (
            f32(0),
            f32(0),
            f32(0),
        )  # gradients of column, row and distance along an axis of the splat
        for axis in range(3):
            u += m[3 * axis + k] * (rows[0, axis] - column * rows[3, axis]) * inverse
            v += m[3 * axis + k] * (rows[1, axis] - row * rows[3, axis]) * inverse
            away += m[3 * axis + k] * rows[2, axis]
        u, v, away = u * scale[i, k], v * scale[i, k], away * scale[i, k]
        xx, xy, yy = xx + u * u, xy + u * v, yy + v * v
        away_x, away_y = away_x + away * u, away_y + away * v
    det = xx * yy - xy * xy
    if not (distance > f32(0) and det > f32(0)):
        return
    slope_x, slope_y = (yy * away_x - xy * away_y) / det, (xx * away_y - xy * away_x) / det
    half_x, half_y = min(np.sqrt(most * xx), REACH), min(np.sqrt(most * yy), REACH)
    for y in range(_first(row - half_y), _end(row + half_y)):
        dy = f32(y) - row
        for x in range(_first(column - half_x), _end(column + half_x)):
            dx = f32(x) - column
            if dx * (yy * dx - TWO * xy * dy) + xx * dy * dy <= most * det:
                here = max(distance + slope_x * dx + slope_y * dy, f32(0))
                if here < found[y, x]:
                    found[y, x] = here


@inlined
def _first(low: np.float32) -> int:
    """The first texel from `low` on."""
    return int(min(max(np.ceil(low), f32(0)), LAST + ONE))


@inlined
def _end(high: np.float32) -> int:
    """One past the last texel up to `high`."""
    return int(max(min(np.floor(high), LAST), -ONE)) + 1


@kernel()
def mesh_share(
    worker: int,
    counter: I64,  # [1] the next chunk; all workers take from it
    points: F32,  # [V, 3] column and row in texels, distance
    triangles: U32,  # [F, 3]
    found: F32,  # [workers, S, S] in and out
) -> None:
    """Draw chunks of triangles into the worker's map until none is left."""
    while True:
        chunk = CHUNK * take_next(counter)
        if chunk >= len(triangles):
            return
        for i in range(chunk, min(chunk + CHUNK, len(triangles))):
            _cast_triangle(found[worker], points, triangles[i, 0], triangles[i, 1], triangles[i, 2])


@inlined
def _cast_triangle(found: F32, points: F32, i: int, j: int, k: int) -> None:
    """Draw one triangle: the texels whose centres it covers."""
    ax, ay, bx, by = points[i, 0], points[i, 1], points[j, 0], points[j, 1]
    cx, cy = points[k, 0], points[k, 1]
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    nearest = min(points[i, 2], min(points[j, 2], points[k, 2]))
    if not (nearest > f32(0) and abs(area) > f32(0) and abs(area) < f32(np.inf)):
        return
    low_x, low_y = min(ax, min(bx, cx)), min(ay, min(by, cy))
    first_x, first_y = _first(low_x), _first(low_y)
    end_x, end_y = _end(max(ax, max(bx, cx))), _end(max(ay, max(by, cy)))
    for row in range(first_y, min(end_y, first_y + int(SPAN) + 1)):
        y = f32(row)
        for column in range(first_x, min(end_x, first_x + int(SPAN) + 1)):
            x = f32(column)
            u = ((cx - bx) * (y - by) - (cy - by) * (x - bx)) / area
            v = ((ax - cx) * (y - cy) - (ay - cy) * (x - cx)) / area
            w = ((bx - ax) * (y - ay) - (by - ay) * (x - ax)) / area
            if min(u, min(v, w)) >= f32(0):
                here = u * points[i, 2] + v * points[j, 2] + w * points[k, 2]
                if here < found[row, column]:
                    found[row, column] = here
