"""Stage `project` on tensors: EWA projection and SH colour, in the runtime's order of operations.

Twin of `avatar_runtime.stages.project`, in the type of its tensors. Splats that are not drawn are left out, so
no gradient is divided by zero.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F32, Camera, RasterSettings
from avatar_runtime.stages import project as runtime
from avatar_schema import constants
from avatar_trainer.tensors import Splats


@dataclass(frozen=True)
class Projected:
    """The screen-space splats; everything is 0 where `radius` is 0 (not drawn)."""

    centre: Tensor  # [N, 2] pixels, pixel centres at integers
    depth: Tensor  # [N] view z
    conic: Tensor  # [N, 3] inverse 2D covariance xx, xy, yy
    opacity: Tensor  # [N]
    rgb: Tensor  # [N, 3] display-referred, >= 0
    radius: Tensor  # [N] int32 pixels, 3 standard deviations
    tiles: Tensor  # [N, 4] int32 touched tiles: x0, y0, x1, y1 (ends excluded)


def project(splats: Splats, camera: Camera, settings: RasterSettings, sh_degree: int) -> Projected:
    """Screen-space splats of `splats` seen by `camera`; differentiable except for radius and tiles."""
    with torch.no_grad():
        _, depth, _, radius, tiles, visible = _geometry(splats, camera, settings)
        tiles[~visible] = 0
        radius = torch.where(visible, radius, 0).to(torch.int32)
    index = torch.nonzero(visible)[:, 0]
    drawn = _rows(splats, index)
    centre, depth, conic, *_ = _geometry(drawn, camera, settings)
    rgb = splat_colour(drawn, camera, sh_degree)

    def spread(values: Tensor) -> Tensor:
        return values.new_zeros((len(radius), *values.shape[1:])).index_copy(0, index, values)

    return Projected(
        spread(centre), spread(depth), spread(conic), spread(drawn.opacity), spread(rgb), radius, tiles
    )


def _rows(splats: Splats, index: Tensor) -> Splats:
    rotation = splats.sh_rotation
    return Splats(
        splats.mean[index],
        splats.scale[index],
        splats.quat_wxyz[index],
        splats.opacity[index],
        splats.sh[index],
        None if rotation is None else rotation[index],
    )


def _geometry(
    splats: Splats, camera: Camera, settings: RasterSettings
) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor, Tensor]:
    """(centre, depth, conic, radius, tiles, whether drawn) of every splat."""
    p = affine(like(camera.camera_from_world, splats.mean), splats.mean)
    cov = projected_covariance(p, covariance(splats.scale, splats.quat_wxyz), camera, settings.low_pass)
    det = cov[:, 0] * cov[:, 2] - cov[:, 1] * cov[:, 1]
    conic = torch.stack([cov[:, 2], -cov[:, 1], cov[:, 0]], dim=1) * (1 / det)[:, None]
    radius, centre = _radius(cov.detach(), det.detach()), screen_centre(splats.mean, camera)
    with np.errstate(all="ignore"):
        touched = runtime.touched_tiles(
            centre.detach().numpy(), radius[:, None].numpy(), camera, runtime.TILE
        )
    tiles = torch.from_numpy(touched)
    visible = (p[:, 2] > constant(settings.near)) & (det != 0) & torch.isfinite(radius)
    visible &= (tiles[:, 2] > tiles[:, 0]) & (tiles[:, 3] > tiles[:, 1])
    return centre, p[:, 2], conic, radius, tiles, visible


def covariance(scale: Tensor, quat_wxyz: Tensor) -> Tensor:
    """Sigma = R S S R^T, [N, 6] xx xy xz yy yz zz. R comes from the quaternion as it is: zero gives the identity."""
    w, x, y, z = quat_wxyz.unbind(1)
    r = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    m = [[r[i][k] * scale[:, k] for k in range(3)] for i in range(3)]

    def entry(i: int, j: int) -> Tensor:
        return m[i][0] * m[j][0] + m[i][1] * m[j][1] + m[i][2] * m[j][2]

    return torch.stack([entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)], dim=1)


def projected_covariance(p: Tensor, cov3d: Tensor, camera: Camera, low_pass: float) -> Tensor:
    """J W Sigma W^T J^T plus the low-pass, [N, 3] xx, xy, yy; p [N, 3] in camera space."""
    tan_x, tan_y = constant(camera.tan_half_fov_x), constant(camera.tan_half_fov_y)
    # Tensors, because torch divides by a number by multiplying with the reciprocal.
    focal_x, focal_y = (
        p.new_tensor(constant(size / (2 * tan)))
        for size, tan in ((camera.width, tan_x), (camera.height, tan_y))
    )
    clamp = constant(constants()["frustum_clamp"])
    limit_x, limit_y = constant(clamp * tan_x), constant(clamp * tan_y)
    z = p[:, 2]
    x = torch.clamp(p[:, 0] / z, -limit_x, limit_x) * z
    y = torch.clamp(p[:, 1] / z, -limit_y, limit_y) * z
    w = like(camera.camera_from_world, p)
    j00, j02 = focal_x / z, -(focal_x * x) / (z * z)
    j11, j12 = focal_y / z, -(focal_y * y) / (z * z)
    t0 = [w[0, k] * j00 + w[2, k] * j02 for k in range(3)]
    t1 = [w[1, k] * j11 + w[2, k] * j12 for k in range(3)]
    s = cov3d.unbind(1)
    full = ((s[0], s[1], s[2]), (s[1], s[3], s[4]), (s[2], s[4], s[5]))

    def form(a: list[Tensor], b: list[Tensor]) -> Tensor:
        left = [a[0] * full[0][k] + a[1] * full[1][k] + a[2] * full[2][k] for k in range(3)]
        return left[0] * b[0] + left[1] * b[1] + left[2] * b[2]

    added = constant(low_pass)
    return torch.stack([form(t0, t0) + added, form(t1, t0), form(t1, t1) + added], dim=1)


def sh_colour(sh: Tensor, direction: Tensor, degree: int) -> Tensor:
    """sum_k Y_k(direction) sh_k + 0.5, [N, 3], not clamped; direction [N, 3] of unit length."""
    c = {name: [constant(v) for v in constants()[name]] for name in ("sh_c0", "sh_c1", "sh_c2", "sh_c3")}
    colour = c["sh_c0"][0] * sh[:, 0]
    x, y, z = (direction[:, i, None] for i in range(3))
    if degree > 0:
        for k, (factor, axis) in enumerate(zip(c["sh_c1"], (y, z, x), strict=True)):
            colour = colour + factor * axis * sh[:, 1 + k]
    if degree > 1:
        xx, yy, zz, xy, yz, xz = x * x, y * y, z * z, x * y, y * z, x * z
        terms = (xy, yz, 2 * zz - xx - yy, xz, xx - yy)
        for k, (factor, term) in enumerate(zip(c["sh_c2"], terms, strict=True)):
            colour = colour + factor * term * sh[:, 4 + k]
    if degree > 2:
        four = 4 * zz - xx - yy
        cubic = (
            (y, 3 * xx - yy),
            (xy, z),
            (y, four),
            (z, 2 * zz - 3 * xx - 3 * yy),
            (x, four),
            (z, xx - yy),
            (x, xx - 3 * yy),
        )
        for k, (factor, (a, b)) in enumerate(zip(c["sh_c3"], cubic, strict=True)):
            colour = colour + factor * a * b * sh[:, 9 + k]
    return colour + 0.5


def splat_colour(splats: Splats, camera: Camera, degree: int) -> Tensor:
    """Display-referred colour [N, 3] of each splat seen by `camera`, clamped below at 0 and not above."""
    direction = splats.mean - like(camera.centre, splats.mean)
    direction = direction / torch.sqrt((direction * direction).sum(dim=1, keepdim=True))
    if splats.sh_rotation is not None and degree > 0:
        direction = torch.einsum("nji,nj->ni", splats.sh_rotation, direction)
    return torch.clamp(sh_colour(splats.sh, direction, degree), min=0)


def affine(m: Tensor, p: Tensor) -> Tensor:
    """The first three rows of m [4, 4] applied to the points p [N, 3], in the rasteriser's order."""
    columns = [m[i, 0] * p[:, 0] + m[i, 1] * p[:, 1] + m[i, 2] * p[:, 2] + m[i, 3] for i in range(3)]
    return torch.stack(columns, dim=1)


