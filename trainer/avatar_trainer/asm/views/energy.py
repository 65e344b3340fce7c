"""Energies of a face and cameras against images from many sides: ASM appendix D, Eq. 18 to 22.

Pixels have their centres at half integers. Everything is differentiable in vertices and cameras, except for the
visible points and the matches of contour points: `views.sight` finds these, and they are held fixed.
"""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from avatar_trainer.asm.model import Face, rotation_matrices

FLAT = 2.0 / 255  # a smaller deviation of a patch is mostly noise and 8-bit rounding


@dataclass(frozen=True)
class Cameras:
    """N pinhole cameras of one K."""

    rotation: Tensor  # [N, 3, 3] camera from world, as they were found first
    turn: Tensor  # [N, 3] radians, applied after it
    translation: Tensor  # [N, 3] metres
    focal: Tensor  # [2] pixels
    principal: Tensor  # [2] pixels

    def turned(self) -> Tensor:
        """R [N, 3, 3] camera from world."""
        return rotation_matrices(self.turn) @ self.rotation

    def pixels(self, points: Tensor) -> Tensor:
        """Pi [N, P, 2] of world points [P, 3]."""
        return self._projected(points @ self.turned().mT + self.translation[:, None])

    def pixels_in(self, view: Tensor, points: Tensor) -> Tensor:
        """Pi [P, 2] of world points [P, 3], each in its own view [P]."""
        x = (self.turned()[view] @ points[..., None])[..., 0] + self.translation[view]
        return self._projected(x)

    def _projected(self, x: Tensor) -> Tensor:
        return x[..., :2] / x[..., 2:].clamp_min(1e-3) * self.focal + self.principal


def landmark_energy(projected: Tensor, found: Tensor, seen: Tensor) -> Tensor:
    """E_lmk of Eq. 18, pixels squared: summed over the landmarks seen, the mean over views.

    projected and found [N, L, 2], seen bool [N, L].
    """
    away = torch.where(seen[..., None], projected - torch.where(seen[..., None], found, 0.0), 0.0)
    return away.square().sum() / len(seen)


@dataclass(frozen=True)
class Pairs:
    """P pairs of a vertex and a point of a contour."""

    view: Tensor  # i64 [P]
    vertex: Tensor  # i64 [P]
    point: Tensor  # [P, 2] pixels
    weight: Tensor  # [P] 1 over the number of pairs of its direction in its view


def edge_energy(cameras: Cameras, vertices: Tensor, pairs: Pairs) -> Tensor:
    """E_edge of Eq. 20, pixels squared: the chamfer distance of pairs held fixed, the mean over views.

    vertices [V, 3], all of the mesh.
    """
    away = cameras.pixels_in(pairs.view, vertices[pairs.vertex]) - pairs.point
    return (pairs.weight * away.square().sum(-1)).sum() / len(cameras.turn)


@dataclass(frozen=True)
class Texels:
    """The X texels of a map of the uv plane that lie on the mesh."""

    size: int  # texels along an edge of the square map
    row: Tensor  # i64 [X] in the flat map
    corner: Tensor  # i64 [X, 3] vertices
    barycentric: Tensor  # [X, 3]

    def points(self, vertices: Tensor) -> Tensor:
        """Their positions [X, 3] on the mesh."""
        return (self.barycentric[..., None] * vertices[self.corner]).sum(-2)


def unwrapped(images: Tensor, pixels: Tensor, texels: Texels) -> Tensor:
    """U [N, M, M] of Eq. 21: grey values of `images` [N, H, W] at `pixels` [N, X, 2], bilinear, laid out in uv.

    The paper's vertices are as dense as the texels here, so texels are sampled directly.
    """
    height, width = images.shape[1:]
    scale = pixels.new_tensor([2 / width, 2 / height])
    grey = torch.nn.functional.grid_sample(
        images[:, None], (pixels * scale - 1)[:, None], padding_mode="border", align_corners=False
    )
    flat = grey.new_zeros(len(images), texels.size**2)
    return flat.index_copy(1, texels.row, grey[:, 0, 0]).reshape(-1, texels.size, texels.size)


def photometric_energy(maps: Tensor, valid: Tensor, texels: int) -> Tensor:
    """E_pc of Eq. 21 and 22 with 1 - NCC in place of NCC, since only that has a meaningful minimum.

    maps [N, M, M] grey; valid [N, M - 2, M - 2] 1 where the 3 x 3 texels about an inner texel are all seen; `texels`:
    X, the number the sum is divided by. All N (N - 1) / 2 pairs of views at once: with normalised patches p, twice the
    sum of p_i . p_j over pairs is |sum p|^2 - sum |p|^2.
    """
    n, m = len(maps), maps.shape[-1]
    if n < 2:
        raise ValueError("photometric consistency needs two views")
    patch = torch.stack([maps[:, y : m - 2 + y, x : m - 2 + x] for y in range(3) for x in range(3)])
    patch = patch - patch.mean(0)
    squared = patch.square().sum(0)
    unit = valid * (squared + 9 * FLAT**2).rsqrt()
    together = (patch * unit).sum(1).square().sum() - (squared * unit.square()).sum()
    seen = valid.sum(0)
    pairs = seen.square().sum() - valid.square().sum()
    return (pairs - together) / (n * (n - 1) * texels)


@dataclass(frozen=True)
class Priors:
    """How strongly Eq. 19 holds each part of a face to its start, and in what unit."""

    pose: float = 1.0  # lambda_1
    binding: float = 0.1  # lambda_2 to lambda_5
    metres: float = 0.01  # a translation of this counts as one
    radians: float = 0.1
    log_scale: float = 0.1
    uv: float = 0.02


def prior_energy(face: Face, first: Face, priors: Priors) -> Tensor:
    """E_reg of Eq. 19: tau against rest, the binding against its start, the mean over bones.

    The paper does not state units; here every part is divided by a change that is large for it (`Priors`).
    """
    bones = len(face.zeta)
    pose = (
        (face.translation / priors.metres).square().sum()
        + (face.rotation_vector / priors.radians).square().sum()
        + (face.log_scale / priors.log_scale).square().sum()
    )
    binding = (
        ((face.zeta - first.zeta) / priors.uv).square().sum()
        + ((face.mu - first.mu) / priors.uv).square().sum()
        + (face.pi_logit.softmax(-1) - first.pi_logit.softmax(-1)).square().sum()
        + (face.scale_tril - first.scale_tril).square().sum()
    )
    return (priors.pose * pose + priors.binding * binding) / bones
