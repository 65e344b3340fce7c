"""Finds the same vertices in two triangulated surfaces by connectivity alone, in any pose.

Vertices get colours that describe their connectivity: equal at first, then repeatedly mixed with the colours around
them, in the winding order of the triangles (Weisfeiler-Lehman refinement). Vertices with a unique colour in both
surfaces are matched. Equal parts (two eyeballs, the rotations of a cylinder) keep equal colours: there the position of
one vertex decides, and the colours spread from it.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, I64

U64 = npt.NDArray[np.uint64]
ROUNDS = 8  # refinements between two counts of the colours
NEIGHBOURS = 64  # matched vertices that predict the position of an unmatched one
MAX_STEPS = 200  # of distinguishing equal vertices; each step serves all parts


@dataclass(frozen=True)
class Surface:
    """Triangles [F, 3] of `count` vertices; `points` [count, 3] only distinguish equal parts."""

    triangles: I64
    count: int
    points: F32
    corner: I64 = field(init=False)  # [3 F] vertex of each corner, sorted
    ahead: I64 = field(init=False)  # [3 F] the vertex after it in its triangle
    behind: I64 = field(init=False)  # [3 F] the vertex before it
    start: I64 = field(init=False)  # first corner of each vertex in `used`
    used: I64 = field(init=False)  # vertices in a triangle
    part: I64 = field(init=False)  # [count] label of the connected part

    def __post_init__(self) -> None:
        corner = self.triangles.reshape(-1)
        order = np.argsort(corner, kind="stable")
        ahead, behind = (np.roll(self.triangles, step, axis=1).reshape(-1)[order] for step in (-1, 1))
        used, start = np.unique(corner[order], return_index=True)
        values = {"corner": corner[order], "ahead": ahead, "behind": behind, "start": start, "used": used}
        for name, value in values.items():
            object.__setattr__(self, name, value)
        object.__setattr__(self, "part", _parts(self))


def hash64(values: U64) -> U64:
    """A well-mixed 64-bit value for each (the finaliser of splitmix64)."""
    x = values + np.uint64(0x9E3779B97F4A7C15)
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    result: U64 = x ^ (x >> np.uint64(31))
    return result


def isomorphism(source: Surface, goal: Surface) -> I64 | None:
    """For each vertex of `source` the vertex of `goal` with the same neighbours, -1 for a vertex without triangle.

    None if the connectivity differs. The caller must check the triangles, since colours are hashes.
    """
    if len(source.triangles) != len(goal.triangles) or len(source.used) != len(goal.used):
        return None
    if not len(source.used):
        return np.full(source.count, -1)
    colours = (np.zeros(source.count, np.uint64), np.zeros(goal.count, np.uint64))
    for _ in range(MAX_STEPS):
        refined = _refine(source, goal, colours)
        if refined is None:
            return None
        colours, distinct = refined
        matched = _matched(source, goal, colours)
        if distinct == len(source.used):
            return matched
        colours = _tell_apart(source, goal, colours, matched)
    return None


def _refine(source: Surface, goal: Surface, colours: tuple[U64, U64]) -> tuple[tuple[U64, U64], int] | None:
    """(colours that more mixing does not split, how many); None if the two surfaces differ in them."""
    a, b = colours
    distinct = 0
    while True:
        ca, cb = np.sort(a[source.used]), np.sort(b[goal.used])
        if not np.array_equal(ca, cb):
            return None
        found = 1 + int(np.count_nonzero(np.diff(ca)))
        if found == distinct or found == len(ca):
            return (a, b), found
        distinct = found
        for _ in range(ROUNDS):
            a, b = _mixed(source, a), _mixed(goal, b)


def _mixed(surface: Surface, colour: U64) -> U64:
    own = hash64(colour)
    around = hash64(own[surface.ahead] + hash64(own + np.uint64(1))[surface.behind])
    result = colour.copy()
    result[surface.used] = hash64(own[surface.used] + np.add.reduceat(around, surface.start))
    return result


def _parts(surface: Surface) -> I64:
    """[count] the smallest vertex of each vertex's connected part."""
    label = np.arange(surface.count)
    while True:
        low = np.minimum(label[surface.ahead], label[surface.behind])
        least = label.copy()
        if len(surface.used):
            near = np.minimum.reduceat(low, surface.start)
            least[surface.used] = np.minimum(label[surface.used], near)
        least = np.minimum(least, least[least])  # jumps ahead, not only from neighbour to neighbour
        np.minimum.at(least, label, least)  # spreads the label to the whole part
        if np.array_equal(least, label):
            return label
        label = least


