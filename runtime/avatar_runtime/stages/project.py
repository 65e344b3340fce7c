"""Stage `project`: EWA projection and SH colour, in float32 and in the trainer's order of operations.

The definition is the CUDA rasteriser of diff-gaussian-rasterization 59f5f77 (file:line at each constant in
constants.json): sums run from left to right and each operation rounds on its own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, I32, RasterSettings
from avatar_runtime.camera import Camera
from avatar_runtime.stages.activate import Splats
from avatar_schema import constants

f32 = np.float32
TILE = int(constants()["tile"])


@dataclass(frozen=True)
class Projected:
    """The screen-space splats; everything is 0 where `radius` is 0 (not drawn)."""

    centre: F32  # [N, 2] pixels, pixel centres at integers
    depth: F32  # [N] view z
    conic: F32  # [N, 3] inverse 2D covariance xx, xy, yy
    opacity: F32  # [N]
    rgb: F32  # [N, 3] display-referred, >= 0
    radius: I32  # [N] pixels, 3 standard deviations
    cov3d: F32  # [N, 6] xx xy xz yy yz zz, world
    tiles: I32  # [N, 4] touched tiles: x0, y0, x1, y1 (ends excluded)


def project(splats: Splats, camera: Camera, settings: RasterSettings, sh_degree: int) -> Projected:
    """Screen-space splats of `splats` seen by `camera`."""
    view = camera.camera_from_world
    with np.errstate(all="ignore"):  # what overflows or divides by zero is culled below
        p = _affine(view, splats.mean)
        cov3d = covariance(splats.scale, splats.quat_wxyz)
        cov = projected_covariance(p, cov3d, camera, settings.low_pass)
        det = cov[:, 0] * cov[:, 2] - cov[:, 1] * cov[:, 1]
        conic: F32 = np.stack([cov[:, 2], -cov[:, 1], cov[:, 0]], axis=1)
        conic *= (f32(1) / det)[:, None]
        radius = _radius(cov, det)
        centre = _centre(splats.mean, camera)
        tiles = touched_tiles(centre, radius[:, None], camera, TILE)
        visible = (p[:, 2] > f32(settings.near)) & (det != 0) & np.isfinite(radius)
        visible &= (tiles[:, 2] > tiles[:, 0]) & (tiles[:, 3] > tiles[:, 1])
        rgb = splat_colour(splats, camera.centre, sh_degree)

    def drawn(a: F32) -> F32:
        a[~visible] = 0
        return a

    tiles[~visible] = 0
    return Projected(
        drawn(centre),
        drawn(p[:, 2].copy()),
        drawn(conic),
        np.where(visible, splats.opacity, f32(0)),
        drawn(rgb),
        np.where(visible, radius, 0).astype(np.int32),
        drawn(cov3d),
        tiles,
    )


def covariance(scale: F32, quat_wxyz: F32) -> F32:
    """Sigma = R S S R^T, [N, 6]. R comes from the quaternion as it is: zero gives the identity."""
    w, x, y, z = quat_wxyz.T
    r = (
        (1 - f32(2) * (y * y + z * z), f32(2) * (x * y - w * z), f32(2) * (x * z + w * y)),
        (f32(2) * (x * y + w * z), 1 - f32(2) * (x * x + z * z), f32(2) * (y * z - w * x)),
        (f32(2) * (x * z - w * y), f32(2) * (y * z + w * x), 1 - f32(2) * (x * x + y * y)),
    )
    m = [[r[i][k] * scale[:, k] for k in range(3)] for i in range(3)]

    def entry(i: int, j: int) -> npt.NDArray[np.float32]:
        result: F32 = m[i][0] * m[j][0] + m[i][1] * m[j][1] + m[i][2] * m[j][2]
        return result

    return np.stack([entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)], axis=1)


def projected_covariance(p: F32, cov3d: F32, camera: Camera, low_pass: float) -> F32:
    """J W Sigma W^T J^T plus the low-pass, [N, 3] xx, xy, yy; p [N, 3] in camera space."""
    tan_x, tan_y = f32(camera.tan_half_fov_x), f32(camera.tan_half_fov_y)
    focal_x, focal_y = f32(camera.width) / (f32(2) * tan_x), f32(camera.height) / (f32(2) * tan_y)
    limit_x, limit_y = f32(constants()["frustum_clamp"]) * tan_x, f32(constants()["frustum_clamp"]) * tan_y
    z = p[:, 2]
    x = np.minimum(limit_x, np.maximum(-limit_x, p[:, 0] / z)) * z
    y = np.minimum(limit_y, np.maximum(-limit_y, p[:, 1] / z)) * z
    w = camera.camera_from_world[:3, :3]
    j00, j02 = focal_x / z, -(focal_x * x) / (z * z)
    j11, j12 = focal_y / z, -(focal_y * y) / (z * z)
    t0 = [w[0, k] * j00 + w[2, k] * j02 for k in range(3)]
    t1 = [w[1, k] * j11 + w[2, k] * j12 for k in range(3)]
    s = cov3d.T
    full = ((s[0], s[1], s[2]), (s[1], s[3], s[4]), (s[2], s[4], s[5]))

    def form(a: list[F32], b: list[F32]) -> F32:
        left = [a[0] * full[0][k] + a[1] * full[1][k] + a[2] * full[2][k] for k in range(3)]
        result: F32 = left[0] * b[0] + left[1] * b[1] + left[2] * b[2]
        return result

    return np.stack([form(t0, t0) + f32(low_pass), form(t1, t0), form(t1, t1) + f32(low_pass)], axis=1)


def touched_tiles(centre: F32, extent: F32, camera: Camera, tile: int) -> I32:
    """Rectangle [N, 4] (x0, y0, x1, y1) of tiles of `tile` pixels: centre +- extent, clamped to the image."""
    grid = np.array([-(-camera.width // tile), -(-camera.height // tile)])
    # int() of a float beyond int32 is undefined; such a rectangle is cut at the image's border anyway.
    low = np.clip((centre - extent) / f32(tile), -1e6, 1e6)
    high = np.clip(((centre + extent) + f32(tile) - f32(1)) / f32(tile), -1e6, 1e6)
    corners = np.nan_to_num(np.concatenate([low, high], axis=1)).astype(np.int32)
    result: I32 = np.clip(corners, 0, np.concatenate([grid, grid])).astype(np.int32)
    return result


def sh_colour(sh: F32, direction: F32, degree: int) -> F32:
    """sum_k Y_k(direction) sh_k + 0.5, [N, 3], not clamped; direction [N, 3] of unit length."""
    c = {name: [f32(v) for v in constants()[name]] for name in ("sh_c0", "sh_c1", "sh_c2", "sh_c3")}
    colour = c["sh_c0"][0] * sh[:, 0]
    x, y, z = (direction[:, i, None] for i in range(3))
    if degree > 0:
        colour = (
            colour
            + c["sh_c1"][0] * y * sh[:, 1]
            + c["sh_c1"][1] * z * sh[:, 2]
            + c["sh_c1"][2] * x * sh[:, 3]
        )
    if degree > 1:
        xx, yy, zz, xy, yz, xz = x * x, y * y, z * z, x * y, y * z, x * z
        terms = (xy, yz, f32(2) * zz - xx - yy, xz, xx - yy)
        for k, (factor, term) in enumerate(zip(c["sh_c2"], terms, strict=True)):
            colour = colour + factor * term * sh[:, 4 + k]
    if degree > 2:
        four = f32(4) * zz - xx - yy
        cubic = (
            (y, f32(3) * xx - yy),
            (xy, z),
            (y, four),
            (z, f32(2) * zz - f32(3) * xx - f32(3) * yy),
            (x, four),
            (z, xx - yy),
            (x, xx - f32(3) * yy),
        )
        for k, (factor, (a, b)) in enumerate(zip(c["sh_c3"], cubic, strict=True)):
            colour = colour + factor * a * b * sh[:, 9 + k]
    result: F32 = colour + f32(0.5)
    return result


def splat_colour(splats: Splats, eye: F32, degree: int) -> F32:
    """Display-referred colour [N, 3] of each splat seen from `eye` [3], clamped below at 0 and not above."""
    return np.maximum(sh_colour(splats.sh, colour_directions(splats, eye), degree), f32(0))


def colour_directions(splats: Splats, eye: F32) -> F32:
    """Unit vectors [N, 3] from `eye` [3] to each splat, in the frame of its spherical harmonics."""
    direction = splats.mean - eye
    length = np.sqrt(direction[:, 0] ** 2 + direction[:, 1] ** 2 + direction[:, 2] ** 2)
    direction = direction / length[:, None]
    if splats.sh_rotation is not None:
        direction = np.einsum("nji,nj->ni", splats.sh_rotation, direction)
    result: F32 = direction
    return result


def _affine(m: F32, p: F32) -> F32:
    columns = [m[i, 0] * p[:, 0] + m[i, 1] * p[:, 1] + m[i, 2] * p[:, 2] + m[i, 3] for i in range(3)]
    return np.stack(columns, axis=1)


def _centre(mean: F32, camera: Camera) -> F32:
    m = camera.clip_from_world
    x, y, w = (
        m[i, 0] * mean[:, 0] + m[i, 1] * mean[:, 1] + m[i, 2] * mean[:, 2] + m[i, 3] for i in (0, 1, 3)
    )
    reciprocal = f32(1) / (w + f32(constants()["homogeneous_epsilon"]))
    ndc = np.stack([x * reciprocal, y * reciprocal], axis=1).astype(np.float64)
    size = np.array([camera.width, camera.height], np.float64)
    centre: F32 = (((ndc + 1.0) * size - 1.0) * 0.5).astype(np.float32)
    return centre


def _radius(cov: F32, det: F32) -> F32:
    mid = f32(0.5) * (cov[:, 0] + cov[:, 2])
    root = np.sqrt(np.maximum(f32(constants()["eigenvalue_floor"]), mid * mid - det))
    larger = np.maximum(mid + root, mid - root)
    radius: F32 = np.ceil(f32(constants()["radius_sigmas"]) * np.sqrt(larger))
    return radius
