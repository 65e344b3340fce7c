"""Checks of one array or one list of names, for everything that checks an avatar."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import SparseRows
from avatar_runtime.io.errors import AvatarError


def check_sparse(
    sparse: SparseRows,
    name: str,
    rows: int,
    columns: int,
    shapes: Mapping[str, tuple[int, ...]],
    rising: bool = True,
) -> None:
    """Raise AvatarError unless `sparse` has `rows`, `columns`, in-range columns and these attributes. `rising`: columns
    rise inside a row."""
    ptr, col = sparse.row_ptr, sparse.column
    expect(ptr.dtype == np.uint32 and ptr.shape == (rows + 1,), f"{name}.row_ptr", f"u32[{rows + 1}]", ptr)
    expect(col.dtype == np.uint16 and col.ndim == 1, f"{name}.column", "u16[E]", col)
    if sparse.columns != columns:
        raise AvatarError(f"has {sparse.columns} columns, expected {columns}", field=name)
    if ptr[0] != 0 or int(ptr[-1]) != len(col) or (ptr[1:] < ptr[:-1]).any():
        raise AvatarError(f"must rise from 0 to the number of entries, {len(col)}", field=f"{name}.row_ptr")
    if len(col):
        if int(col.max()) >= columns:
            entry = int(np.argmax(col >= columns))
            raise AvatarError(
                f"[{entry}] = {int(col[entry])}, but there are {columns} columns", field=f"{name}.column"
            )
        starts = np.zeros(len(col), bool)
        starts[ptr[:-1][ptr[:-1] < len(col)]] = True
        falls = (col[1:] <= col[:-1]) & ~starts[1:]
        if rising and falls.any():
            entry = int(np.argmax(falls)) + 1
            raise AvatarError("must strictly increase inside a row", field=f"{name}.column[{entry}]")
    if set(sparse.values) != set(shapes):
        raise AvatarError(f"has attributes {sorted(sparse.values)}, expected {sorted(shapes)}", field=name)
    for attribute, shape in shapes.items():
        check_f32(f"{name}.{attribute}", sparse.values[attribute], (len(col), *shape))


def expect(ok: bool, name: str, want: str, got: npt.NDArray[Any]) -> None:
    """Raise AvatarError unless `ok`: field `name` is `got`, but `want` (type and shape in words) is expected."""
    if not ok:
        raise AvatarError(f"expected {want}, got {got.dtype}{list(got.shape)}", field=name)


def check_f32(name: str, array: npt.NDArray[Any], shape: Sequence[int]) -> None:
    """Raise AvatarError unless field `name` is float32 of `shape` and all its numbers are finite."""
    expect(array.dtype == np.float32 and array.shape == tuple(shape), name, f"float32{list(shape)}", array)
    # A float64 sum is finite exactly when every float32 is: one pass, no mask of the array's size.
    with np.errstate(invalid="ignore"):  # inf - inf
        total = np.sum(array, dtype=np.float64)
    if not np.isfinite(total):
        row = np.unravel_index(int(np.argmax(~np.isfinite(array))), array.shape)
        raise AvatarError(f"is {array[row]} at row {int(row[0])}; finite numbers are needed", field=name)


def check_names(what: str, names: tuple[str, ...]) -> None:
    """Raise AvatarError for an empty or duplicate name in field `what`."""
    seen: set[str] = set()
    for name in names:
        if not name or name in seen:
            raise AvatarError(f"{name!r} is empty or a duplicate", field=what)
        seen.add(name)
