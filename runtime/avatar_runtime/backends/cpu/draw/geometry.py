"""The geometry of stage `project`: sixteen splats at once, lane by lane, which the compiler turns into vectors.

Order of operations as in the definition, each rounded on its own.
"""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.draw.group import (
    COVARIANCE,
    DEPTH,
    DRAWN,
    LANES,
    MEAN,
    QUAT,
    RADIUS,
    SCALE,
    SPLAT,
    TILES,
)
from avatar_runtime.backends.cpu.draw.screen import (
    CENTRE_X,
    CENTRE_Y,
    CONIC_XX,
    CONIC_XY,
    CONIC_YY,
    OPACITY,
    REACH,
    U_OF_V,
    V_OF_U,
    reach_of,
    tile_edge,
    tile_end,
)
from avatar_runtime.backends.cpu.jit import inlined
from avatar_schema import constants

f32, f64 = np.float32, np.float64
EIGENVALUE_FLOOR = f32(constants()["eigenvalue_floor"])
RADIUS_SIGMAS = f32(constants()["radius_sigmas"])
FRUSTUM_CLAMP = f32(constants()["frustum_clamp"])
HOMOGENEOUS_EPSILON = f32(constants()["homogeneous_epsilon"])
HALF, ONE, TWO = f32(0.5), f32(1), f32(2)


@inlined
def covariances(group: F32) -> None:
    """COVARIANCE (R S S R^T, world space) from QUAT and SCALE."""
    for lane in range(LANES):
        w, x = group[QUAT + lane], group[QUAT + LANES + lane]
        y, z = group[QUAT + 2 * LANES + lane], group[QUAT + 3 * LANES + lane]
        s0, s1 = group[SCALE + lane], group[SCALE + LANES + lane]
        s2 = group[SCALE + 2 * LANES + lane]
        m00, m01 = (ONE - TWO * (y * y + z * z)) * s0, TWO * (x * y - w * z) * s1
        m02, m10 = TWO * (x * z + w * y) * s2, TWO * (x * y + w * z) * s0
        m11, m12 = (ONE - TWO * (x * x + z * z)) * s1, TWO * (y * z - w * x) * s2
        m20, m21 = TWO * (x * z - w * y) * s0, TWO * (y * z + w * x) * s1
        m22 = (ONE - TWO * (x * x + y * y)) * s2
        group[COVARIANCE + lane] = m00 * m00 + m01 * m01 + m02 * m02
        group[COVARIANCE + LANES + lane] = m00 * m10 + m01 * m11 + m02 * m12
        group[COVARIANCE + 2 * LANES + lane] = m00 * m20 + m01 * m21 + m02 * m22
        group[COVARIANCE + 3 * LANES + lane] = m10 * m10 + m11 * m11 + m12 * m12
        group[COVARIANCE + 4 * LANES + lane] = m10 * m20 + m11 * m21 + m12 * m22
        group[COVARIANCE + 5 * LANES + lane] = m20 * m20 + m21 * m21 + m22 * m22


