"""Stage `project` of the `cpu` backend: EWA and SH colour, in the definition's order of operations.

Sixteen splats are a group: their geometry and SH basis are computed lane by lane, which the compiler turns
into vectors; what depends on being drawn follows splat by splat.
"""

from __future__ import annotations

import numpy as np
from numba import njit, prange

from avatar_runtime.avatar import F32, I32, I64, RasterSettings
from avatar_runtime.backends.cpu.lanes import fma, take_next
from avatar_runtime.backends.cpu.screen import (
    BLUE,
    CENTRE_X,
    CENTRE_Y,
    CONIC_XX,
    CONIC_XY,
    CONIC_YY,
    GREEN,
    OPACITY,
    RED,
    Screen,
    count_tiles,
    tile_grid,
    set_reach,
    touch,
    touch_engine,
)
from avatar_runtime.camera import Camera
from avatar_schema import constants

f32, f64 = np.float32, np.float64
EIGENVALUE_FLOOR = f32(constants()["eigenvalue_floor"])
RADIUS_SIGMAS = f32(constants()["radius_sigmas"])
FRUSTUM_CLAMP = f32(constants()["frustum_clamp"])
HOMOGENEOUS_EPSILON = f32(constants()["homogeneous_epsilon"])
C0 = f32(constants()["sh_c0"][0])
C1, C2, C3 = (tuple(f32(v) for v in constants()[name]) for name in ("sh_c1", "sh_c2", "sh_c3"))
HALF, ONE, TWO, THREE, FOUR = f32(0.5), f32(1), f32(2), f32(3), f32(4)
LANES = 16
# Rows of a group's lanes: what `_geometry` leaves, and from BASIS on the SH basis functions.
X, Y, DEPTH, XX, XY, YY, RADIUS, DRAWN = (LANES * k for k in range(8))
X_DIRECTION, Y_DIRECTION, Z_DIRECTION, BASIS = (LANES * k for k in range(8, 12))
GROUP_FLOATS = BASIS + 16 * LANES
CHUNK = 64  # groups that a worker takes at once
INT32_END = f32(2**31)


def project(
    mean: F32,  # [N, 3]
    scale: F32,  # [N, 3]
    quat_wxyz: F32,  # [N, 4]
    opacity: F32,  # [N]
    sh: F32,  # [N, K, 3]
    sh_rotation: F32 | None,  # [N, 3, 3]
    camera: Camera,
    settings: RasterSettings,
    sh_degree: int,
    profile: str,
    workers: int,
) -> Screen:
    """Screen-space splats, and the tiles that `profile` touches. Arrays are C-contiguous float32."""
    screen = Screen.empty(len(mean), camera, workers)
    turned = sh_rotation is not None
    lens = (camera.tan_half_fov_x, camera.tan_half_fov_y, settings.low_pass, settings.near)
    project_splats(
        *(mean, scale, quat_wxyz, opacity, sh),
        *(sh_rotation if turned else np.zeros((0, 3, 3), np.float32), turned),
        *(camera.camera_from_world, camera.clip_from_world, camera.centre, np.array(lens, np.float32)),
        *(camera.width, camera.height, (sh_degree + 1) ** 2, profile == "engine"),
        *(screen.splats, screen.depth, screen.radius, screen.tiles, screen.counts),
    )
    return screen


@njit(cache=True, error_model="numpy", parallel=True)
def project_splats(
    mean: F32,
    scale: F32,
    quat_wxyz: F32,
    opacity: F32,
    sh: F32,
    sh_rotation: F32,
    turned: bool,  # whether sh_rotation [N, 3, 3] is there
    view: F32,  # [4, 4] camera_from_world
    clip: F32,  # [4, 4] clip_from_world
    eye: F32,  # [3] world
    lens: F32,  # [4] tan_half_fov_x, tan_half_fov_y, low_pass, near
    width: int,
    height: int,
    coefficients: int,  # of the SH degree
    engine: bool,  # the engine profile's tiles, not the trainer's
    splats: F32,  # [N, COLUMNS] out, like all that follow
    depth: F32,  # [N]
    radius: I32,  # [N]
    tiles: I32,  # [N, 4]
    counts: I64,  # [workers, tiles] how many splats a worker found in each tile; comes as zeros
) -> None:
    """Fill the screen's arrays. The workers take chunks of groups from one counter."""
    counter = np.zeros(1, np.int64)
    for worker in prange(len(counts)):
        _work(
            *(counter, mean, scale, quat_wxyz, opacity, sh, sh_rotation, turned, view, clip, eye, lens),
            *(width, height, coefficients, engine, splats, depth, radius, tiles, counts[worker]),
        )


