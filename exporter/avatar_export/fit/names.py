"""Do expressions move the place that their names tell, to the side and in the direction that they tell?

Names alone are compared with deltas: sides (left is +X), heights (brows above eyes above mouth), and up or down.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from avatar_export.fit.sampled import Bools, spread_rows
from avatar_export.fit.surface import size_of
from avatar_export.notes.note import Note, doubt
from avatar_runtime.avatar import F32, F64, Avatar, SparseRows
from avatar_runtime.driving.arkit import canonical

ROWS = 10_000  # of a table that are looked at
FEWEST_ROWS, FEWEST = 200, 12  # of a table, and that a column moves (weighed), of one that is judged
# of the avatar's size, and of the usual: radius of what a column moves, of one that is judged
WIDEST = (0.15, 2.5)
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
BROW, EYE, NOSE, CHEEK, MOUTH, JAW = range(6)
PLACES = {
    **dict.fromkeys(("brow", "brows", "eyebrow"), BROW),
    **dict.fromkeys(("eye", "eyes", "eyelid", "eyelids", "blink", "lid"), EYE),
    **dict.fromkeys(("nose", "nostril"), NOSE),
    **dict.fromkeys(("cheek", "cheeks"), CHEEK),
    **dict.fromkeys(("mouth", "lip", "lips", "smile", "frown", "pucker"), MOUTH),
    **dict.fromkeys(("jaw", "chin"), JAW),
}
ABOVE = (  # (upper, lower)
    *((upper, lower) for upper in (BROW, EYE) for lower in (MOUTH, JAW)),
    *((BROW, NOSE), (BROW, CHEEK), (NOSE, MOUTH)),
)
RISES = {
    **dict.fromkeys(("smile", "sneer", "wide", "up"), 1),
    **dict.fromkeys(("frown", "blink", "down"), -1),
}
# jawLeft: the whole jaw goes left
ACROSS = {"look", "jaw", "chin", "eyes", "turn", "swing", "shift", "slide", "move"}
# mouthLeft is the whole mouth
ONE_SIDED = {"smile", "frown", "dimple", "stretch", "press", "up", "down", "corner"}
SIDES = {"left": 1, "l": 1, "right": -1, "r": -1}
WRONG_SIDE, OFF_MIDDLE = 0.1, 0.3  # of the usual distance between a left and a right place
WRONG_WAY = 0.3  # of the length of a motion
BELOW = 0.25  # of the expressions of a lower place that one may not lie below
NEARER = 0.3  # of the distance to the own place: as near to another place is that place
FEW_NAMED = 3  # of each kind, below which nothing is compared


@dataclass(frozen=True)
class Moved:
    """Where and which way the columns of a table move, [K, 3]; not `told`: a column that moves too little."""

    middle: F64
    direction: F64  # mean motion over its length
    moves: Bools  # [K]
    seen: Bools  # [K] moves enough, at one place

    @staticmethod
    def of(table: SparseRows, name: str, places: F32) -> Moved:
        """From the deltas `name` of a sample of the rows, which rest at `places` [R, 3]."""
        rows = spread_rows(table.rows, ROWS)
        part = table.take(rows) if len(rows) < table.rows else table
        ends = part.row_ptr.astype(np.int64)
        at = places[rows].astype(np.float64)[np.repeat(np.arange(part.rows), ends[1:] - ends[:-1])]
        shift, column = part.values[name].astype(np.float64), part.column.astype(np.int64)
        weight, k = np.einsum("ij,ij->i", shift, shift), table.columns
        count = np.bincount(column[weight > 0], minlength=k)
        total = np.maximum(np.bincount(column, weight, k), 1e-30)

        def mean(values: F64) -> F64:
            sums = [np.bincount(column, weight * values[:, axis], k) for axis in range(values.shape[1])]
            result: F64 = np.stack(sums, axis=1) / total[:, None]
            return result

        middle, direction = mean(at), mean(shift / np.sqrt(np.maximum(weight, 1e-30))[:, None])
        radius = np.sqrt(mean(np.square(at - middle[column]).sum(axis=1)[:, None])[:, 0])
        effective = total**2 / np.maximum(np.bincount(column, weight**2, k), 1e-60)
        seen = (
            (effective >= FEWEST)
            & (radius < WIDEST[0] * size_of(places.astype(np.float64)))
            & (table.rows >= FEWEST_ROWS)
        )
        seen &= radius < WIDEST[1] * np.median(radius[seen]) if seen.any() else False
        return Moved(middle, direction, count > 0, seen)


@dataclass(frozen=True)
class Told:
    """What a name tells of an expression."""

    place: int | None  # BROW, EYE, MOUTH
    side: int | None  # 1 left, -1 right, 0 neither; None: not told
    rises: int  # 1 up, -1 down, 0 not told


def told(name: str) -> Told:
    """What `name` tells; an ARKit name in any spelling, or words such as mouth, brow, left."""
    arkit = canonical(name)
    words = _words(name)
    if arkit is not None and not set(words) & PLACES.keys():
        words = _words(arkit)
    place = next((PLACES[word] for word in words if word in PLACES), None)
    sides = [SIDES[word] for word in words if word in SIDES]
    across = set(words) & ACROSS and not {"in", "out", "up", "down"} & set(words)
    across = across or len(set(sides)) > 1 or (place == MOUTH and not ONE_SIDED & set(words))
    if not sides:
        side = None if arkit is None else 0
    else:
        side = None if across else sides[-1]
    rises = [RISES[word] for word in words if word in RISES]
    if place is None:  # the names of eyelids may be sides alone
        return Told(None, side if len(words) == 1 else None, 0)
    return Told(place, side, rises[-1] if rises else 0)


def _words(name: str) -> list[str]:
    return [word.lower() for word in WORD.findall(name)]


def _tables(avatar: Avatar) -> Iterator[tuple[str, Moved, tuple[str, ...]]]:
    """(what moves, its columns, their names) for each table of expressions or eyelids."""
    g, rig = avatar.gaussians.mean, avatar.rig
    tables = [("the Gaussians", avatar.blendshapes.geometry, "mean", g, avatar.expression_names)]
    tables.append(("the Gaussians", avatar.blendshapes.late_morphs, "mean", g, avatar.eyelids))
    if rig is not None:
        tables.append(("the rig's mesh", rig.morphs, "position", rig.vertices, avatar.expression_names))
        tables.append(("the rig's mesh", rig.late_morphs, "position", rig.vertices, avatar.eyelids))
    for what, table, name, places, names in tables:
        if table.entries and table.columns == len(names):
            yield what, Moved.of(table, name, places), names


def names(avatar: Avatar) -> list[Note]:
    """Expressions and eyelids whose deltas lie elsewhere, or go another way, than their names tell."""
    notes: dict[tuple[str, tuple[str, ...]], Note] = {}
    jaw = avatar.rig is not None and any("jaw" in joint.lower() for joint in avatar.rig.joint_names)
    for what, moved, given in _tables(avatar):
        known = [told(name) for name in given]
        seen = moved.seen
        for columns, note in (
            (_wrong_side(moved, known, seen), doubt("names_of_sides", what=what)),
            (_wrong_place(moved, known, seen, jaw), doubt("names_of_places", what=what)),
            (_wrong_way(moved, known, seen), doubt("names_of_ways", what=what)),
        ):
            if columns.any():
                found = tuple(given[k] for k in np.flatnonzero(columns))
                notes.setdefault((note.kind, found), replace(note, values={**note.values, "names": found}))
    return list(notes.values())


def _wrong_side(moved: Moved, known: Sequence[Told], seen: Bools) -> Bools:
    """[K] columns that lie on the other side, or to a side though their names tell none."""
    side = np.array([one.side if one.side is not None else 9 for one in known])
    x = moved.middle[:, 0]
    left, right = seen & (side == 1), seen & (side == -1)
    wrong = np.zeros(len(known), bool)
    if not left.any() or not right.any():
        return wrong
    centre = float(np.median(x[left]) + np.median(x[right])) / 2
    apart = float(np.median(np.abs(x[left | right] - centre))) * 2
    if apart <= 0:
        return wrong
    wrong |= (left | right) & (side * (x - centre) < -WRONG_SIDE * apart)
    if (left | right).sum() >= 2 * FEW_NAMED:
        wrong |= seen & (side == 0) & (np.abs(x - centre) > OFF_MIDDLE * apart)
    return wrong


def _wrong_place(moved: Moved, known: Sequence[Told], seen: Bools, jaw_joint: bool) -> Bools:
    """[K] columns of brows or eyes below the mouth's, and columns that lie where those of another place do."""
    place = np.array([-1 if one.place is None else one.place for one in known])
    y = moved.middle[:, 1]
    wrong = np.zeros(len(known), bool)
    for upper, lower in ABOVE:
        high, low = np.flatnonzero(seen & (place == upper)), np.flatnonzero(seen & (place == lower))
        below = y[high][:, None] < y[low]
        if len(low) >= FEW_NAMED:
            wrong[high] |= (below.mean(axis=1) > BELOW) & (below.sum(axis=1) > 1)  # one may itself be wrong
        if len(high) >= FEW_NAMED:
            wrong[low] |= (below.mean(axis=0) > BELOW) & (below.sum(axis=0) > 1)
    mouth, jaw = seen & (place == MOUTH), seen & (place == JAW)
    if mouth.sum() >= FEW_NAMED and not jaw_joint:  # else a jaw's deltas are what its joint leaves
        wrong |= jaw & (y > np.median(y[mouth]))
    brows, eyes = seen & (place == BROW), seen & (place == EYE)
    if min(brows.sum(), eyes.sum()) >= FEW_NAMED:
        to_brow, to_eye = np.abs(y - np.median(y[brows])), np.abs(y - np.median(y[eyes]))
        fallen, risen = brows & (to_eye < NEARER * to_brow), eyes & (to_brow < NEARER * to_eye)
        if fallen.any() and risen.any():  # one alone may be drawn so
            wrong |= fallen | risen
    return wrong


def _wrong_way(moved: Moved, known: Sequence[Told], seen: Bools) -> Bools:
    """[K] columns that go down though their names tell up, or up for down."""
    rises = np.array([one.rises for one in known])
    wrong: Bools = seen & (rises * moved.direction[:, 1] < -WRONG_WAY)
    return wrong


def eyelids(avatar: Avatar) -> list[Note]:
    """Eyelids, or blinks where there are none, that move nothing, where other expressions move."""
    still: dict[str, None] = {}
    for _, moved, given in _tables(avatar):
        lids = given == avatar.eyelids
        named = [k for k, name in enumerate(given) if lids or (canonical(name) or "").startswith("eyeBlink")]
        if moved.moves.any() and (lids or not avatar.eyelids):
            still |= {given[k]: None for k in named if not moved.moves[k]}
    late = avatar.blendshapes.late_morphs
    if avatar.eyelids and not late.values["mean"].any() and avatar.blendshapes.geometry.entries:
        still |= dict.fromkeys(avatar.eyelids)
    return [doubt("eyelids_still", names=list(still))] if still else []
