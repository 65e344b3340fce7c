"""Numbers of a file in another precision.

What is too large becomes infinite and NaN stays NaN, of whatever bits, without a warning: readers refuse both.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64


@np.errstate(over="ignore", invalid="ignore")
def as_float32(values: npt.NDArray[Any]) -> F32:
    """`values` as float32, of the same shape."""
    return values.astype(np.float32)


@np.errstate(over="ignore", invalid="ignore")
def as_float64(values: npt.NDArray[Any]) -> F64:
    """`values` as float64, of the same shape."""
    return values.astype(np.float64)
