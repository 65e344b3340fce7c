"""How unevenly a surface moved: a term that keeps fits of ASM faces from tears and folds."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

LEAST_EDGE = 5e-4  # metres; a shorter edge counts as this long


@dataclass(frozen=True)
class Edges:
    """The E edges of a mesh at the start."""

    ends: Tensor  # i64 [2, E] vertices
    length: Tensor  # [E] metres, at least LEAST_EDGE
    vertices: Tensor  # [V, 3] metres

    @staticmethod
    def of(vertices: Tensor, triangles: Tensor) -> Edges:
        """The edges of a mesh [V, 3], [F, 3]."""
        both = torch.cat([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]).sort(dim=1)[0]
        ends = torch.unique(both, dim=0).T.contiguous()
        length = (vertices[ends[0]] - vertices[ends[1]]).norm(dim=1)
        return Edges(ends, length.clamp_min(LEAST_EDGE), vertices)


def strain_energy(vertices: Tensor, edges: Edges) -> Tensor:
    """How unevenly vertices [V, 3] moved: the mean over edges of (difference of the ends' motion / length) squared.

    Not in the paper. Where mixtures meet sharply, Eq. 19 lets neighbouring bones tear the surface into scales.
    """
    way = vertices - edges.vertices
    apart = way.index_select(0, edges.ends[0]) - way.index_select(0, edges.ends[1])
    return (apart.square().sum(-1) / edges.length.square()).mean()
