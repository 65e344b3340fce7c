"""Runs of rows whose buffers are within the binding limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import U32
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.model import Run

BUFFER_LIMIT = 128 << 20  # bytes of one binding that WebGPU and most phones grant
MOST_GROUPS, GROUP = 65535, 64  # thread groups of one dispatch, threads of one group
MOST_ROWS = MOST_GROUPS * GROUP


@dataclass(frozen=True)
class Cost:
    """Bytes of one buffer over a run: `fixed` + `row` a row + bytes an entry of each sparse part."""

    row: int
    fixed: int = 0
    entries: tuple[tuple[U32, int], ...] = ()  # (row_ptr of all rows, bytes an entry)

    def up_to(self, rows: int) -> npt.NDArray[np.int64]:
        """[rows + 1] bytes that the rows before each row take, without `fixed`."""
        total = self.row * np.arange(rows + 1, dtype=np.int64)
        for row_ptr, size in self.entries:
            total = total + size * row_ptr.astype(np.int64)
        return total


def runs(what: str, rows: int, costs: Sequence[Cost], limit: int) -> tuple[Run, ...]:
    """The fewest runs of `rows` rows in which no buffer of `costs` is larger than `limit` bytes.

    Raises AvatarError if one row alone is larger.
    """
    sizes = [(cost.up_to(rows), cost.fixed) for cost in costs]
    found: list[Run] = []
    first = 0
    while first < rows:
        ends = [int(np.searchsorted(upto, upto[first] + limit - fixed, "right")) - 1 for upto, fixed in sizes]
        end = min(*ends, first + MOST_ROWS)
        if end <= first:
            need = max(int(upto[first + 1] - upto[first]) + fixed for upto, fixed in sizes)
            raise too_large(f"{what} {first}", need, limit)
        found.append(Run(first, end - first))
        first = end
    return tuple(found)


def too_large(what: str, size: int, limit: int) -> AvatarError:
    """The error for a buffer that cannot be split."""
    return AvatarError(
        f"{what} takes {size} bytes in one buffer, the limit is {limit}; raise buffer_limit, or prune the avatar",
        field="backend gl",
    )
