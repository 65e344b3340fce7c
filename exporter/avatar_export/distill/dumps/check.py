"""Judges dumps before anything is learnt from them: what is wrong, what was mended, what is doubtful."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from avatar_export.distill.drivers import LARGEST
from avatar_export.distill.dumps import order as places
from avatar_export.distill.dumps.folder import OWNER, Dumps, frame_name
from avatar_export.distill.dumps.frames import COVARIANCE, Layout, decoded, layout, raw_rows
from avatar_export.notes.note import Note, fact
from avatar_runtime.avatar import F32, F64, I64
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError

FLIPPED = -0.5  # product of two unit quaternions below which one has the other sign
LARGE = 0.5  # of the figure's size: no Gaussian of an avatar is typically so large
SPARSE = 0.02  # of the distance of neighbours: so small are squares of scales, not scales
INSIDE = 0.99  # of the values


@dataclass(frozen=True)
class Checked:
    """Dumps that can be learnt from."""

    dumps: Dumps  # with the encoding that the numbers really have
    layout: Layout
    order: I64 | None  # [F, N] where rows changed their places
    mended: tuple[Note, ...]  # what was wrong and is right now


def check(dumps: Dumps, progress: Callable[[str], None] = lambda _: None) -> Checked:
    """`dumps`, read once as a whole.

    Raises AvatarError for frames with different counts or properties, for numbers that are not finite, and for an order
    that changes while Gaussians look too much alike to be matched.
    """
    mended: list[Note] = []
    dumps, known = _encoding(dumps, mended)
    flips: list[int] = []
    order: I64 | None = None
    now = np.arange(known.rows)
    changes: list[int] = []
    neighbours: places.Neighbours | None = None
    before: F32 | None = None
    quat: F32 | None = None
    for index in range(dumps.drivers.frames):
        progress(f"checking frame {index} of {dumps.drivers.frames}")
        raw = _raw(dumps, known, index)
        rows = decoded(dumps, known, raw[now][None])
        signature = places.signature(rows)
        if neighbours is None or before is None:
            neighbours = places.Neighbours.of(rows.mean[0])
        else:
            found = places.match(before, signature, neighbours, rows.mean[0])
            if found.order is not None:
                changes.append(index)
                _refuse_uncertain(dumps, index, found, len(changes))
                now = now[found.order]
                order = np.tile(np.arange(known.rows), (dumps.drivers.frames, 1)) if order is None else order
                rows = decoded(dumps, known, raw[now][None])
                signature = places.signature(rows)
        if order is not None:
            order[index] = now
        if quat is not None and (np.einsum("ni,ni->n", quat, rows.quat_wxyz[0]) < FLIPPED).any():
            flips.append(index)
        before, quat = signature, rows.quat_wxyz[0]
    if changes:
        mended.append(fact("order_changes", frames=_frames(changes)))
    if flips:
        mended.append(fact("signs_change", frames=_frames(flips)))
    return Checked(dumps, known, order, tuple(mended))


def _refuse_uncertain(dumps: Dumps, index: int, found: places.Match, changes: int) -> None:
    if found.uncertain:
        raise AvatarError(
            f"holds the Gaussians in another order than {frame_name(index - 1)}, and {found.uncertain} of them look "
            "too much alike to be distinguished: dump all frames in one order",
            file=dumps.frame(index),
            owner=OWNER,
        )
    if changes > places.MOST_CHANGES:
        raise AvatarError(
            f"is the {changes}th frame with another order of Gaussians: dump all frames in one order",
            file=dumps.frame(index),
            owner=OWNER,
        )


def _frames(which: list[int]) -> str:
    more = f" and {len(which) - 1} more" if len(which) > 1 else ""
    return f"{frame_name(which[0])}{more}"


def _raw(dumps: Dumps, known: Layout, index: int) -> F32:
    """All numbers of a frame. Raises AvatarError if it has another layout or a number that is not finite."""
    file = dumps.frame(index)
    own = layout(file, dumps.encoding)
    if own.rows != known.rows:
        raise AvatarError(
            f"has {own.rows} Gaussians, {frame_name(0)} has {known.rows}: a portable avatar keeps their number; dump "
            "all frames with the same Gaussians (no pruning, no densification)",
            file=file,
            owner=OWNER,
        )
    if own != known:
        raise AvatarError(
            f"has other properties than {frame_name(0)}, or another type or header: write all frames with one program",
            file=file,
            owner=OWNER,
        )
    return _bounded(raw_rows(file, known, slice(0, known.rows)), known, file)


def _bounded(raw: F32, known: Layout, file: Path) -> F32:
    with np.errstate(invalid="ignore"):  # NaN of some bits
        fine = raw.min() >= -LARGEST and raw.max() <= LARGEST
    if not fine:
        row, column = np.argwhere(~(np.abs(raw) <= LARGEST))[0].tolist()
        raise AvatarError(
            f"is {raw[row, column]}; finite numbers of at most {LARGEST:g} are needed",
            file=file,
            field=f"{known.names[column]}[{row}]",
            owner=OWNER,
        )
    return raw


def _encoding(dumps: Dumps, mended: list[Note]) -> tuple[Dumps, Layout]:
    """The dumps with the encoding that the first frame's numbers show."""
    file, encoding = dumps.frame(0), dumps.encoding
    if encoding.scale != "covariance" and _has_covariances(dumps):
        mended.append(fact("covariances", file=file.name, property=COVARIANCE[0]))
        encoding = replace(encoding, scale="covariance")
    known = layout(file, encoding)
    raw = _bounded(raw_rows(file, known, slice(0, known.rows)), known, file)
    at = {name: column for column, name in enumerate(known.names)}

    def column(names: tuple[str, ...]) -> F64:
        return raw[:, [at[name] for name in names]].astype(np.float64)

    if encoding.scale != "covariance":
        scale = _scale_encoding(encoding.scale, column(ply.SCALE), column(ply.POSITION))
        if scale != encoding.scale:
            median = float(np.median(column(ply.SCALE)))
            values = {"file": file.name, "median": median, "right": scale, "stated": encoding.scale}
            mended.append(fact("scale_encoding", **values))
            encoding = replace(encoding, scale=scale)
    opacity = column(ply.OPACITY)
    within = ((opacity >= 0) & (opacity <= 1)).mean()
    if encoding.opacity == "logit" and within == 1 and len(opacity) > 1:
        mended.append(fact("linear_opacity", file=file.name))
        encoding = replace(encoding, opacity="linear")
    elif encoding.opacity == "linear" and within < INSIDE:
        mended.append(fact("logit_opacity", file=file.name))
        encoding = replace(encoding, opacity="logit")
    return replace(dumps, encoding=encoding), known


def _has_covariances(dumps: Dumps) -> bool:
    try:
        names = layout(dumps.frame(0), replace(dumps.encoding, scale="covariance")).names
    except AvatarError:
        return False
    return not set(ply.SCALE) & set(names)


def _scale_encoding(said: str, values: F64, position: F64) -> str:
    """What `values` [N, 3] must be: `said`, unless Gaussians would be as large as the figure, or invisible."""
    low, high = np.percentile(position, [1, 99], axis=0)
    size = max(float((high - low).max()), 1e-12)
    apart = size / np.sqrt(len(position))  # the typical distance of neighbours on a surface
    positive = bool((values > 0).all())
    if said == "log":
        too_large = float(np.median(np.exp(np.minimum(values, 50)))) > LARGE * size
        if not (positive and too_large and float(values.max()) < size):
            return said
    elif not positive:
        return "log" if (values < 0).mean() > LARGE else said
    largest = float(np.median(values.max(axis=1)))
    if said != "variance" and largest < SPARSE * apart and np.sqrt(largest) > SPARSE * apart:
        return "variance"
    return "linear" if said == "log" else said
