"""The trained embedding of Gaussians in the mesh: SplattingAvatar's {k, u, v, d}, and variants for comparison.

Every rule keeps a triangle and barycentric weights for each Gaussian outside of Adam, and trains a change of them.
Lengths are in training units.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F64
from avatar_trainer.parameters.table import Table
from avatar_trainer.systems.splatting_avatar.phong import PhongSurface, embed
from avatar_trainer.systems.splatting_avatar.walk import walk
from avatar_trainer.tensors import Splats

ROWS = "gaussians"


@dataclass(frozen=True)
class Samples:
    """Places for new Gaussians in the canonical pose."""

    parent: Tensor  # i64 [M] rows of the Gaussians that they were drawn from
    point: Tensor  # [M, 3]
    offset: Tensor  # [M, 3] point minus the parent's mean


class Embedding:
    """Rule `walking`: (u, v) and d are trained, and (u, v) walks over the edges of the mesh (paper 3, Algorithm 1).

    `shift_uv` [N, 2] is the step of (u, v) times the size of the triangle: a length, so that a step of Adam is as far
    on a large triangle as on a small one. It is 0 except between an optimiser's step and `after_step`.
    """

    trained: ClassVar[dict[str, tuple[int, ...]]] = {"shift_uv": (2,), "displacement": ()}

    def __init__(self, surface: PhongSurface, triangle: Tensor, barycentric: Tensor, decay: float) -> None:
        self.surface = surface
        self.triangle = triangle  # i64 [N]
        self.barycentric = barycentric  # f32 [N, 3]
        self.decay = decay
        self.size = torch.from_numpy(triangle_sizes(surface))  # f32 [F]

    def add_to(self, table: Table, learning_rate: float) -> None:
        """The trained tensors, all 0."""
        for name, shape in self.trained.items():
            table.add(name, torch.zeros(len(self.triangle), *shape), learning_rate, ROWS)

    def weights(self, table: Table) -> Tensor:
        """[N, 3] barycentric, differentiable in `shift_uv`."""
        if "shift_uv" not in self.trained:
            return self.barycentric
        uv = table["shift_uv"] / self.size[self.triangle, None]
        return self.barycentric + torch.cat([uv, -uv.sum(1, keepdim=True)], dim=1)

    def displacement(self, table: Table) -> Tensor:
        """[N] along the interpolated normal."""
        return table["displacement"] if "displacement" in self.trained else torch.zeros(len(self.triangle))

    def mean(self, table: Table, splats: Splats, training_per_bundle: float) -> Tensor:
        """[N, 3] metres, the Gaussians' positions; `splats`: the embedding of (u, v) and d on the posed mesh."""
        return splats.mean

    @torch.no_grad()
    def after_step(self, table: Table) -> int:
        """Move (u, v) by its shift, which becomes 0; the number of edges walked over.

        A Gaussian in another triangle has other coordinates: its moments of `shift_uv` and `displacement` become 0.
        """
        uv = table["shift_uv"] / self.size[self.triangle, None]
        start = _exact(self.barycentric)
        walked = walk(self.surface.neighbours, self.triangle.numpy(), start, uv.numpy(), self.decay)
        self.triangle = torch.from_numpy(walked.triangle)
        self.barycentric = as_weights(walked.barycentric)
        table["shift_uv"].zero_()
        crossed = torch.from_numpy(np.flatnonzero(walked.crossings))
        for name in self.trained:
            table.reset(name, crossed)
        return int(walked.crossings.sum())

    def take(self, index: Tensor) -> None:
        """Row m becomes the former row index[m]."""
        self.triangle, self.barycentric = self.triangle[index], self.barycentric[index]

    @torch.no_grad()
    def hang(self, table: Table, rows: slice, samples: Samples) -> None:
        """Embed new Gaussians, copies of their parents so far, at their samples (Eq. 15)."""
        found = embed(
            self.surface,
            samples.point.double().numpy(),
            self.triangle[rows].numpy(),
            _exact(self.barycentric[rows]),
            table["displacement"][rows].detach().numpy(),
        )
        self.triangle[rows] = torch.from_numpy(found.triangle)
        self.barycentric[rows] = as_weights(found.barycentric)
        self._place(table, rows, torch.from_numpy(found.displacement.astype(np.float32)))

    def _place(self, table: Table, rows: slice, displacement: Tensor) -> None:
        table["displacement"][rows] = displacement


class Clamped(Embedding):
    """Rule `clamped`: as `walking`, but (u, v) stays in its triangle (ablation of the paper's appendix C)."""

    @torch.no_grad()
    def after_step(self, table: Table) -> int:
        """Move (u, v) by its shift; negative weights become 0."""
        inside = np.maximum(_exact(self.weights(table)), 0)
        self.barycentric = as_weights(inside / inside.sum(axis=1, keepdims=True))
        table["shift_uv"].zero_()
        return 0


class Released(Embedding):
    """Rule `released`: d alone is trained; (k, u, v) changes only where a Gaussian is split, and its copies keep d."""

    trained: ClassVar[dict[str, tuple[int, ...]]] = {"displacement": ()}

    def after_step(self, table: Table) -> int:
        """Nothing moves."""
        return 0

    def _place(self, table: Table, rows: slice, displacement: Tensor) -> None:
        """The parent's displacement stays."""


class Fixed(Embedding):
    """Rule `fixed`: a shift in space is trained, turned by the mesh, and (k, u, v) stays (paper 4.3, Fig. 7).

    No embedding {k, u, v, d} represents such a Gaussian, so it cannot be written in the released layout.
    """

    trained: ClassVar[dict[str, tuple[int, ...]]] = {"shift_xyz": (3,)}

    def mean(self, table: Table, splats: Splats, training_per_bundle: float) -> Tensor:
        """The point of the mesh and the shift, which turns with the mesh."""
        shift = table["shift_xyz"] / training_per_bundle
        assert splats.sh_rotation is not None
        return splats.mean + (splats.sh_rotation @ shift[:, :, None])[:, :, 0]

    def after_step(self, table: Table) -> int:
        """Nothing moves."""
        return 0

    @torch.no_grad()
    def hang(self, table: Table, rows: slice, samples: Samples) -> None:
        """The shift leads to the sample."""
        table["shift_xyz"][rows] += samples.offset


EMBEDDINGS: dict[str, type[Embedding]] = {
    "walking": Embedding,
    "clamped": Clamped,
    "fixed": Fixed,
    "released": Released,
}


def as_weights(barycentric: F64) -> Tensor:
    """[N, 3] float32: u, v and 1 - u - v, as the released code stores them."""
    uv = torch.from_numpy(barycentric[:, :2].astype(np.float32))
    return torch.cat([uv, 1 - uv.sum(1, keepdim=True)], dim=1)


def _exact(barycentric: Tensor) -> F64:
    """[N, 3] the weights that u and v stand for; the third as stored is rounded."""
    uv = barycentric[:, :2].double().numpy()
    return np.column_stack([uv, 1 - uv.sum(axis=1)])


def triangle_sizes(surface: PhongSurface) -> Any:
    """f32 [F] the side of a square of twice the area; a triangle without area gets the smallest float, not 0."""
    corner = surface.vertices[surface.triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    return np.sqrt(np.maximum(np.linalg.norm(across, axis=1), 1e-12)).astype(np.float32)
