"""The losses of training, and the measures of its images. Images are [H, W, 3], display-referred, 0..1."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import torch
from torch import Tensor

from avatar_trainer.kernels.ssim import ssim_cpu

WINDOW, SIGMA = 11, 1.5  # of SSIM, pixels
C1, C2 = 0.01**2, 0.03**2


def l1(a: Tensor, b: Tensor) -> Tensor:
    """Mean absolute difference."""
    return (a - b).abs().mean()


def ssim(a: Tensor, b: Tensor) -> Tensor:
    """Structural similarity of two images, 1 for equal ones; differentiable in both.

    Mean over channels and pixels; Gaussian window of 11 pixels, sigma 1.5, zeros beyond the border, data range 1, as
    the trainers of the 3DGS family measure it (Wang et al. 2004, Eq. 13). Uses `ssim_cpu` if that applies.
    """
    by_kernel = all(image.dtype == torch.float32 and image.device.type == "cpu" for image in (a, b))
    return ssim_cpu(a, b) if by_kernel and not b.requires_grad else ssim_definition(a, b)


def ssim_definition(a: Tensor, b: Tensor) -> Tensor:
    """SSIM in plain algebra: slow, for any floating type and device."""
    x, y = a.permute(2, 0, 1), b.permute(2, 0, 1)
    mean_x, mean_y, xx, yy, xy = _blurred(torch.stack([x, y, x * x, y * y, x * y])).unbind(0)
    var_x, var_y, covariance = xx - mean_x**2, yy - mean_y**2, xy - mean_x * mean_y
    above = (2 * mean_x * mean_y + C1) * (2 * covariance + C2)
    below = (mean_x**2 + mean_y**2 + C1) * (var_x + var_y + C2)
    return (above / below).mean()


def dssim_loss(a: Tensor, b: Tensor) -> Tensor:
    """1 - SSIM (Gaussian Blendshapes Eq. 3 and 3DGS call this D-SSIM, without the half)."""
    return 1 - ssim(a, b)


def psnr_db(a: Tensor, b: Tensor) -> float:
    """Peak signal to noise ratio, peak 1; infinite for equal images."""
    return float(-10 * torch.log10((a.double() - b.double()).square().mean()))


def alpha_loss(alpha: Tensor, mask: Tensor) -> Tensor:
    """Mean squared difference of the accumulated opacity and the head's mask, [H, W] each.

    Gaussian Blendshapes Eq. 4; its norm is read as the mean square, which does not grow with the image.
    """
    return (alpha - mask).square().mean()


@dataclass(frozen=True)
class Cylinder:
    """A capped cylinder, mesh space."""

    centre: Tensor  # [3]
    axis: Tensor  # [3] unit
    radius: float
    half_length: float


def mouth_volume_loss(mean: Tensor, cylinder: Cylinder) -> Tensor:
    """Mean squared distance of the points [M, 3] from the cylinder, 0 inside (Gaussian Blendshapes Eq. 5)."""
    offset = mean - cylinder.centre
    along = offset @ cylinder.axis
    across = torch.linalg.vector_norm(offset - along[:, None] * cylinder.axis, dim=1)
    outside = torch.stack([across - cylinder.radius, along.abs() - cylinder.half_length], dim=1).clamp_min(0)
    return outside.square().sum(1).mean()


def scaling_loss(scale: Tensor, long: float, thin_ratio: float) -> Tensor:
    """Mean over the Gaussians of the largest of a scale [N, 3] where it exceeds max(long, thin_ratio * smallest).

    SplattingAvatar Eq. 14; `long` in the units of `scale`.
    """
    largest, smallest = scale.max(dim=1).values, scale.min(dim=1).values
    needle = largest > torch.clamp_min(thin_ratio * smallest, long)
    return torch.where(needle, largest, 0).mean()


def lpips_loss(a: Tensor, b: Tensor) -> Tensor:
    """Perceptual distance (Zhang et al. 2018, VGG) of two images, by the optional package `lpips`.

    Raises RuntimeError if it is not installed.
    """
    pair = (2 * image.permute(2, 0, 1)[None] - 1 for image in (a, b))
    distance: Tensor = _lpips()(*pair)
    return distance.mean()


@cache
def _lpips() -> torch.nn.Module:
    try:
        from lpips import LPIPS
    except ImportError as error:
        raise RuntimeError("the LPIPS loss needs the package lpips: pip install lpips") from error
    network: torch.nn.Module = LPIPS(net="vgg", verbose=False).eval().requires_grad_(False)
    return network


def _blurred(planes: Tensor) -> Tensor:
    """[..., H, W] under the window, by columns and then rows, zeros beyond the border."""
    at = torch.arange(WINDOW, dtype=torch.float64) - WINDOW // 2
    weight = torch.exp(-(at**2) / (2 * SIGMA**2))
    weights: list[float] = (weight / weight.sum()).tolist()
    for dim in (-2, -1):
        size, pad = planes.shape[dim], (0, 0) * (-1 - dim) + (WINDOW // 2,) * 2
        padded = torch.nn.functional.pad(planes, pad)
        planes = torch.zeros_like(planes)
        for k, share in enumerate(weights):  # one after the other: eleven images at once are slow
            planes = torch.add(planes, padded.narrow(dim, k, size), alpha=share)
    return planes