@njit(cache=True, error_model="numpy")
def _work(
    counter: I64,
    mean: F32,
    scale: F32,
    quat_wxyz: F32,
    opacity: F32,
    sh: F32,
    sh_rotation: F32,
    turned: bool,
    view: F32,
    clip: F32,
    eye: F32,
    lens: F32,
    width: int,
    height: int,
    coefficients: int,
    engine: bool,
    splats: F32,
    depth: F32,
    radius: I32,
    tiles: I32,
    counts: I64,
) -> None:
    """Project chunks until none is left."""
    group = np.empty(GROUP_FLOATS, np.float32)
    columns, rows = tile_grid(width, height)
    while True:
        chunk = LANES * CHUNK * take_next(counter)
        if chunk >= len(mean):
            return
        for begin in range(chunk, min(chunk + LANES * CHUNK, len(mean)), LANES):
            _geometry(group, begin, mean, scale, quat_wxyz, view, clip, lens, width, height)
            _basis(group, begin, mean, sh_rotation, turned, eye)
            for lane in range(min(LANES, len(mean) - begin)):
                i = begin + lane
                drawn = _place(splats[i], tiles[i], group, lane, opacity[i], columns, rows, engine)
                depth[i] = group[DEPTH + lane] if drawn else f32(0)
                radius[i] = _whole(group[RADIUS + lane]) if drawn else np.int32(0)
                if drawn:
                    _colour(splats[i], group, lane, sh[i], coefficients)
                    count_tiles(counts, tiles[i], columns)


@njit(forceinline=True, error_model="numpy")
def _geometry(
    group: F32,
    begin: int,
    mean: F32,
    scale: F32,
    quat_wxyz: F32,
    view: F32,
    clip: F32,
    lens: F32,
    width: int,
    height: int,
) -> None:
    """Rows X to DRAWN of the group that starts at splat `begin`; beyond the last splat it repeats that one."""
    tan_x, tan_y, low_pass, near = lens[0], lens[1], lens[2], lens[3]
    focal_x, focal_y = f32(width) / (TWO * tan_x), f32(height) / (TWO * tan_y)
    limit_x, limit_y = FRUSTUM_CLAMP * tan_x, FRUSTUM_CLAMP * tan_y
    w00, w01, w02, w03 = view[0, 0], view[0, 1], view[0, 2], view[0, 3]
    w10, w11, w12, w13 = view[1, 0], view[1, 1], view[1, 2], view[1, 3]
    w20, w21, w22, w23 = view[2, 0], view[2, 1], view[2, 2], view[2, 3]
    c00, c01, c02, c03 = clip[0, 0], clip[0, 1], clip[0, 2], clip[0, 3]
    c10, c11, c12, c13 = clip[1, 0], clip[1, 1], clip[1, 2], clip[1, 3]
    c30, c31, c32, c33 = clip[3, 0], clip[3, 1], clip[3, 2], clip[3, 3]
    last = len(mean) - 1
    for lane in range(LANES):
        i = min(begin + lane, last)
        mx, my, mz = mean[i, 0], mean[i, 1], mean[i, 2]
        px = w00 * mx + w01 * my + w02 * mz + w03
        py = w10 * mx + w11 * my + w12 * mz + w13
        z = w20 * mx + w21 * my + w22 * mz + w23

        # Covariance R S S R^T in world space.
        qw, qx, qy, qz = quat_wxyz[i, 0], quat_wxyz[i, 1], quat_wxyz[i, 2], quat_wxyz[i, 3]
        s0, s1, s2 = scale[i, 0], scale[i, 1], scale[i, 2]
        m00, m01 = (ONE - TWO * (qy * qy + qz * qz)) * s0, TWO * (qx * qy - qw * qz) * s1
        m02, m10 = TWO * (qx * qz + qw * qy) * s2, TWO * (qx * qy + qw * qz) * s0
        m11, m12 = (ONE - TWO * (qx * qx + qz * qz)) * s1, TWO * (qy * qz - qw * qx) * s2
        m20, m21 = TWO * (qx * qz - qw * qy) * s0, TWO * (qy * qz + qw * qx) * s1
        m22 = (ONE - TWO * (qx * qx + qy * qy)) * s2
        v00 = m00 * m00 + m01 * m01 + m02 * m02
        v01 = m00 * m10 + m01 * m11 + m02 * m12
        v02 = m00 * m20 + m01 * m21 + m02 * m22
        v11 = m10 * m10 + m11 * m11 + m12 * m12
        v12 = m10 * m20 + m11 * m21 + m12 * m22
        v22 = m20 * m20 + m21 * m21 + m22 * m22

        # T = J W, the Jacobian at the clamped position; then T Sigma T^T.
        x, y = _clamped(px / z, limit_x) * z, _clamped(py / z, limit_y) * z
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

        # The pixel position is computed in double from the float32 position in the clip volume.
        reciprocal = ONE / (c30 * mx + c31 * my + c32 * mz + c33 + HOMOGENEOUS_EPSILON)
        clip_x = f64((c00 * mx + c01 * my + c02 * mz + c03) * reciprocal)
        clip_y = f64((c10 * mx + c11 * my + c12 * mz + c13) * reciprocal)
        group[X + lane] = f32(((clip_x + 1.0) * f64(width) - 1.0) * 0.5)
        group[Y + lane] = f32(((clip_y + 1.0) * f64(height) - 1.0) * 0.5)
        group[DEPTH + lane] = z
        group[XX + lane] = yy * inverse
        group[XY + lane] = -xy * inverse
        group[YY + lane] = xx * inverse
        group[RADIUS + lane] = radius
        drawn = (z > near) & (determinant != f32(0)) & (abs(radius) < f32(np.inf))
        group[DRAWN + lane] = ONE if drawn else f32(0)


