"""Known mistakes between two inputs: unit, axes, shift. A search names the one that explains a misfit."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import permutations, product

import numpy as np

from avatar_runtime.avatar import F64

TIMES = 5.0  # a change explains a misfit if it makes the median so many times smaller
UNITS = {  # factor from metres -> the unit's name
    10.0: "decimetres",
    100.0: "centimetres",
    1000.0: "millimetres",
    1 / 0.0254: "inches",
    1 / 0.3048: "feet",
    4.0: "quarters of a metre",
    1e-3: "kilometres",
}
SAME = 0.02  # relative; a factor this near to one of UNITS is that unit
SHIFT_STEPS = 8
TRIED = 4  # changes of each kind that are measured exactly
LIKELY = 0.9  # of the logarithm of the ratio of the sizes that a unit must bring about


@dataclass(frozen=True)
class Change:
    """points -> scale * rotation points + shift."""

    scale: float = 1.0
    rotation: tuple[tuple[float, ...], ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def of(self, points: F64) -> F64:
        """The changed points [N, 3]."""
        moved: F64 = self.scale * points @ np.array(self.rotation).T + np.array(self.shift)
        return moved

    @property
    def mirrors(self) -> bool:
        """Whether it changes left and right."""
        return float(np.linalg.det(np.array(self.rotation))) < 0

    @property
    def turns(self) -> bool:
        """Whether it exchanges or negates axes."""
        return self.rotation != Change().rotation

    @property
    def axes(self) -> str:
        """The new x, y, z in the old axes, as `x, z, -y`."""
        rows = ((row, int(np.argmax(np.abs(row)))) for row in self.rotation)
        return ", ".join(f"{'-' * (row[axis] < 0)}{'xyz'[axis]}" for row, axis in rows)


def rotations() -> Iterator[Change]:
    """Every exchange and negation of axes but the identity, those that keep left and right first."""
    found = []
    for order in permutations(range(3)):
        for signs in product((1.0, -1.0), repeat=3):
            rows = tuple(
                tuple(sign * (axis == k) for k in range(3)) for axis, sign in zip(order, signs, strict=True)
            )
            found.append(Change(rotation=rows))
    return (change for change in sorted(found, key=lambda c: c.mirrors) if change.turns)


def unit_of(factor: float) -> str | None:
    """The unit of a file whose lengths are `factor` times those in metres; None for another factor."""
    return next((name for value, name in UNITS.items() if abs(factor / value - 1) < SAME), None)


@dataclass(frozen=True)
class Search:
    """What `explanation` compares; both functions map points [N, 3] to the places [N, 3] where each should lie."""

    points: F64  # [N, 3] a sample
    rough: Callable[[F64], F64]  # fast, to within the spacing of a coarse mesh
    exact: Callable[[F64], F64]
    own: tuple[F64, F64]  # lowest and highest corner of the box of all points
    goal: tuple[F64, F64]  # of all places

    def off(self, change: Change, places: Callable[[F64], F64]) -> float:
        """The median distance of the changed points from their places."""
        points = change.of(self.points)
        return float(np.median(np.linalg.norm(places(points) - points, axis=1)))

    @property
    def ratio(self) -> float:
        """The size of the points, of that of the places."""
        own, goal = (float(np.linalg.norm(high - low)) for low, high in (self.own, self.goal))
        return max(own, 1e-30) / max(goal, 1e-30)

    @property
    def alike(self) -> bool:
        """Whether points and places have about one size: a small cloud fits on any surface when it is moved there."""
        return abs(float(np.log(self.ratio))) < LIKELY


def explanation(search: Search, limit: float, pairs: bool) -> tuple[Change, float] | None:
    """The simplest known change by which the median distance is at least TIMES smaller and at most `limit`, and that
    median; None without one. `pairs`: also try two changes at once."""
    base = search.off(Change(), search.exact)
    most = min(base / TIMES, limit)
    for kind in (*_single(search), *(_double(search) if pairs else ())):
        ranked = sorted((search.off(change, search.rough), k) for k, change in enumerate(kind))
        tried = [kind[k] for rough, k in ranked[:TRIED] if rough <= base or any(kind[k].shift)]
        exact = sorted((search.off(change, search.exact), k) for k, change in enumerate(tried))
        if exact and exact[0][0] <= most:
            return tried[exact[0][1]], exact[0][0]
    return None


def _units(search: Search) -> list[Change]:
    """The units that bring the sizes nearer: on any surface everything fits that is made small enough."""
    now = abs(np.log(search.ratio))
    factors = [factor for value in UNITS for factor in (1 / value, value)]
    return [Change(scale=f) for f in factors if abs(np.log(f * search.ratio)) < min(LIKELY, now)]


def _single(search: Search) -> Iterator[list[Change]]:
    yield _units(search)
    turned = list(rotations())
    yield [change for change in turned if not change.mirrors]
    yield [change for change in turned if change.mirrors]
    if search.alike:
        yield _shifted(search, Change(), search.exact)


def _double(search: Search) -> Iterator[list[Change]]:
    turned = [change for change in rotations() if not change.mirrors]
    units = _units(search)
    yield [replace(turn, scale=unit.scale) for unit in units for turn in turned]
    yield [moved for unit in units for moved in _shifted(search, unit, search.exact)]
    if search.alike:
        yield [moved for turn in turned for moved in _shifted(search, turn, search.rough)]


def _shifted(search: Search, change: Change, places: Callable[[F64], F64]) -> list[Change]:
    """`change` with shifts that take the points to their `places`: by steps of the median way there, from where they
    are and from where the boxes have one middle."""
    points = change.of(search.points)
    between = np.mean(search.goal, axis=0) - change.of(np.mean(search.own, axis=0)[None])[0]
    found = []
    for shift in (np.zeros(3), between):
        for step in range(SHIFT_STEPS):
            near = search.rough if step < SHIFT_STEPS // 2 else places
            shift = shift + np.median(near(points + shift) - points - shift, axis=0)
        found.append(replace(change, shift=(float(shift[0]), float(shift[1]), float(shift[2]))))
    return found
