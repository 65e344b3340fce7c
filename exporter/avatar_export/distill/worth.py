"""Which entries of an avatar's blendshapes are worth their bytes: those that show most of what they do, by byte."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.distill.measure import Errors
from avatar_runtime.avatar import F32, F64, Avatar, SparseRows

# What a unit of each attribute shows, so that errors of different attributes can be added: 1 mm of a position counts 1.
WORTH = {"mean": 1e3, "quat_wxyz": 20.0, "log_scale": 5.0, "opacity_logit": 1.0, "sh": 5.0}
PARTS = {
    "position": 1e3,
    "rotation": 20.0,
    "log scale": 5.0,
    "opacity": 4.0,
    "colour": 5.0,
}  # of measured errors
AT_ONCE = 512  # Gaussians whose entries are changed together
RIDGE = 1e-4  # of the mean square of a driver, where entries take over what others did

Mask = npt.NDArray[np.bool_]


def shown(rows: SparseRows, power: F64, share: F64) -> F64:
    """[E] what each entry shows, squared: of columns with mean squares `power` [K], of Gaussians with `share` [N]."""
    total = np.zeros(rows.entries)
    for name, values in rows.values.items():
        total += np.square(WORTH[name] * flat(values).astype(np.float64)).sum(axis=1)
    result: F64 = total * power[rows.column] * share[row_of(rows)]
    return result


def left(errors: Errors, share: F64) -> float:
    """What the measured errors show, in the measure of `shown`, summed over the Gaussians."""
    total = sum(float((share * errors.left[part]).sum()) * worth**2 for part, worth in PARTS.items())
    return total / len(errors.frames)


def flat(values: F32) -> F32:
    """[E, c] of values [E, ...], of which there may be none."""
    return values.reshape(len(values), int(np.prod(values.shape[1:])))


def row_of(rows: SparseRows) -> npt.NDArray[np.int64]:
    """[E] the row of each entry."""
    pointer = rows.row_ptr.astype(np.int64)
    return np.repeat(np.arange(rows.rows), pointer[1:] - pointer[:-1])


def entry_bytes(rows: SparseRows) -> int:
    """Bytes of one entry in a bundle."""
    return rows.column.itemsize + sum(
        value.itemsize * int(np.prod(value.shape[1:])) for value in rows.values.values()
    )


def avatar_bytes(avatar: Avatar) -> int:
    """Bytes of the Gaussians, their blendshapes and their skin weights in a bundle, about."""
    g, b = avatar.gaussians, avatar.blendshapes
    base = sum(part.nbytes for part in (g.mean, g.log_scale, g.quat_wxyz, g.opacity_logit, g.sh))
    parts = (b.geometry, b.appearance, b.correctives, avatar.skin)
    return base + sum(part.entries * entry_bytes(part) for part in parts if part is not None)


def kept(rows: SparseRows, keep: Mask) -> SparseRows:
    """`rows` with the entries `keep` [E] alone."""
    count = np.bincount(row_of(rows)[keep], minlength=rows.rows)
    pointer = np.concatenate([[0], np.cumsum(count)]).astype(np.uint32)
    values = {name: value[keep] for name, value in rows.values.items()}
    return SparseRows(pointer, rows.column[keep], values, rows.columns)


@dataclass(frozen=True)
class Ranked:
    """The entries of geometry and appearance, those that show least by byte first."""

    order: npt.NDArray[np.int64]  # indices into geometry, then appearance
    shown: F64  # of each, in this order
    size: F64  # bytes of each, in this order
    split: int  # entries of geometry

    @staticmethod
    def of(geometry: SparseRows, appearance: SparseRows, power: F64, share: F64) -> Ranked:
        """Ranks all entries. See `shown`."""
        both = (geometry, appearance)
        value = np.concatenate([shown(rows, power, share) for rows in both])
        size = np.concatenate([np.full(rows.entries, float(entry_bytes(rows))) for rows in both])
        order = np.argsort(value / size, kind="stable")
        return Ranked(order, value[order], size[order], geometry.entries)

    def without(self, first: int) -> tuple[Mask, Mask]:
        """(geometry, appearance) masks of what stays without the `first` entries."""
        keep = np.ones(len(self.order), bool)
        keep[self.order[:first]] = False
        return keep[: self.split], keep[self.split :]


def lean(avatar: Avatar, weights: F64, share: F64, most: float) -> Avatar:
    """`avatar` without the entries that show least, which together show `most` at most.

    `weights` [F, K] of the expressions in the frames learnt from. What others can do in place of a dropped entry, the
    entries that stay and the binding pose take over, by least squares over these frames.
    """
    columns = np.concatenate([np.ones((len(weights), 1)), weights], axis=1)
    gram = columns.T @ columns / len(columns) + RIDGE * np.eye(columns.shape[1])
    alone = 1 / np.diag(np.linalg.inv(gram))[1:]  # of each expression, what no others can do
    shapes = avatar.blendshapes
    ranked = Ranked.of(shapes.geometry, shapes.appearance, alone, share)
    first = int(np.searchsorted(np.cumsum(ranked.shown), most))
    stay = ranked.without(first)
    geometry, moved = _without(shapes.geometry, stay[0], gram)
    appearance, painted = _without(shapes.appearance, stay[1], gram)
    changes = {**moved, **painted}
    g = avatar.gaussians
    base = {
        name: getattr(g, name) + change.reshape(getattr(g, name).shape) for name, change in changes.items()
    }
    return replace(
        avatar,
        gaussians=replace(g, **base),
        blendshapes=replace(shapes, geometry=geometry, appearance=appearance),
    )


def _without(rows: SparseRows, keep: Mask, gram: F64) -> tuple[SparseRows, Mapping[str, Any]]:
    """(the entries `keep`, which take over what they can; attribute -> [N, c] what the binding pose takes over)."""
    parts = {name: flat(value) for name, value in rows.values.items()}
    together = np.concatenate(list(parts.values()), axis=1).astype(np.float64)
    row, base = row_of(rows), np.zeros((rows.rows, together.shape[1]))
    for first in range(0, rows.rows, AT_ONCE):
        stop = min(first + AT_ONCE, rows.rows)
        part = slice(int(rows.row_ptr[first]), int(rows.row_ptr[stop]))
        at = row[part] - first, rows.column[part].astype(np.int64) + 1
        dropped = np.zeros((stop - first, len(gram), together.shape[1]))
        dropped[at] = together[part] * ~keep[part, None]
        used = np.zeros((stop - first, len(gram)))
        used[:, 0], used[at] = 1, keep[part]
        square = gram * used[:, :, None] * used[:, None, :] + np.eye(len(gram)) * (1 - used)[:, :, None]
        found = np.linalg.solve(square, used[:, :, None] * (gram @ dropped))
        base[first:stop] = found[:, 0]
        together[part] += found[at]
    ends = np.cumsum([value.shape[1] for value in parts.values()])[:-1]
    values = {
        name: part.astype(np.float32).reshape(rows.values[name].shape)
        for name, part in zip(parts, np.split(together, ends, axis=1), strict=True)
    }
    taken = dict(zip(parts, np.split(base.astype(np.float32), ends, axis=1), strict=True))
    return kept(replace(rows, values=values), keep), taken