@njit(forceinline=True)
def _clamped(value: float, limit: float) -> float:
    """`value` between -limit and limit; not a number stays."""
    value = -limit if value < -limit else value
    return limit if value > limit else value


@njit(forceinline=True, error_model="numpy")
def _basis(group: F32, begin: int, mean: F32, sh_rotation: F32, turned: bool, eye: F32) -> None:
    """The 16 SH basis functions of each lane along R^T d, d from the eye to the splat."""
    eye_x, eye_y, eye_z = eye[0], eye[1], eye[2]
    last = len(mean) - 1
    for lane in range(LANES):
        i = min(begin + lane, last)
        x, y, z = mean[i, 0] - eye_x, mean[i, 1] - eye_y, mean[i, 2] - eye_z
        length = np.sqrt(x * x + y * y + z * z)
        group[X_DIRECTION + lane], group[Y_DIRECTION + lane] = x / length, y / length
        group[Z_DIRECTION + lane] = z / length
    if turned:
        for lane in range(LANES):
            r = sh_rotation[min(begin + lane, last)]
            x, y, z = group[X_DIRECTION + lane], group[Y_DIRECTION + lane], group[Z_DIRECTION + lane]
            group[X_DIRECTION + lane] = r[0, 0] * x + r[1, 0] * y + r[2, 0] * z
            group[Y_DIRECTION + lane] = r[0, 1] * x + r[1, 1] * y + r[2, 1] * z
            group[Z_DIRECTION + lane] = r[0, 2] * x + r[1, 2] * y + r[2, 2] * z
    for lane in range(LANES):
        x, y, z = group[X_DIRECTION + lane], group[Y_DIRECTION + lane], group[Z_DIRECTION + lane]
        xx, yy, zz = x * x, y * y, z * z
        four = FOUR * zz - xx - yy
        group[BASIS + lane] = C0
        group[BASIS + 16 + lane] = C1[0] * y
        group[BASIS + 32 + lane] = C1[1] * z
        group[BASIS + 48 + lane] = C1[2] * x
        group[BASIS + 64 + lane] = C2[0] * (x * y)
        group[BASIS + 80 + lane] = C2[1] * (y * z)
        group[BASIS + 96 + lane] = C2[2] * (TWO * zz - xx - yy)
        group[BASIS + 112 + lane] = C2[3] * (x * z)
        group[BASIS + 128 + lane] = C2[4] * (xx - yy)
        group[BASIS + 144 + lane] = C3[0] * y * (THREE * xx - yy)
        group[BASIS + 160 + lane] = C3[1] * (x * y) * z
        group[BASIS + 176 + lane] = C3[2] * y * four
        group[BASIS + 192 + lane] = C3[3] * z * (TWO * zz - THREE * xx - THREE * yy)
        group[BASIS + 208 + lane] = C3[4] * x * four
        group[BASIS + 224 + lane] = C3[5] * z * (xx - yy)
        group[BASIS + 240 + lane] = C3[6] * x * (xx - THREE * yy)


@njit(forceinline=True, error_model="numpy")
def _place(
    splat: F32, tiles: I32, group: F32, lane: int, opacity: float, columns: int, rows: int, engine: bool
) -> bool:
    """Write the splat's row but for its colour, and its tiles; all zeros and False where it is not drawn."""
    x, y, radius = group[X + lane], group[Y + lane], group[RADIUS + lane]
    if group[DRAWN + lane] == f32(0) or not touch(tiles, x, y, radius, radius, columns, rows):
        splat[:] = f32(0)
        tiles[:] = np.int32(0)
        return False
    splat[CENTRE_X], splat[CENTRE_Y], splat[OPACITY] = x, y, opacity
    splat[CONIC_XX], splat[CONIC_XY], splat[CONIC_YY] = group[XX + lane], group[XY + lane], group[YY + lane]
    set_reach(splat)
    if engine:
        touch_engine(tiles, splat, columns, rows)
    return True


@njit(forceinline=True)
def _whole(radius: float) -> int:
    """A radius as int32; beyond its range the least, as NumPy converts."""
    return np.int32(radius) if radius < INT32_END else np.int32(-(2**31))


@njit(forceinline=True)
def _colour(splat: F32, group: F32, lane: int, sh: F32, coefficients: int) -> None:
    """sum_k Y_k sh_k + 0.5, clamped below at 0; not a number stays."""
    red, green, blue = f32(0), f32(0), f32(0)
    for k in range(coefficients):
        basis = group[BASIS + LANES * k + lane]
        red, green, blue = fma(basis, sh[k, 0], red), fma(basis, sh[k, 1], green), fma(basis, sh[k, 2], blue)
    red, green, blue = red + HALF, green + HALF, blue + HALF
    splat[RED] = f32(0) if red < f32(0) else red
    splat[GREEN] = f32(0) if green < f32(0) else green
    splat[BLUE] = f32(0) if blue < f32(0) else blue