def screen_centre(mean: Tensor, camera: Camera) -> Tensor:
    """Where world points [N, 3] lie on the screen: [N, 2] pixels, pixel centres at integers."""
    m = like(camera.clip_from_world, mean)
    x, y, w = (
        m[i, 0] * mean[:, 0] + m[i, 1] * mean[:, 1] + m[i, 2] * mean[:, 2] + m[i, 3] for i in (0, 1, 3)
    )
    reciprocal = 1 / (w + constant(constants()["homogeneous_epsilon"]))
    ndc = torch.stack([x * reciprocal, y * reciprocal], dim=1).double()
    size = torch.tensor([camera.width, camera.height], dtype=torch.float64)
    return (((ndc + 1.0) * size - 1.0) * 0.5).to(mean.dtype)


def _radius(cov: Tensor, det: Tensor) -> Tensor:
    mid = 0.5 * (cov[:, 0] + cov[:, 2])
    root = torch.sqrt(torch.clamp(mid * mid - det, min=constant(constants()["eigenvalue_floor"])))
    larger = torch.maximum(mid + root, mid - root)
    return torch.ceil(constants()["radius_sigmas"] * torch.sqrt(larger))


def constant(value: float) -> float:
    """The float32 nearest to `value`, which the rasteriser has, whatever the type of the computation."""
    return float(np.float32(value))


def like(array: F32, tensor: Tensor) -> Tensor:
    """The array as a tensor of the other's type."""
    return torch.tensor(array).to(tensor)
