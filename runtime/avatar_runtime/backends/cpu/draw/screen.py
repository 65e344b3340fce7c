"""Screen-space splats as the kernels of `cpu` pass them on: one row of 12 float32 a splat."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from avatar_runtime.avatar import F32, I32, I64, U32
from avatar_runtime.backends.cpu.jit import called, inlined, kernel
from avatar_runtime.backends.cpu.lanes import rough_log
from avatar_runtime.camera import Camera
from avatar_schema import constants

COLUMNS = 12
CENTRE_X, CENTRE_Y = 0, 1  # pixels, pixel centres at integers
CONIC_XX, CONIC_XY, CONIC_YY = 2, 3, 4
OPACITY = 5
RED, GREEN, BLUE = 6, 7, 8
REACH = 9  # alpha is certainly below 1/255 if the conic's form is larger than this; infinite: never certain
U_OF_V, V_OF_U = 10, 11  # where the form is least along x for a given y, and along y for a given x

f32, f64 = np.float32, np.float64
TILE = int(constants()["tile"])
ALPHA_MIN_DENOMINATOR = f32(constants()["alpha_min_denominator"])
REACH_SLACK = f32(2e-3)  # twice the error of `rough_log`, and what exp and the product with the opacity round
# Both forms (the definition's and the cull's) round each of 6 operations by 6e-8 of terms that add up to at
# most 4 * condition times the form, condition = ac / (ac - bb).
SLACK_OF_CONDITION = f32(4e-6)
FAR = f32(1e6)  # pixels, the half extents that the definition uses for an unbounded splat
LEAST_DETERMINANT = f32(4e-5)  # of ac; below, the slack is a tenth of the reach and det itself is uncertain


class Screen(NamedTuple):
    """Screen-space splats; everything is 0 where `radius` is 0 (not drawn)."""

    splats: F32  # [N, COLUMNS]
    depth: F32  # [N] view z
    radius: I32  # [N] pixels, 3 standard deviations
    tiles: I32  # [N, 4] tiles that the profile touches: x0, y0, x1, y1 (ends excluded)
    counts: I64  # [workers, tiles of the image] splats that touch each tile, as each worker found them

    @staticmethod
    def empty(count: int, camera: Camera, workers: int) -> Screen:
        """Room for `count` splats; the counts are zeros, the other arrays are uninitialised."""
        columns, rows = -(-camera.width // TILE), -(-camera.height // TILE)
        return Screen(
            np.empty((count, COLUMNS), np.float32),
            np.empty(count, np.float32),
            np.empty(count, np.int32),
            np.empty((count, 4), np.int32),
            np.zeros((workers, columns * rows), np.int64),
        )


@inlined
def tile_grid(width: int, height: int) -> tuple[int, int]:
    """Tiles across and down."""
    return -(-width // TILE), -(-height // TILE)


@inlined
def tile_edge(pixel: np.float32, tiles: int) -> np.float32:
    """The tile that `pixel` lies in, clamped to the image's border, with its fraction. NaN gives 0."""
    tile = pixel / f32(TILE)
    tile = tile if tile > f32(0) else f32(0)
    return f32(tiles) if tile > f32(tiles) else tile


@inlined
def tile_end(pixel: np.float32, tiles: int) -> np.float32:
    """One past the last tile that a box which ends at `pixel` touches; otherwise as `tile_edge`."""
    return tile_edge(pixel + f32(TILE) - f32(1), tiles)


@inlined
def touch_engine(tiles: I32, splats: F32, i: int, columns: int, rows: int) -> None:
    """Write the tiles of the box in which alpha can reach 1/255."""
    x, y, reach = splats[i, CENTRE_X], splats[i, CENTRE_Y], splats[i, REACH]
    a, b, c = splats[i, CONIC_XX], splats[i, CONIC_XY], splats[i, CONIC_YY]
    if reach < f32(np.inf):
        factor = max(reach, f32(0)) / (a * c - b * b)
        half_x, half_y = np.sqrt(c * factor) + f32(1), np.sqrt(a * factor) + f32(1)
    else:
        half_x, half_y = _exact_box(f64(a), f64(b), f64(c), splats[i, OPACITY])
    tiles[i, 0], tiles[i, 1] = tile_edge(x - half_x, columns), tile_edge(y - half_y, rows)
    tiles[i, 2], tiles[i, 3] = tile_end(x + half_x, columns), tile_end(y + half_y, rows)


@called
def _exact_box(
    a: np.float64, b: np.float64, c: np.float64, opacity: np.float32
) -> tuple[np.float32, np.float32]:
    """Half extents of a needle's box, as the definition computes them in double."""
    determinant = a * c - b * b
    if not determinant > 0:  # an indefinite conic bounds nothing
        return FAR, FAR
    reach = 2 * np.log(max(f64(opacity) * f64(ALPHA_MIN_DENOMINATOR), 1.0))
    return f32(np.sqrt(c / determinant * reach) + 1.0), f32(np.sqrt(a / determinant * reach) + 1.0)


@inlined
def reach_of(a: np.float32, b: np.float32, c: np.float32, opacity: np.float32) -> np.float32:
    """The conic's form beyond which alpha is certainly below 1/255; negative if it is below everywhere.

    2 ln(255 opacity) and slack for every rounding; infinite if the conic is too thin or not an ellipse.
    """
    product = a * c
    determinant = product - b * b
    reach = f32(2) * rough_log(ALPHA_MIN_DENOMINATOR * opacity) + REACH_SLACK
    reach *= f32(1) + SLACK_OF_CONDITION * (product / determinant)
    return reach if determinant > LEAST_DETERMINANT * product else f32(np.inf)


@inlined
def count_tiles(counts: I64, worker: int, tiles: I32, i: int, columns: int) -> None:
    """Count splat i in each of its tiles."""
    for row in range(tiles[i, 1], tiles[i, 3]):
        for column in range(tiles[i, 0], tiles[i, 2]):
            counts[worker, row * columns + column] += 1


@kernel()
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
) -> None:
    """A screen's rows and tiles from what stage `project` gives."""
    columns, rows = tile_grid(width, height)
    for i in range(len(radius)):
        x, y, size = centre[i, 0], centre[i, 1], f32(radius[i])
        a, b, c = conic[i, 0], conic[i, 1], conic[i, 2]
        splats[i, CENTRE_X], splats[i, CENTRE_Y], splats[i, OPACITY] = x, y, opacity[i]
        splats[i, CONIC_XX], splats[i, CONIC_XY], splats[i, CONIC_YY] = a, b, c
        splats[i, RED], splats[i, GREEN], splats[i, BLUE] = rgb[i, 0], rgb[i, 1], rgb[i, 2]
        splats[i, REACH] = reach_of(a, b, c, opacity[i])
        splats[i, U_OF_V], splats[i, V_OF_U] = -b / a, -b / c
        tiles[i, :] = np.int32(0)
        if radius[i] != 0 and engine:
            touch_engine(tiles, splats, i, columns, rows)
        elif radius[i] != 0:
            tiles[i, 0], tiles[i, 1] = tile_edge(x - size, columns), tile_edge(y - size, rows)
            tiles[i, 2], tiles[i, 3] = tile_end(x + size, columns), tile_end(y + size, rows)


@kernel()
def count_all(
    tiles: I32,  # [N, 4]
    order: U32,  # [drawn] ids
    columns: int,
    counts: I64,  # [1, tiles] out; comes as zeros
) -> None:
    """Count the splats of `order` in their tiles."""
    for i in order:
        count_tiles(counts, 0, tiles, i, columns)
