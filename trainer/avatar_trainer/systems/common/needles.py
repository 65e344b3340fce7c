"""Gaussians that are long and thin: edges in the images they were trained on, needles in motion and close up."""

from __future__ import annotations

import math

import torch
from torch import Tensor


@torch.no_grad()
def shorten(log_scale: Tensor, longest: float) -> None:
    """The longest axis of each Gaussian, log_scale [N, 3], becomes at most `longest` times its middle one, in place.

    Disks stay as they are. A choice of ours; 0: no limit, as in the papers.
    """
    if longest:
        middle = log_scale.median(dim=1, keepdim=True).values
        torch.minimum(log_scale, middle + math.log(longest), out=log_scale)
