"""Density control of Gaussian Blendshapes: differences, masks, weights and fields follow their Gaussian."""

from __future__ import annotations

import math

import torch
from torch import Generator, Tensor

from avatar_runtime import AvatarError
from avatar_trainer.parameters.densify import SPLIT_COPIES, SPLIT_SHRINK, Plan
from avatar_trainer.parameters.table import Table
from avatar_trainer.stages.rotation import matrix_from_quat
from avatar_trainer.systems.gaussian_blendshapes.rows import Rows
from avatar_trainer.systems.gaussian_blendshapes.table import DELTA, GAUSSIAN

NONE_LEFT = (
    "no Gaussian is left: all have become transparent or too large; lower density.min_opacity, raise "
    "density.max_world_scale or set density.densify_until=0"
)


def grow(plan: Plan, rows: Rows, table: Table, generator: Generator) -> Rows:
    """The rows after `plan`; the table's tensors are rearranged in the same way.

    A clone equals its Gaussian. The two that replace a split one are smaller and drawn from its distribution; they keep
    its init terms, learned differences, mask and skin weights (face_gs_model.py: never computed again). Raises
    AvatarError if none is left.
    """
    index, fresh = plan.rows()
    if not len(index):
        raise AvatarError(NONE_LEFT)
    parts = torch.zeros(len(index), dtype=torch.bool)
    parts[len(index) - SPLIT_COPIES * len(plan.split) :] = True
    order = torch.argsort(rows.group[index], stable=True)  # the draw order of the groups stays
    index, fresh, parts = index[order], fresh[order], parts[order]
    grown, entry = rows.take(index)
    table.take(GAUSSIAN, index, fresh)
    if DELTA in table_sets(table):
        table.take(DELTA, entry, torch.repeat_interleave(fresh, grown.learned.row_ptr.diff()))
    _spread(table, torch.nonzero(parts).squeeze(1), generator)
    return grown


def table_sets(table: Table) -> set[str]:
    """The row sets of a table."""
    return {table.rows(name) for name in table}


def _spread(table: Table, parts: Tensor, generator: Generator) -> None:
    """Move the parts of split Gaussians apart, and shrink them."""
    mean, log_scale, quat = (table[name] for name in ("mean", "log_scale", "quat_wxyz"))
    with torch.no_grad():
        offset = torch.randn(len(parts), 3, generator=generator) * log_scale[parts].exp()
        turn = matrix_from_quat(torch.nn.functional.normalize(quat[parts], dim=1))
        mean[parts] += (turn @ offset[:, :, None])[:, :, 0]
        log_scale[parts] -= math.log(SPLIT_SHRINK)
