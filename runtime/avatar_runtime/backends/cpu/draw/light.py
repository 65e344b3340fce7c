"""Stage `light` of the `cpu` backend: colours in the light of a scene, sixteen drawn splats at once.

Order of operations as in the definition, except that powers are series: a few 1e-7 from it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from avatar_runtime.avatar import F32, I32, I64, Relight
from avatar_runtime.backends.cpu.arrays import read_only
from avatar_runtime.backends.cpu.draw.colour import C0, C1, C2
from avatar_runtime.backends.cpu.draw.group import LANES
from avatar_runtime.backends.cpu.draw.screen import RED
from avatar_runtime.backends.cpu.draw.shadow import SIZE, shadow_point
from avatar_runtime.backends.cpu.jit import called, inlined, kernel
from avatar_runtime.backends.cpu.lanes import power, take_next
from avatar_runtime.backends.cpu.workers import share
from avatar_runtime.light import LightArrays
from avatar_schema import constants

f32 = np.float32
CHUNK = 1024  # splats that a worker takes at a time
MEAN, NORMAL, CAPTURED_NORMAL = 0, 3 * LANES, 6 * LANES  # 3 rows of lanes each
QUAT, SCENE, CAPTURED, DISPLAY = 9 * LANES, 13 * LANES, 16 * LANES, 19 * LANES  # 4, 3, 3 and 3
SEEN = 22 * LANES  # 1: of the first light
GROUP_FLOATS = 23 * LANES
ONE, TWO, THREE, TINY = f32(1), f32(2), f32(3), f32(1e-30)
FLOOR, NEAREST_SQUARED = f32(constants()["light_floor"]), f32(constants()["light_nearest"]) ** 2
DISPLAY_TOE, LINEAR_TOE, SLOPE = f32(0.04045), f32(0.0031308), f32(12.92)  # of sRGB
SCALE, OFFSET, GAMMA, INVERSE_GAMMA = f32(1.055), f32(0.055), f32(2.4), f32(1 / 2.4)


class Lit(NamedTuple):
    """The lights of a scene and of the capture, as the kernel takes them."""

    normal: F32  # [N, 3], which quat_wxyz turns into the world
    ambient: F32  # [9, 4]
    captured: F32  # [9, 3]
    turn: F32  # [3, 4] frame that the captured light moves with from world
    place: F32  # [L, 4]
    colour: F32  # [L, 4]
    shadow_row: F32  # [4, 4]
    shadow_offset: F32  # [4]
    shadow: F32  # [S, S], or [0, 0]: there is none

    @staticmethod
    def of(relight: Relight, given: LightArrays, shadow: F32 | None, normal: F32 | None = None) -> Lit:
        """The arrays of both; lights after the last one that is not black are left out. `normal` replaces its own."""
        lights = int(np.flatnonzero(given.colour.any(axis=1)).max(initial=-1)) + 1
        seen = np.zeros((0, 0), np.float32) if shadow is None or not given.shadow_offset[2] else shadow
        arrays = [relight.normal if normal is None else normal, given.ambient, relight.ambient, given.turn]
        arrays += (given.place[:lights], given.colour[:lights], given.shadow_row, given.shadow_offset, seen)
        return Lit(*map(read_only, arrays))


def light(mean: F32, quat_wxyz: F32, lit: Lit, rows: F32, radius: I32, workers: int) -> None:
    """Changes the colours of `rows` [N, COLUMNS] of a screen where `radius` [N] says that a splat is drawn.

    mean [N, 3] and quat_wxyz [N, 4]: of the splats, in the world.
    """
    counter, drawn = np.zeros(1, np.int64), read_only(radius, np.int32)
    share(light_share, workers, counter, read_only(mean), read_only(quat_wxyz), lit, drawn, rows)


@kernel()
def light_share(
    worker: int,
    counter: I64,  # [1] the next chunk; all workers take from it
    mean: F32,  # [N, 3]
    quat_wxyz: F32,  # [N, 4]
    lit: Lit,
    radius: I32,  # [N]
    rows: F32,  # [N, COLUMNS] in and out
) -> None:
    """Light chunks until none is left."""
    group, ids = np.zeros(GROUP_FLOATS, np.float32), np.zeros(LANES, np.int64)
    while True:
        i = CHUNK * take_next(counter)
        end = min(i + CHUNK, len(mean))
        if i >= end:
            return
        while i < end:
            filled = 0
            while i < end and filled < LANES:
                if radius[i] > 0:
                    ids[filled] = i
                    _load(group, filled, i, mean, quat_wxyz, lit.normal, rows)
                    filled += 1
                i += 1
            _normals(group, lit.turn)
            _see(group, filled, lit)
            _ambient(group, NORMAL, SCENE, lit.ambient)
            for k in range(len(lit.place)):
                _direct(group, lit.place[k], lit.colour[k], k == 0)
            _ambient(group, CAPTURED_NORMAL, CAPTURED, lit.captured)
            _relight(group)
            for lane in range(filled):
                for k in range(3):
                    rows[ids[lane], RED + k] = group[DISPLAY + LANES * k + lane]


@inlined
def _load(group: F32, lane: int, i: int, mean: F32, quat_wxyz: F32, normal: F32, rows: F32) -> None:
    """Put splat i into its lane."""
    for k in range(3):
        group[MEAN + LANES * k + lane], group[NORMAL + LANES * k + lane] = mean[i, k], normal[i, k]
        group[DISPLAY + LANES * k + lane] = rows[i, RED + k]
    for k in range(4):
        group[QUAT + LANES * k + lane] = quat_wxyz[i, k]


@inlined
def _normals(group: F32, turn: F32) -> None:
    """NORMAL, turned into the world and made unit, and CAPTURED_NORMAL, in the frame of the captured light."""
    t00, t01, t02 = turn[0, 0], turn[0, 1], turn[0, 2]
    t10, t11, t12 = turn[1, 0], turn[1, 1], turn[1, 2]
    t20, t21, t22 = turn[2, 0], turn[2, 1], turn[2, 2]
    for lane in range(LANES):
        w, x = group[QUAT + lane], group[QUAT + LANES + lane]
        y, z = group[QUAT + 2 * LANES + lane], group[QUAT + 3 * LANES + lane]
        a, b = group[NORMAL + lane], group[NORMAL + LANES + lane]
        c = group[NORMAL + 2 * LANES + lane]
        nx = (ONE - TWO * (y * y + z * z)) * a + TWO * (x * y - w * z) * b + TWO * (x * z + w * y) * c
        ny = TWO * (x * y + w * z) * a + (ONE - TWO * (x * x + z * z)) * b + TWO * (y * z - w * x) * c
        nz = TWO * (x * z - w * y) * a + TWO * (y * z + w * x) * b + (ONE - TWO * (x * x + y * y)) * c
        length = np.sqrt(nx * nx + ny * ny + nz * nz)
        length = length if length > TINY else TINY
        nx, ny, nz = nx / length, ny / length, nz / length
        group[NORMAL + lane], group[NORMAL + LANES + lane] = nx, ny
        group[NORMAL + 2 * LANES + lane] = nz
        group[CAPTURED_NORMAL + lane] = t00 * nx + t01 * ny + t02 * nz
        group[CAPTURED_NORMAL + LANES + lane] = t10 * nx + t11 * ny + t12 * nz
        group[CAPTURED_NORMAL + 2 * LANES + lane] = t20 * nx + t21 * ny + t22 * nz


@inlined
def _ambient(group: F32, normal: int, out: int, rows: F32) -> None:
    """Irradiance over pi by the unit normals at `normal`."""
    for k in range(3):
        a0, a1, a2, a3, a4 = rows[0, k], rows[1, k], rows[2, k], rows[3, k], rows[4, k]
        a5, a6, a7, a8 = rows[5, k], rows[6, k], rows[7, k], rows[8, k]
        for lane in range(LANES):
            x, y = group[normal + lane], group[normal + LANES + lane]
            z = group[normal + 2 * LANES + lane]
            xx, yy, zz = x * x, y * y, z * z
            total = C0 * a0 + C1[0] * y * a1 + C1[1] * z * a2 + C1[2] * x * a3
            total += C2[0] * (x * y) * a4 + C2[1] * (y * z) * a5 + C2[2] * (TWO * zz - xx - yy) * a6
            group[out + LANES * k + lane] = total + C2[3] * (x * z) * a7 + C2[4] * (xx - yy) * a8


@inlined
def _direct(group: F32, place: F32, colour: F32, first: bool) -> None:
    """Add one light to SCENE."""
    px, py, pz, point = place[0], place[1], place[2], place[3]
    red, green, blue = colour[0], colour[1], colour[2]
    for lane in range(LANES):
        x = px - point * group[MEAN + lane]
        y, z = py - point * group[MEAN + LANES + lane], pz - point * group[MEAN + 2 * LANES + lane]
        squared = x * x + y * y + z * z
        facing = group[NORMAL + lane] * x + group[NORMAL + LANES + lane] * y
        facing += group[NORMAL + 2 * LANES + lane] * z
        facing /= np.sqrt(squared if squared > TINY else TINY)
        amount = facing if facing > f32(0) else f32(0)
        near = squared if squared > NEAREST_SQUARED else NEAREST_SQUARED
        amount = amount / near if point != f32(0) else amount
        amount = amount * group[SEEN + lane] if first else amount
        group[SCENE + lane] += amount * red
        group[SCENE + LANES + lane] += amount * green
        group[SCENE + 2 * LANES + lane] += amount * blue


@inlined
def _relight(group: F32) -> None:
    """DISPLAY in light SCENE of what was trained in light CAPTURED; where these are equal no bit changes."""
    for k in range(3 * LANES):
        scene, captured, display = group[SCENE + k], group[CAPTURED + k], group[DISPLAY + k]
        ratio = (scene if scene > f32(0) else f32(0)) / (captured if captured > FLOOR else FLOOR)
        group[SCENE + k] = ratio
        above = display > DISPLAY_TOE
        linear = display / SLOPE * ratio
        root = power(ratio if above else linear, INVERSE_GAMMA)
        raised = (display + OFFSET) * root
        dark = SLOPE * power(raised / SCALE, GAMMA)
        upper = raised - OFFSET if raised > DISPLAY_TOE + OFFSET else dark
        lower = SLOPE * linear if linear <= LINEAR_TOE else SCALE * root - OFFSET
        group[CAPTURED + k] = upper if above else lower
    for lane in range(LANES):
        same = group[SCENE + lane] == ONE and group[SCENE + LANES + lane] == ONE
        same = same and group[SCENE + 2 * LANES + lane] == ONE
        for k in range(3):
            at = LANES * k + lane
            group[DISPLAY + at] = group[DISPLAY + at] if same else group[CAPTURED + at]


@inlined
def _see(group: F32, filled: int, lit: Lit) -> None:
    """SEEN: 0 in the shadow of the first light, 1 in the light."""
    for lane in range(LANES):
        group[SEEN + lane] = ONE
    if len(lit.shadow):
        for lane in range(filled):
            group[SEEN + lane] = _visible(group, lane, lit)


@called
def _visible(group: F32, lane: int, lit: Lit) -> np.float32:
    """A box of 3x3 texels around where the shadow map has the splat."""
    away, along_light = lit.shadow_offset[0], lit.shadow_offset[1]
    x = group[MEAN + lane] + group[NORMAL + lane] * away
    y = group[MEAN + LANES + lane] + group[NORMAL + LANES + lane] * away
    z = group[MEAN + 2 * LANES + lane] + group[NORMAL + 2 * LANES + lane] * away
    column, row, distance, _ = shadow_point(x, y, z, lit.shadow_row)
    first_column, first_row = np.floor(column), np.floor(row)
    part_column, part_row = column - first_column, row - first_row
    seen = f32(0)
    for j in range(4):
        for i in range(4):
            at_column, at_row = first_column + f32(i - 1), first_row + f32(j - 1)
            inside = f32(0) <= at_column < f32(SIZE) and f32(0) <= at_row < f32(SIZE)
            if not inside or lit.shadow[int(at_row), int(at_column)] >= distance - along_light:
                seen += _weight(i, part_column) * _weight(j, part_row)
    return seen


@inlined
def _weight(i: int, part: np.float32) -> np.float32:
    weight = ONE - part if i == 0 else part if i == 3 else ONE
    return weight / THREE
