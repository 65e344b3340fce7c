"""Neighbours in an avatar are alike: what is unlike, transparent or of another hue than skin may be wrong.

Colours, sizes, opacities and rotations of neighbours correlate by 0.17 to 0.99 in trained avatars; rows that were
exchanged leave 0. Only an avatar whose other properties are alike is doubted, as random numbers would be otherwise.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import pairwise, permutations

import numpy as np
import numpy.typing as npt

from avatar_export.fit.sampled import spread_rows, unit_rows
from avatar_export.notes.note import Note, doubt
from avatar_runtime.avatar import F32, F64, I64, Avatar
from avatar_runtime.rotation import matrix_from_quat
from avatar_schema import constants

LEAST = 400  # Gaussians of the largest group; fewer are not judged
PATCHES, PATCHES_OF_BLOCK, ROWS, NEAREST = 96, 40, 24, 4
MOST = 30_000  # rows among which neighbours are looked for
ALIKE = 0.25  # what the other properties correlate by at least
UNLIKE, UNLIKE_BLOCK = 0.45, 0.15  # of the least of the others; sound ones have 0.61, and 0.28 in a block
TURNED = 1.8  # times the correlation of rotations is as much as that of others
BLOCKS, LEAST_OF_BLOCK = 4, 1000  # of rows, and the rows of one
TYPICAL = 0.8  # of the deviation of all rows; or so many times as much
THIN = (
    0.15  # of the squared deviations of a splat, the least; a ball has a third and may be turned as it likes
)
INVISIBLE = -3.9  # logit of an opacity of 0.02
TRANSPARENT, SCATTERED = 0.4, 0.2  # share of invisible Gaussians; of ones that lie alone among others
ALONE = 0.3  # correlation of being invisible
HEAD = 0.6  # metres of height; of what is higher, little is skin
SKIN, RARE, MIXED = 0.3, 0.3, 0.2
COLOURS, SCALES = ("red", "green", "blue"), ("scale_0", "scale_1", "scale_2")


@dataclass(frozen=True)
class Patches:
    """Gaussians with their neighbours."""

    rows: I64  # [P, K] rows of the avatar
    near: I64  # [P, K, NEAREST] columns of `rows`

    @staticmethod
    def of(avatar: Avatar, first: int, end: int, seeds: int) -> Patches | None:
        """Patches of the rows from `first` to `end`, about evenly spaced ones; None if they are too few."""
        if end - first < LEAST:
            return None
        rows = first + spread_rows(end - first, MOST)
        points = avatar.gaussians.mean[rows]
        points -= np.median(points, axis=0)
        seed = spread_rows(len(rows), seeds)
        off = np.square(points).sum(axis=1) - 2 * points[seed] @ points.T  # less a constant of each seed
        found = np.argpartition(off, ROWS, axis=1)[:, :ROWS]
        place = points[found]
        apart = np.square(place[:, :, None] - place[:, None]).sum(axis=3)
        apart[:, np.arange(ROWS), np.arange(ROWS)] = -1
        near = np.argsort(apart, axis=2, kind="stable")[:, :, 1 : NEAREST + 1]
        return Patches(rows[found], near)

    def alike(self, values: npt.NDArray[np.floating] | npt.NDArray[np.bool_], ranked: bool = True) -> float:
        """The correlation of `values` [P * K, C] of neighbours; NaN for what does not vary. Of ranks, if `ranked`."""
        given = values.reshape(self.rows.size, -1).astype(np.float64)
        spread = float(np.ptp(given, axis=0).max())
        if not np.isfinite(spread) or spread < 1e-6:
            return float("nan")
        if ranked:
            given = np.stack([_ranks(column) for column in given.T], axis=1)
        given = given - given.mean(axis=0)
        own = given.reshape(*self.rows.shape, -1)
        beside = own[np.arange(len(own))[:, None, None], self.near].mean(axis=2)
        return float((own * beside).mean(axis=(0, 1)).sum() / np.square(given).mean(axis=0).sum())


def _ranks(values: F64) -> F64:
    """[n] the place of each of `values` [n] in their order; equal ones have the mean of theirs."""
    _, place, count = np.unique(values, return_inverse=True, return_counts=True)
    ranks: F64 = (np.cumsum(count) - (count + 1) / 2)[place]
    return ranks


def doubts(avatar: Avatar) -> list[Note]:
    """Doubts about a property whose rows were exchanged, about transparency and about the order of the channels.

    Of the largest group, and of each quarter of its rows that is like the whole: it may be the one that was changed.
    """
    if not avatar.groups:
        return []
    group = max(avatar.groups, key=lambda one: one.count)
    first, end = group.first, group.first + group.count
    patches = Patches.of(avatar, first, end, PATCHES)
    if patches is None:
        return []
    notes = [*_transparent(avatar.gaussians.opacity_logit, slice(first, end), patches)]
    hidden = {"opacities"} if notes else set()
    notes += [note for note in _unlike(avatar, patches, UNLIKE) if note.values["what"] not in hidden]
    if np.ptp(np.quantile(avatar.gaussians.mean[first:end, 1], (0.01, 0.99))) < HEAD:
        notes += _hues(avatar, patches)
    said = {note.values.get("what") for note in notes} | hidden
    for part in _typical(avatar, first, end):
        patches = Patches.of(avatar, *part, PATCHES_OF_BLOCK)
        found = [] if patches is None else [*_unlike(avatar, patches, UNLIKE_BLOCK)]
        notes += [note for note in found if note.values["what"] not in said]
        said |= {note.values["what"] for note in found}
    return notes


def _typical(avatar: Avatar, first: int, end: int) -> Iterator[tuple[int, int]]:
    """Quarters of the rows in which positions and properties vary as in all; in sorted rows there are none."""
    if end - first < BLOCKS * LEAST_OF_BLOCK:
        return
    g = avatar.gaussians
    properties = [g.mean, g.log_scale, g.sh[:, 0], g.opacity_logit[:, None]]
    values = np.concatenate([one[first:end] for one in properties], axis=1)
    edges = np.linspace(0, end - first, BLOCKS + 1).astype(np.int64).tolist()
    spread = np.maximum(values.std(axis=0), 1e-6)
    for begin, stop in pairwise(edges):
        ratio = (values[begin:stop].std(axis=0) + 1e-6) / spread
        if ratio.min() > TYPICAL and ratio.max() < 1 / TYPICAL:
            yield first + begin, first + stop


def _unlike(avatar: Avatar, patches: Patches, unlike: float) -> Iterator[Note]:
    """A doubt about a column or a property that is less alike than `unlike` times each other one."""
    g, rows = avatar.gaussians, patches.rows.ravel()
    colour, scale = g.sh[rows, 0], g.log_scale[rows]
    for names, values in (COLOURS, colour), (SCALES, scale):
        yield from _odd({name: patches.alike(values[:, k]) for k, name in enumerate(names)}, unlike)
    found = {
        "colours": patches.alike(colour),
        "scales": patches.alike(scale.mean(axis=1)),
        "opacities": patches.alike(g.opacity_logit[rows]),
        "rotations": TURNED * _turned(g.quat_wxyz[rows], scale, patches),
    }
    yield from _odd({what: value for what, value in found.items() if np.isfinite(value)}, unlike)


def _odd(alike: Mapping[str, float], unlike: float) -> Iterator[Note]:
    """A doubt about the one of at least three correlations that is much smaller than all others."""
    if len(alike) < 3:
        return
    least, *others = sorted(alike, key=alike.__getitem__)
    if alike[others[0]] >= ALIKE and alike[least] < unlike * alike[others[0]]:
        yield doubt("unlike_neighbours", what=least, own=alike[least], others=alike[others[0]])


def _turned(quat: F32, log_scale: F32, patches: Patches) -> float:
    """The correlation of rotations, NaN where splats are too round to have any."""
    deviation = np.exp(2 * (log_scale - log_scale.max(axis=1, keepdims=True)).astype(np.float64))
    if float((deviation.min(axis=1) / deviation.sum(axis=1)).mean()) > THIN:
        return float("nan")
    return patches.alike(matrix_from_quat(unit_rows(quat)).reshape(-1, 9), ranked=False)


def _transparent(logit: F32, whole: slice, patches: Patches) -> Iterator[Note]:
    share = float((logit[whole] < INVISIBLE).mean())
    alone = share > SCATTERED and patches.alike(logit[patches.rows] < INVISIBLE, ranked=False) < ALONE
    if share > TRANSPARENT or alone:
        yield doubt("transparent", share=share)


def _hues(avatar: Avatar, patches: Patches) -> Iterator[Note]:
    """A doubt about the channels of a head that has the hue of skin in another order of them."""
    g = avatar.gaussians
    opaque = g.opacity_logit[patches.rows] > 0
    rgb = np.clip(0.5 + constants()["sh_c0"][0] * g.sh[patches.rows, 0].astype(np.float64), 0, 1)  # [P, K, 3]
    count = max(int(opaque.sum()), 1)
    own = opaque & _skin(rgb)
    for order in permutations(range(3)):
        if order == (0, 1, 2):
            continue
        other = opaque & _skin(rgb[..., order])
        beside = np.minimum(own.sum(axis=1), other.sum(axis=1)) >= MIXED * ROWS
        mixed = order[0] > 0 and beside.mean() > MIXED  # skin may have as much blue as green, here and there
        if (other.sum() > SKIN * count and own.sum() < RARE * other.sum()) or mixed:
            yield doubt("other_hue", order=["RGB"[k] for k in order], share=other.sum() / count)
            return


def _skin(rgb: F64) -> npt.NDArray[np.bool_]:
    """Which colours have the hue of human skin, of any lightness: more red than green, more green than blue."""
    red, green, blue = np.moveaxis(rgb, -1, 0)
    warm = red - blue
    vivid: npt.NDArray[np.bool_] = (warm > 0.06) & (warm > 0.12 * red) & (warm < 0.75 * red)
    skin: npt.NDArray[np.bool_] = vivid & (green - blue > 0.1 * warm) & (green - blue < 0.85 * warm)
    return skin
