"""PLY files as trainers write them: one element `vertex` of float properties, binary, little-endian."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt


def ply_bytes(columns: Mapping[str, npt.NDArray[Any]]) -> bytes:
    """A PLY of one property a column [N], stored as float32 in the order given."""
    count = len(next(iter(columns.values())))
    rows = np.zeros(count, [(name, "<f4") for name in columns])
    for name, values in columns.items():
        rows[name] = values
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
    header += [*(f"property float {name}" for name in columns), "end_header", ""]
    return "\n".join(header).encode("ascii") + rows.tobytes()
