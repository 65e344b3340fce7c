"""Checks of a checkpoint's values before they are used, since kernels trust their indices.

Each function returns the value, or raises ValueError that names it.
"""

from __future__ import annotations

import math
from typing import Any

import torch
from torch import Tensor


def tensor(value: Any, name: str, shape: tuple[int, ...], dtype: torch.dtype = torch.float32) -> Tensor:
    """A tensor of this shape and type; finite."""
    if not isinstance(value, Tensor) or value.dtype != dtype or value.shape != shape:
        raise ValueError(f"{name} is {_kind(value)}, not {dtype}{shape}")
    if not torch.isfinite(value).all():
        raise ValueError(f"{name} has values that are not finite")
    return value


def indices(value: Any, name: str, count: int, end: int) -> Tensor:
    """An int64 tensor [count] of values 0 <= v < end."""
    tensor(value, name, (count,), torch.int64)
    if count and not 0 <= int(value.min()) <= int(value.max()) < end:
        raise ValueError(
            f"{name} reaches from {int(value.min())} to {int(value.max())}, not within 0..{end - 1}"
        )
    return value  # type: ignore[no-any-return]


def rising(value: Any, name: str) -> Tensor:
    """A non-empty int64 tensor of values that do not decrease."""
    if not isinstance(value, Tensor) or value.dtype != torch.int64 or value.dim() != 1 or not len(value):
        raise ValueError(f"{name} is {_kind(value)}, not a filled {torch.int64} row")
    if (value[1:] < value[:-1]).any():
        raise ValueError(f"{name} falls")
    return value


def whole(value: Any, name: str, most: float = math.inf) -> int:
    """A whole number, 0 or above, at most `most`."""
    if type(value) is not int or not 0 <= value <= most:
        raise ValueError(f"{name} is {str(value)[:40]}, not a whole number of 0..{most}")
    return value


def number(value: Any, name: str) -> float:
    """A finite number, 0 or above."""
    if type(value) not in (int, float) or not 0 <= value < math.inf:
        raise ValueError(f"{name} is {str(value)[:40]}, not a number of 0 or above")
    return float(value)


def _kind(value: Any) -> str:
    return f"{value.dtype}{tuple(value.shape)}" if isinstance(value, Tensor) else f"a {type(value).__name__}"
