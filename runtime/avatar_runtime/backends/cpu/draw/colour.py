"""The colour of stage `project`: SH along R^T d. The sum over the coefficients is fused: 1e-6 from the definition."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.draw.group import BASIS, DIRECTION, LANES, MEAN, SQUARED_DISTANCE
from avatar_runtime.backends.cpu.draw.screen import BLUE, GREEN, RED
from avatar_runtime.backends.cpu.jit import inlined
from avatar_runtime.backends.cpu.lanes import fma
from avatar_schema import constants

f32 = np.float32
C0 = f32(constants()["sh_c0"][0])
C1, C2, C3 = (tuple(f32(v) for v in constants()[name]) for name in ("sh_c1", "sh_c2", "sh_c3"))
HALF, TWO, THREE, FOUR = f32(0.5), f32(2), f32(3), f32(4)


@inlined
def set_direction(group: F32, lane: int, i: int, eye: F32, sh_rotation: F32) -> None:
    """DIRECTION (R^T d) and SQUARED_DISTANCE (|d|^2) of one lane from MEAN; d from the eye to splat i."""
    x, y = group[MEAN + lane] - eye[0], group[MEAN + LANES + lane] - eye[1]
    z = group[MEAN + 2 * LANES + lane] - eye[2]
    group[SQUARED_DISTANCE + lane] = x * x + y * y + z * z
    if len(sh_rotation):
        x, y, z = (
            sh_rotation[i, 0, 0] * x + sh_rotation[i, 1, 0] * y + sh_rotation[i, 2, 0] * z,
            sh_rotation[i, 0, 1] * x + sh_rotation[i, 1, 1] * y + sh_rotation[i, 2, 1] * z,
            sh_rotation[i, 0, 2] * x + sh_rotation[i, 1, 2] * y + sh_rotation[i, 2, 2] * z,
        )
    group[DIRECTION + lane], group[DIRECTION + LANES + lane] = x, y
    group[DIRECTION + 2 * LANES + lane] = z


@inlined
def bases(group: F32) -> None:
    """BASIS, the 16 SH basis functions of each lane along its unit direction."""
    for lane in range(LANES):
        distance = np.sqrt(group[SQUARED_DISTANCE + lane])
        x, y = group[DIRECTION + lane] / distance, group[DIRECTION + LANES + lane] / distance
        z = group[DIRECTION + 2 * LANES + lane] / distance
        xx, yy, zz = x * x, y * y, z * z
        four = FOUR * zz - xx - yy
        group[BASIS + lane] = C0
        group[BASIS + LANES + lane] = C1[0] * y
        group[BASIS + 2 * LANES + lane] = C1[1] * z
        group[BASIS + 3 * LANES + lane] = C1[2] * x
        group[BASIS + 4 * LANES + lane] = C2[0] * (x * y)
        group[BASIS + 5 * LANES + lane] = C2[1] * (y * z)
        group[BASIS + 6 * LANES + lane] = C2[2] * (TWO * zz - xx - yy)
        group[BASIS + 7 * LANES + lane] = C2[3] * (x * z)
        group[BASIS + 8 * LANES + lane] = C2[4] * (xx - yy)
        group[BASIS + 9 * LANES + lane] = C3[0] * y * (THREE * xx - yy)
        group[BASIS + 10 * LANES + lane] = C3[1] * (x * y) * z
        group[BASIS + 11 * LANES + lane] = C3[2] * y * four
        group[BASIS + 12 * LANES + lane] = C3[3] * z * (TWO * zz - THREE * xx - THREE * yy)
        group[BASIS + 13 * LANES + lane] = C3[4] * x * four
        group[BASIS + 14 * LANES + lane] = C3[5] * z * (xx - yy)
        group[BASIS + 15 * LANES + lane] = C3[6] * x * (xx - THREE * yy)


@inlined
def set_colour(splats: F32, i: int, group: F32, lane: int, sh: F32, coefficients: int) -> None:
    """The colour of splat i: sum_k Y_k sh_k + 0.5, clamped below at 0; not a number stays."""
    red, green, blue = f32(0), f32(0), f32(0)
    for k in range(coefficients):
        basis = group[BASIS + LANES * k + lane]
        red, green = fma(basis, sh[i, k, 0], red), fma(basis, sh[i, k, 1], green)
        blue = fma(basis, sh[i, k, 2], blue)
    red, green, blue = red + HALF, green + HALF, blue + HALF
    splats[i, RED] = f32(0) if red < f32(0) else red
    splats[i, GREEN] = f32(0) if green < f32(0) else green
    splats[i, BLUE] = f32(0) if blue < f32(0) else blue