@inlined
def conics(group: F32, view: F32, lens: F32, width: int, height: int) -> None:
    """DEPTH, RADIUS, DRAWN and SPLAT's conic from MEAN and COVARIANCE: J W Sigma W^T J^T and the low-pass."""
    tan_x, tan_y, low_pass, near = lens[0], lens[1], lens[2], lens[3]
    focal_x, focal_y = f32(width) / (TWO * tan_x), f32(height) / (TWO * tan_y)
    limit_x, limit_y = FRUSTUM_CLAMP * tan_x, FRUSTUM_CLAMP * tan_y
    w00, w01, w02, w03 = view[0, 0], view[0, 1], view[0, 2], view[0, 3]
    w10, w11, w12, w13 = view[1, 0], view[1, 1], view[1, 2], view[1, 3]
    w20, w21, w22, w23 = view[2, 0], view[2, 1], view[2, 2], view[2, 3]
    for lane in range(LANES):
        mx, my, mz = group[MEAN + lane], group[MEAN + LANES + lane], group[MEAN + 2 * LANES + lane]
        v00, v01 = group[COVARIANCE + lane], group[COVARIANCE + LANES + lane]
        v02, v11 = group[COVARIANCE + 2 * LANES + lane], group[COVARIANCE + 3 * LANES + lane]
        v12, v22 = group[COVARIANCE + 4 * LANES + lane], group[COVARIANCE + 5 * LANES + lane]
        z = w20 * mx + w21 * my + w22 * mz + w23
        x = _clamped((w00 * mx + w01 * my + w02 * mz + w03) / z, limit_x) * z
        y = _clamped((w10 * mx + w11 * my + w12 * mz + w13) / z, limit_y) * z
        j00, j02 = focal_x / z, -(focal_x * x) / (z * z)
        j11, j12 = focal_y / z, -(focal_y * y) / (z * z)
        a0, a1, a2 = w00 * j00 + w20 * j02, w01 * j00 + w21 * j02, w02 * j00 + w22 * j02
        b0, b1, b2 = w10 * j11 + w20 * j12, w11 * j11 + w21 * j12, w12 * j11 + w22 * j12
        l0 = a0 * v00 + a1 * v01 + a2 * v02
        l1 = a0 * v01 + a1 * v11 + a2 * v12
        l2 = a0 * v02 + a1 * v12 + a2 * v22
        r0 = b0 * v00 + b1 * v01 + b2 * v02
        r1 = b0 * v01 + b1 * v11 + b2 * v12
        r2 = b0 * v02 + b1 * v12 + b2 * v22
        xx = (l0 * a0 + l1 * a1 + l2 * a2) + low_pass
        xy = r0 * a0 + r1 * a1 + r2 * a2
        yy = (r0 * b0 + r1 * b1 + r2 * b2) + low_pass

        determinant = xx * yy - xy * xy
        inverse = ONE / determinant
        mid = HALF * (xx + yy)
        spread = mid * mid - determinant
        root = np.sqrt(EIGENVALUE_FLOOR if spread < EIGENVALUE_FLOOR else spread)
        more, less = mid + root, mid - root
        radius = np.ceil(RADIUS_SIGMAS * np.sqrt(less if less > more else more))

        group[SPLAT + LANES * CONIC_XX + lane] = yy * inverse
        group[SPLAT + LANES * CONIC_XY + lane] = -xy * inverse
        group[SPLAT + LANES * CONIC_YY + lane] = xx * inverse
        group[DEPTH + lane], group[RADIUS + lane] = z, radius
        drawn = (z > near) & (determinant != f32(0)) & (abs(radius) < f32(np.inf))
        group[DRAWN + lane] = ONE if drawn else f32(0)


@inlined
def _clamped(value: np.float32, limit: np.float32) -> np.float32:
    """`value` between -limit and limit; not a number stays."""
    value = -limit if value < -limit else value
    return limit if value > limit else value


@inlined
def centres(group: F32, clip: F32, width: int, height: int) -> None:
    """SPLAT's centre from MEAN: in double from the float32 position in the clip volume."""
    c00, c01, c02, c03 = clip[0, 0], clip[0, 1], clip[0, 2], clip[0, 3]
    c10, c11, c12, c13 = clip[1, 0], clip[1, 1], clip[1, 2], clip[1, 3]
    c30, c31, c32, c33 = clip[3, 0], clip[3, 1], clip[3, 2], clip[3, 3]
    for lane in range(LANES):
        x, y, z = group[MEAN + lane], group[MEAN + LANES + lane], group[MEAN + 2 * LANES + lane]
        reciprocal = ONE / (c30 * x + c31 * y + c32 * z + c33 + HOMOGENEOUS_EPSILON)
        clip_x = f64((c00 * x + c01 * y + c02 * z + c03) * reciprocal)
        clip_y = f64((c10 * x + c11 * y + c12 * z + c13) * reciprocal)
        group[SPLAT + LANES * CENTRE_X + lane] = f32(((clip_x + 1.0) * f64(width) - 1.0) * 0.5)
        group[SPLAT + LANES * CENTRE_Y + lane] = f32(((clip_y + 1.0) * f64(height) - 1.0) * 0.5)


@inlined
def extents(group: F32, columns: int, rows: int) -> None:
    """TILES, the last columns of SPLAT, and DRAWN once more: a splat that touches no tile is not drawn."""
    for lane in range(LANES):
        x, y = group[SPLAT + LANES * CENTRE_X + lane], group[SPLAT + LANES * CENTRE_Y + lane]
        a, b = group[SPLAT + LANES * CONIC_XX + lane], group[SPLAT + LANES * CONIC_XY + lane]
        c, radius = group[SPLAT + LANES * CONIC_YY + lane], group[RADIUS + lane]
        x0, y0 = np.trunc(tile_edge(x - radius, columns)), np.trunc(tile_edge(y - radius, rows))
        x1, y1 = np.trunc(tile_end(x + radius, columns)), np.trunc(tile_end(y + radius, rows))
        group[TILES + lane], group[TILES + LANES + lane] = x0, y0
        group[TILES + 2 * LANES + lane], group[TILES + 3 * LANES + lane] = x1, y1
        group[DRAWN + lane] = group[DRAWN + lane] if (x1 > x0) & (y1 > y0) else f32(0)
        group[SPLAT + LANES * U_OF_V + lane], group[SPLAT + LANES * V_OF_U + lane] = -b / a, -b / c
        group[SPLAT + LANES * REACH + lane] = reach_of(a, b, c, group[SPLAT + LANES * OPACITY + lane])
