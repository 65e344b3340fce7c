"""Dense arrays to SparseRows, at once or streamed by blocks of rows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import Blendshapes, SparseRows

Array = npt.NDArray[Any]
MAX_COLUMNS = 65536  # columns are u16


def no_shifts(rows: int, columns: int = 0, of: str = "position") -> SparseRows:
    """No shift of `rows` vertices, or `of` "mean" of Gaussians."""
    return SparseRows.empty(rows, columns, {of: (3,)})


def no_deltas(gaussians: int, expressions: int = 0, features: int = 0, coefficients: int = 1) -> Blendshapes:
    """Blendshapes that move and colour nothing; SH have so many `coefficients`."""
    colour = {"log_scale": (3,), "opacity_logit": (), "sh": (coefficients, 3)}
    return Blendshapes(
        geometry=SparseRows.empty(gaussians, expressions, {"mean": (3,), "quat_wxyz": (4,)}),
        appearance=SparseRows.empty(gaussians, expressions, colour),
        correctives=no_shifts(gaussians, features, "mean"),
        late_morphs=no_shifts(gaussians, 0, "mean"),
    )


def sparse_rows(values: Mapping[str, Array], thresholds: Mapping[str, float]) -> SparseRows:
    """The SparseRows of dense `values`, attribute -> [R, C, ...].

    An entry is kept if the magnitude of any value of any attribute exceeds that attribute's threshold, or is NaN (which
    checks report later). Values of kept entries are not changed; they are stored as float32.
    """
    rows, columns = next(iter(values.values())).shape[:2]
    builder = SparseRowsBuilder(rows, columns, {name: v.shape[2:] for name, v in values.items()}, thresholds)
    builder.append(values)
    return builder.finish()


class SparseRowsBuilder:
    """Builds SparseRows from blocks of rows, in order; `rows` is the largest number of rows.

    Memory for every entry is reserved at once: pages that no entry touches cost nothing, and nothing is copied twice.
    `finish` returns views of that memory.
    """

    def __init__(
        self, rows: int, columns: int, shapes: Mapping[str, tuple[int, ...]], thresholds: Mapping[str, float]
    ):
        if columns > MAX_COLUMNS:
            raise ValueError(f"{columns} columns; at most {MAX_COLUMNS} are supported")
        if set(shapes) != set(thresholds):
            raise ValueError(f"thresholds for {sorted(thresholds)}, attributes {sorted(shapes)}")
        self.columns, self.thresholds, self.shapes = columns, dict(thresholds), dict(shapes)
        self._row_ptr = np.zeros(rows + 1, np.uint32)
        self._column = np.empty(rows * columns, np.uint16)
        self._values = {
            name: np.empty((rows * columns, *shape), np.float32) for name, shape in shapes.items()
        }
        self._row = 0
        self._entry = 0

    def append(self, values: Mapping[str, Array]) -> None:
        """Add the next rows, attribute -> [B, C, ...]; columns beyond C are empty.

        Raises ValueError for other shapes, more columns or more rows than announced.
        """
        rows, columns = next(iter(values.values())).shape[:2]
        for name, shape in self.shapes.items():
            if values[name].shape != (rows, columns, *shape) or columns > self.columns:
                raise ValueError(f"{name} is {values[name].shape}, expected {(rows, self.columns, *shape)}")
        if self._row + rows >= len(self._row_ptr):
            raise ValueError(f"{self._row + rows} rows; at most {len(self._row_ptr) - 1} were announced")
        keep = np.zeros((rows, columns), bool)
        for name, threshold in self.thresholds.items():
            keep |= exceeds(values[name], threshold)
        first, last = self._entry, self._entry + int(np.count_nonzero(keep))
        ends = first + np.cumsum(np.count_nonzero(keep, axis=1))
        self._row_ptr[self._row + 1 : self._row + rows + 1] = ends
        row, column = np.nonzero(keep)
        self._column[first:last] = column
        for name, target in self._values.items():
            target[first:last] = values[name][row, column]
        self._row, self._entry = self._row + rows, last

    def append_empty(self, rows: int) -> None:
        """Add rows without entries."""
        self.append({name: np.empty((rows, 0, *shape), np.float32) for name, shape in self.shapes.items()})

    def finish(self) -> SparseRows:
        """The rows that were appended."""
        kept = {name: array[: self._entry] for name, array in self._values.items()}
        return SparseRows(self._row_ptr[: self._row + 1], self._column[: self._entry], kept, self.columns)


def exceeds(values: Array, threshold: float) -> npt.NDArray[np.bool_]:
    """[R, C]: whether the magnitude of any value of [R, C, ...] is larger than `threshold`, or NaN."""
    largest = np.abs(values)
    if values.ndim > 2:  # max propagates NaN
        largest = np.max(largest, axis=tuple(range(2, values.ndim)), initial=0)
    result: npt.NDArray[np.bool_] = ~(largest <= threshold)
    return result
