"""Small integers that stand for floats, in memory: what a pack stores and kernels read.

SPEC.md section 18 defines the four kinds. Decoding here is float32 throughout, as in packed.hlsli.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, U16

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Codes:
    """Integers [n, C] of uint8 or uint16 and what they mean; no channels are stored if `codes` is None.

    kind `linear`: low + step * code, `scale` [C, 2]. `signed`: step * (code - half), `scale` [columns, C].
    `weight`: step * code, `scale` [1]. `table`: `scale` [T] holds the value of each code.
    """

    kind: str
    codes: Array | None
    scale: F32

    @property
    def width(self) -> int:
        """Bits of an element; 0 if nothing is stored."""
        return 0 if self.codes is None else 8 * self.codes.itemsize


def decode(codes: Codes, rows: int, channels: int, column: U16 | None = None) -> F32:
    """The floats [rows, channels]; `column` [rows] is for kind signed."""
    if codes.codes is None:
        if codes.kind == "linear":
            return np.tile(codes.scale[:, 0], (rows, 1))
        return np.zeros((rows, channels), np.float32)
    value = codes.codes.astype(np.float32)
    if codes.kind == "linear":
        value *= codes.scale[:, 1]
        value += codes.scale[:, 0]
    elif codes.kind == "signed":
        assert column is not None
        value -= np.float32(1 << (codes.width - 1))
        value *= codes.scale[column]
    elif codes.kind == "weight":
        value *= codes.scale[0]
    else:
        value = codes.scale[codes.codes]
    return value


Coded = Mapping[str, Codes]  # by the path of the array in an Avatar, such as "gaussians.mean"
NOTHING_CODED: Coded = {}
