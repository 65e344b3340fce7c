"""Tensors as the arrays that kernels take."""

from __future__ import annotations

from typing import Any

import numpy.typing as npt
import torch
from torch import Tensor


def plain(tensor: Tensor, *shape: int) -> npt.NDArray[Any]:
    """A float32 tensor of the CPU as a contiguous array of that shape; in the same memory if possible.

    Raises ValueError for another type, device or size.
    """
    if tensor.dtype != torch.float32 or tensor.device.type != "cpu":
        raise ValueError(f"the kernels take float32 on the CPU, not {tensor.dtype} on {tensor.device}")
    result: npt.NDArray[Any] = tensor.detach().contiguous().numpy().reshape(shape)
    return result