def _matched(source: Surface, goal: Surface, colours: tuple[U64, U64]) -> I64:
    """For each vertex of `source` the vertex of `goal` with the same unique colour, else -1."""
    result = np.full(source.count, -1)
    (ca, na), (cb, nb) = (
        np.unique(c[s.used], return_counts=True) for c, s in zip(colours, (source, goal), strict=True)
    )
    single_a, single_b = (np.isin(c[s.used], values[counts == 1]) for c, s, values, counts in (
        (colours[0], source, ca, na), (colours[1], goal, cb, nb)))  # fmt: skip
    rows_a, rows_b = source.used[single_a], goal.used[single_b]
    rows_a, rows_b = rows_a[np.argsort(colours[0][rows_a])], rows_b[np.argsort(colours[1][rows_b])]
    result[rows_a] = rows_b
    return result


def _tell_apart(source: Surface, goal: Surface, colours: tuple[U64, U64], matched: I64) -> tuple[U64, U64]:
    """Gives one vertex of each ambiguous part, and its counterpart in `goal`, a new colour.

    The vertex has the rarest colour of the part; its counterpart is the vertex of that colour in `goal` that is nearest
    to the position that matched vertices around it predict.
    """
    a, b = colours[0].copy(), colours[1].copy()
    rows = source.used[matched[source.used] < 0]
    values, number, counts = np.unique(a[rows], return_inverse=True, return_counts=True)
    by_colour = goal.used[np.argsort(b[goal.used], kind="stable")]
    first = np.searchsorted(b[by_colour], values)
    size = np.bincount(source.part[source.used], minlength=source.count)
    order = np.lexsort((rows, counts[number], source.part[rows], -size[source.part[rows]]))
    starts = np.flatnonzero(np.diff(source.part[rows][order], prepend=-1))
    known = np.flatnonzero(matched >= 0)
    if len(known) < 3:
        starts = starts[:1]  # the positions of smaller parts are not known yet
    free = np.ones(goal.count, bool)  # a part of `goal` is used once per step
    for step, at in enumerate(order[starts]):
        colour = int(number[at])
        alike = by_colour[first[colour] : first[colour] + counts[colour]]
        alike = alike[free[goal.part[alike]]]
        if len(alike):
            place = _expected(source, goal, matched, known, int(rows[at]))
            distance = np.sum((goal.points[alike].astype(np.float64) - place) ** 2, axis=1)
            twin = int(alike[np.argmin(distance)])
            free[goal.part[twin]] = False
            a[rows[at]] = b[twin] = hash64(np.array([step], np.uint64) + a[rows[at]])[0]
    return a, b


def _expected(source: Surface, goal: Surface, matched: I64, known: I64, vertex: int) -> F64:
    """The expected position of `vertex` among goal.points, by the similarity transform of matched vertices near it."""
    point = source.points[vertex].astype(np.float64)
    if len(known) < 3:
        own, other = (s.points[s.used].astype(np.float64) for s in (source, goal))
        scale = np.linalg.norm(other.std(axis=0)) / max(float(np.linalg.norm(own.std(axis=0))), 1e-12)
        result: F64 = (point - own.mean(axis=0)) * scale + other.mean(axis=0)
        return result
    distance = np.sum((source.points[known] - source.points[vertex]) ** 2, axis=1)
    near = known[np.argsort(distance, kind="stable")[:NEIGHBOURS]]
    return _carried(
        source.points[near].astype(np.float64), goal.points[matched[near]].astype(np.float64), point
    )


def _carried(source: F64, goal: F64, point: F64) -> F64:
    """`point` under the similarity that best takes `source` to `goal` (Umeyama 1991)."""
    mean_a, mean_b = source.mean(axis=0), goal.mean(axis=0)
    a, b = source - mean_a, goal - mean_b
    u, size, vt = np.linalg.svd(b.T @ a)
    sign = np.array([1.0, 1.0, 1.0 if np.linalg.det(u @ vt) >= 0 else -1.0])
    scale = np.sum(size * sign) / max(np.sum(a * a), 1e-30)
    result: F64 = scale * ((u * sign) @ vt) @ (point - mean_a) + mean_b
    return result
