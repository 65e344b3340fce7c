"""Screen-space splats as the kernels of `cpu` pass them on: one row of 12 float32 a splat."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit

from avatar_runtime.avatar import F32, I32, I64
from avatar_runtime.camera import Camera
from avatar_schema import constants

COLUMNS = 12
CENTRE_X, CENTRE_Y = 0, 1  # pixels, pixel centres at integers
CONIC_XX, CONIC_XY, CONIC_YY = 2, 3, 4
OPACITY = 5
RED, GREEN, BLUE = 6, 7, 8
REACH = 9  # alpha is surely below 1/255 where the conic's form is beyond this; infinite: nowhere sure
U_OF_V, V_OF_U = 10, 11  # where the form is least along x for a given y, and along y for a given x

f32, f64 = np.float32, np.float64
TILE = int(constants()["tile"])
ALPHA_MIN_DENOMINATOR = f32(constants()["alpha_min_denominator"])
FAR = f32(1e6)  # tiles; stage `project` cuts rectangles there before they become integers
# exp, log and the product with the opacity are each right to 1e-6 of alpha.
REACH_SLACK = f32(1e-3)
# Both forms (the definition's and the cull's) round each of 6 operations by 6e-8 of terms that add up to at
# most 4 * condition times the form, condition = ac / (ac - bb).
SLACK_OF_CONDITION = f32(4e-6)
LEAST_DETERMINANT = f32(4e-5)  # of ac; below, the slack is a tenth of the reach and det itself is unsure


@dataclass(frozen=True)
class Screen:
    """Screen-space splats; everything is 0 where `radius` is 0 (not drawn)."""

    splats: F32  # [N, COLUMNS]
    depth: F32  # [N] view z
    radius: I32  # [N] pixels, 3 standard deviations
    tiles: I32  # [N, 4] tiles that the profile touches: x0, y0, x1, y1 (ends excluded)
    counts: I64  # [workers, tiles of the picture] splats that touch each tile, as each worker found them

    @staticmethod
    def empty(count: int, camera: Camera, workers: int) -> Screen:
        """Room for `count` splats; the counts are zeros, the rest is not."""
        columns, rows = tile_grid(camera.width, camera.height)
        return Screen(
            np.empty((count, COLUMNS), np.float32),
            np.empty(count, np.float32),
            np.empty(count, np.int32),
            np.empty((count, 4), np.int32),
            np.zeros((workers, columns * rows), np.int64),
        )


@njit(forceinline=True)
def tile_grid(width: int, height: int) -> tuple[int, int]:
    """Tiles across and down."""
    return -(-width // TILE), -(-height // TILE)


@njit(forceinline=True, error_model="numpy")
def tile_edge(pixel: float, tiles: int) -> int:
    """The tile that `pixel` lies in, cut at the picture's border; not a number gives 0."""
    tile = pixel / f32(TILE)
    if not abs(tile) < FAR:
        tile = FAR if tile > f32(0) else f32(0)
    return np.int32(min(max(np.int64(tile), 0), tiles))


@njit(forceinline=True, error_model="numpy")
def touch(tiles: I32, x: float, y: float, half_x: float, half_y: float, columns: int, rows: int) -> bool:
    """Write the tiles of a box about (x, y) into `tiles` [4]; False where there are none."""
    tiles[0], tiles[1] = tile_edge(x - half_x, columns), tile_edge(y - half_y, rows)
    tiles[2] = tile_edge((x + half_x) + f32(TILE) - f32(1), columns)
    tiles[3] = tile_edge((y + half_y) + f32(TILE) - f32(1), rows)
    return tiles[2] > tiles[0] and tiles[3] > tiles[1]


@njit(forceinline=True, error_model="numpy")
def touch_engine(tiles: I32, splat: F32, columns: int, rows: int) -> None:
    """Write the tiles of the box in which alpha can reach 1/255."""
    a, b, c, reach = splat[CONIC_XX], splat[CONIC_XY], splat[CONIC_YY], splat[REACH]
    if reach < f32(np.inf):
        reach = max(reach, f32(0))
        factor = reach / (a * c - b * b)
        half_x, half_y = np.sqrt(c * factor) + f32(1), np.sqrt(a * factor) + f32(1)
    else:
        half_x, half_y = _exact_box(f64(a), f64(b), f64(c), splat[OPACITY])
    touch(tiles, splat[CENTRE_X], splat[CENTRE_Y], half_x, half_y, columns, rows)


@njit(error_model="numpy")
def _exact_box(a: float, b: float, c: float, opacity: float) -> tuple[float, float]:
    """Half extents of a needle's box, as the definition computes them in double."""
    determinant = a * c - b * b
    if not determinant > 0:  # an indefinite conic bounds nothing
        return f32(FAR), f32(FAR)
    reach = 2 * np.log(max(f64(opacity) * f64(ALPHA_MIN_DENOMINATOR), 1.0))
    return f32(np.sqrt(c / determinant * reach) + 1.0), f32(np.sqrt(a / determinant * reach) + 1.0)


@njit(forceinline=True, error_model="numpy")
def set_reach(splat: F32) -> None:
    """Write what the cull of blocks needs, from the conic and the opacity.

    The reach is 2 ln(255 opacity) and slack for every rounding, negative where alpha is below 1/255 everywhere.
    """
    a, b, c = splat[CONIC_XX], splat[CONIC_XY], splat[CONIC_YY]
    splat[U_OF_V], splat[V_OF_U] = -b / a, -b / c
    product = a * c
    determinant = product - b * b
    if determinant > LEAST_DETERMINANT * product:
        reach = f32(2) * np.log(ALPHA_MIN_DENOMINATOR * splat[OPACITY]) + f32(2) * REACH_SLACK
        splat[REACH] = reach * (f32(1) + SLACK_OF_CONDITION * (product / determinant))
    else:  # also where something is not a number
        splat[REACH] = f32(np.inf)


@njit(forceinline=True)
def count_tiles(counts: I64, tiles: I32, columns: int) -> None:
    """Count one splat in each of its tiles."""
    for row in range(tiles[1], tiles[3]):
        for column in range(tiles[0], tiles[2]):
            counts[row * columns + column] += 1


@njit(cache=True, error_model="numpy")
def fill_screen(
    centre: F32,  # [N, 2]
    conic: F32,  # [N, 3]
    opacity: F32,  # [N]
    rgb: F32,  # [N, 3]
    radius: I32,  # [N]
    width: int,
    height: int,
    engine: bool,
    splats: F32,  # [N, COLUMNS] out
    tiles: I32,  # [N, 4] out
    counts: I64,  # [1, tiles] out; comes as zeros
) -> None:
    """A screen from what stage `project` gives."""
    columns, rows = tile_grid(width, height)
    for i in range(len(radius)):
        splat = splats[i]
        tiles[i, :] = np.int32(0)
        splat[CENTRE_X], splat[CENTRE_Y], splat[OPACITY] = centre[i, 0], centre[i, 1], opacity[i]
        splat[CONIC_XX], splat[CONIC_XY], splat[CONIC_YY] = conic[i, 0], conic[i, 1], conic[i, 2]
        splat[RED], splat[GREEN], splat[BLUE] = rgb[i, 0], rgb[i, 1], rgb[i, 2]
        set_reach(splat)
        if radius[i] == 0:
            continue
        if engine:
            touch_engine(tiles[i], splat, columns, rows)
        else:
            touch(tiles[i], centre[i, 0], centre[i, 1], f32(radius[i]), f32(radius[i]), columns, rows)
        count_tiles(counts[0], tiles[i], columns)
