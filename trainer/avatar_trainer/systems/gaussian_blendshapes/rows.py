"""The untrained values of each Gaussian of Gaussian Blendshapes: its group, weights, fields and masks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import torch
from torch import Tensor

from avatar_trainer.parameters import stored

FACE, UPPER, LOWER = range(3)


@dataclass(frozen=True)
class Entries:
    """A sparse pattern by row: row i owns the entries row_ptr[i]:row_ptr[i+1], whose columns are expressions."""

    row_ptr: Tensor  # [N + 1] int64
    column: Tensor  # [E] int64

    @property
    def count(self) -> int:
        """E."""
        return len(self.column)

    def row(self) -> Tensor:
        """[E] int64, the row of each entry."""
        return torch.repeat_interleave(self.row_ptr.diff())

    @staticmethod
    def from_state(state: Any, name: str, rows: int, columns: int) -> Entries:
        """A pattern of `rows` rows, columns below `columns`. ValueError for anything else."""
        row_ptr = stored.rising(state["row_ptr"], f"{name}.row_ptr")
        entries = len(state["column"])
        if len(row_ptr) != rows + 1 or int(row_ptr[0]) != 0 or int(row_ptr[-1]) != entries:
            raise ValueError(f"{name}.row_ptr does not lead through {entries} entries of {rows} rows")
        return Entries(row_ptr, stored.indices(state["column"], f"{name}.column", entries, columns))

    def take(self, index: Tensor) -> tuple[Entries, Tensor]:
        """(the pattern of the rows `index` i64[M], the entries i64[] that they had here)."""
        length = self.row_ptr.diff()[index]
        row_ptr = torch.cat([length.new_zeros(1), length.cumsum(0)])
        first = torch.repeat_interleave(self.row_ptr[index] - row_ptr[:-1], length)
        entry = torch.arange(int(row_ptr[-1])) + first
        return Entries(row_ptr, self.column[entry]), entry


@dataclass(frozen=True)
class Rows:
    """N Gaussians in draw order: face, upper teeth, lower teeth."""

    group: Tensor  # [N] int64: FACE, UPPER or LOWER, rising
    skin_weights: Tensor  # [N, J]; 0 in the mouth, whose groups move as a whole
    corrective: Tensor  # [9 C, N, 3] metres for one unit of each pose feature; [0, N, 3] where there are none
    late: Tensor  # [L, N, 3] metres for one unit of each late morph; likewise
    init: Entries  # where an expression moves the triangle under a face Gaussian
    init_values: Tensor  # [E, 7] metres and quaternion wxyz: Delta G_init of Eq. 2, position and rotation
    learned: Entries  # where Delta G^ of Eq. 2 is learned
    mask: Tensor  # [E'] max(f(d), 0) of Eq. 2

    @property
    def count(self) -> int:
        """N."""
        return len(self.group)

    def of(self, group: int) -> slice:
        """The rows of one group."""
        first, end = torch.searchsorted(self.group, torch.tensor([group, group + 1])).tolist()
        return slice(first, end)

    def take(self, index: Tensor) -> tuple[Rows, Tensor]:
        """(the rows `index` i64[M], in the order of the groups; the learned entries i64[] that they own)."""
        init, from_init = self.init.take(index)
        learned, from_learned = self.learned.take(index)
        taken = Rows(
            group=self.group[index],
            skin_weights=self.skin_weights[index],
            corrective=self.corrective[:, index],
            late=self.late[:, index],
            init=init,
            init_values=self.init_values[from_init],
            learned=learned,
            mask=self.mask[from_learned],
        )
        return taken, from_learned

    def state(self) -> dict[str, Any]:
        """Every tensor by name, patterns as dicts."""
        return {
            name: {**vars(value)} if isinstance(value, Entries) else value
            for name, value in vars(self).items()
        }

    def from_state(self, state: dict[str, Any], expressions: int) -> Rows:
        """The rows of a `state` of the same subject; shares its memory.

        ValueError for what is not rows of this subject, with `expressions` columns.
        """
        group = stored.rising(state["group"], "group")
        n = len(group)
        stored.indices(group, "group", n, int(self.group[-1]) + 1)
        init, learned = (Entries.from_state(state[key], key, n, expressions) for key in ("init", "learned"))
        shapes = {
            "skin_weights": (n, self.skin_weights.shape[1]),
            "corrective": (len(self.corrective), n, 3),
            "late": (len(self.late), n, 3),
            "init_values": (init.count, self.init_values.shape[1]),
            "mask": (learned.count,),
        }
        values = {name: stored.tensor(state[name], name, shape) for name, shape in shapes.items()}
        return Rows(group=group, init=init, learned=learned, **values)
