"""Stage `sort` on tensors: the order in which splats are composited."""

from __future__ import annotations

import torch
from torch import Tensor

from avatar_trainer.stages.project import Projected


def sort(projected: Projected) -> Tensor:
    """int64 ids of the drawn splats, front to back: by view z, ties by id."""
    drawn = torch.nonzero(projected.radius)[:, 0]
    return drawn[torch.argsort(projected.depth.detach()[drawn], stable=True)]
