"""PLY files as trainers write them: one element `vertex` of float properties, binary, little-endian."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def splat_columns(
    mean: Array, dc: Array, opacity: Array, log_scale: Array, quat_wxyz: Array, rest: Array | None = None
) -> dict[str, Array]:
    """The columns of graphdeco's layout; normals are 0, `rest` [N, R] is none of SH degree 0."""
    empty = np.zeros((len(mean), 0))
    parts = {"f_dc_": dc, "f_rest_": empty if rest is None else rest}
    columns = dict(zip("xyz", mean.T, strict=True)) | {f"n{axis}": np.zeros(len(mean)) for axis in "xyz"}
    columns |= {f"{name}{k}": column for name, part in parts.items() for k, column in enumerate(part.T)}
    columns["opacity"] = opacity
    last = {"scale_": log_scale, "rot_": quat_wxyz}
    return columns | {f"{name}{k}": column for name, part in last.items() for k, column in enumerate(part.T)}


def ply_bytes(columns: Mapping[str, Array]) -> bytes:
    """A PLY of one property a column [N], stored as float32 in the order given."""
    count = len(next(iter(columns.values())))
    rows = np.zeros(count, [(name, "<f4") for name in columns])
    for name, values in columns.items():
        rows[name] = values
    header = ["ply", "format binary_little_endian 1.0", f"element vertex {count}"]
    header += [*(f"property float {name}" for name in columns), "end_header", ""]
    return "\n".join(header).encode("ascii") + rows.tobytes()
