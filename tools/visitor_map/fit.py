"""Learns the table: for each ARKit name MediaPipe's own score, a ridge regression of its region, or the mean of both.

Which of them is decided on people that were held out. Every picture counts a second time as a mirror shows it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_runtime.driving.arkit import ARKIT_NAMES
from tools.landmark_map.faces import Array
from tools.visitor_map.measures import BROWS, CHEEKS, CHIN, LANDMARKS, LIDS, LIPS, NOSE

RIDGE = 1.0  # with points in tenths
POINT_SCALE = 10.0
FOLDS = 5
BETTER = 0.02  # of the correlation, by which points must be better than the score alone
SURE = 0.5  # of a score's correlation: such a score counts as much as points
MOST_GAIN, TOP = 3.0, 0.9  # a shape that is wholly there, and alone, shall give TOP
NOT_SEEN = ("cheekPuff", "tongueOut")  # MediaPipe's landmarks hardly move with a puffed cheek
REGIONS = {  # beginnings of names: (points, beginnings of scores)
    "eyeLook": ((), ()),
    "brow": ((*BROWS, 168, 6), ("brow",)),
    "nose": ((*NOSE, *LIDS, *BROWS, 50, 280), ("nose", "brow", "eye", "mouthUpper")),
    "eye": ((*LIDS, *CHEEKS, *BROWS), ("eye", "cheek", "brow")),
    "cheekSquint": ((*LIDS, *CHEEKS, *BROWS), ("eye", "cheek", "brow")),
    "": ((*LIPS, *NOSE, *CHEEKS, *CHIN), ("mouth", "jaw", "cheek")),
}


@dataclass(frozen=True)
class People:
    """N pictures of many people."""

    features: Array  # [N, C]
    weights: Array  # [N, 51] true
    turned: Array  # [N, 3] true less seen angles of the head
    person: Array  # [N]


@dataclass(frozen=True)
class Row:
    """How one weight is read: `table` [C] over the features, with its gain; and how well, on people held out."""

    table: Array
    score_r: float  # of MediaPipe's score alone
    r: float


def columns(name: str, score_names: list[str]) -> list[int]:
    """Features that may tell about a name."""
    own, scores = next(value for start, value in REGIONS.items() if name.startswith(start))
    at = [k for k, score in enumerate(score_names) if score.startswith(scores)] if scores else []
    base = len(score_names)
    return at + [base + 2 * LANDMARKS.index(point) + axis for point in own for axis in (0, 1)]


def row(people: People, name: str, names: list[str], score_names: list[str]) -> Row:
    """The row of an ARKit name."""
    count, result = people.features.shape[1], np.zeros(people.features.shape[1])
    own = score_names.index(name) if name in score_names else None
    if name not in names or name in NOT_SEEN:
        return Row(result, np.nan, np.nan)
    truth = people.weights[:, names.index(name)]
    scale = np.where(np.arange(count) < len(score_names), 1.0, POINT_SCALE)
    x = people.features * scale
    score = x[:, own] if own is not None else np.zeros(len(x))
    score_r = correlation(truth, score)
    at = columns(name, score_names)
    held, r = np.zeros(len(x)), -1.0
    if at:
        for fold in range(FOLDS):
            out = people.person % FOLDS == fold
            held[out] = x[np.ix_(out, at)] @ ridge(x[np.ix_(~out, at)], truth[~out])
        r = correlation(truth, np.clip(held, 0, None))
    if not r > np.nan_to_num(score_r) + BETTER:
        told = score
        if own is not None:
            result[own] = 1.0
    else:
        told = held
        result[at] = ridge(x[:, at], truth) * scale[at]
        if score_r > SURE:
            told = (held + score) / 2
            result = result / 2
            result[own] += 0.5
    alone = (truth > 0) & (((people.weights > 0.02).sum(axis=1) <= 2) | name.startswith("eyeLook"))
    slope = float(truth[alone] @ np.clip(told[alone], 0, None) / max(truth[alone] @ truth[alone], 1e-9))
    gain = float(np.clip(TOP / max(slope, 1e-9), 1, MOST_GAIN))
    return Row(result * gain, score_r, correlation(truth, np.clip(told, 0, None)))


def turns(people: People) -> Array:
    """[3, C] what is to be added to yaw, pitch and roll, by the features."""
    return np.array(
        [ridge(people.features * POINT_SCALE, people.turned[:, axis]) * POINT_SCALE for axis in range(3)]
    )


def turns_off(people: People) -> tuple[Array, Array]:
    """([3] before, [3] after): degrees, root mean square, by which angles of people held out are off."""
    after = people.turned.copy()
    for fold in range(FOLDS):
        out = people.person % FOLDS == fold
        x = people.features * POINT_SCALE
        after[out] -= x[out] @ np.array([ridge(x[~out], people.turned[~out, axis]) for axis in range(3)]).T
    before, now = (np.degrees(np.sqrt(np.mean(off**2, axis=0))) for off in (people.turned, after))
    return before, now


def ridge(x: Array, y: Array) -> Array:
    """[C] of y = x b."""
    result: Array = np.linalg.solve(x.T @ x + RIDGE * np.eye(x.shape[1]), x.T @ y)
    return result


def correlation(a: Array, b: Array) -> float:
    """Pearson's; nan where one does not vary."""
    return float(np.corrcoef(a, b)[0, 1]) if a.std() > 1e-9 and b.std() > 1e-9 else float("nan")


def mirrored_columns(names: list[str], score_names: list[str], mirror: Array) -> tuple[Array, Array, Array]:
    """(order and signs of features, order of weights) of a mirrored picture; `mirror` [478] of landmarks."""
    other = [n.replace("Left", "#").replace("Right", "Left").replace("#", "Right") for n in score_names]
    scores = [score_names.index(n) for n in other]
    across = [LANDMARKS.index(int(mirror[landmark])) for landmark in LANDMARKS]
    base = len(score_names)
    order = np.array(scores + [base + 2 * point + axis for point in across for axis in (0, 1)] + [-3, -2, -1])
    signs = np.array([1.0] * base + [-1.0, 1.0] * len(LANDMARKS) + [1.0, -1.0, -1.0])
    weights = [
        names.index(n.replace("Left", "#").replace("Right", "Left").replace("#", "Right")) for n in names
    ]
    return order, signs, np.array(weights)


def rows(people: People, names: list[str], score_names: list[str]) -> dict[str, Row]:
    """By every ARKit name, in order."""
    return {name: row(people, name, names, score_names) for name in ARKIT_NAMES}
