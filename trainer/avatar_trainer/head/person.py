"""A head of one person. ICT-FaceKit's eyeBlink shuts the eyes of the mean head alone: the person gets own lids."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from avatar_trainer.head.mesh import Array
from avatar_trainer.head.model import Head, load_head_model

BALLS = ("left_eye", "right_eye")
BLINKS = ("eyeBlinkLeft", "eyeBlinkRight")
COLUMNS, ACROSS = 13, 0.017  # across an eye; half of its width, metres
EDGE = 0.85  # share of a column's longest way from which on a vertex is at the upper lid's edge
STILL = 0.25  # share of it up to which one can be at the lower lid's edge
REACH = 0.022  # metres from the eye's centre: where lids are
CLEAR = 0.0003  # metres that shut lids stand farther off the eyeball than the mean head's


def head_for(identity: Array) -> Head:
    """The head with these coefficients [60 or fewer] of the identity modes, which it keeps none of; its lids close."""
    head = load_head_model()
    if np.ndim(identity) != 1 or len(identity) > len(head.identity):
        raise ValueError(f"identity is {np.shape(identity)}; the head model has {len(head.identity)} modes")
    offset = np.tensordot(np.asarray(identity, np.float64), head.identity[: len(identity)], 1)
    person = replace(head, vertices=head.vertices + offset, identity=head.identity[:0])
    return with_own_lids(head, person)


def with_own_lids(base: Head, head: Head) -> Head:
    """`head`, a person on the mesh of `base`, whose lids meet at a full eyeBlink as those of `base` do.

    An upper lid goes to where this person's lower lid is, and around this person's eyeball.
    """
    expressions = base.expressions.copy()
    person = head.vertices - base.vertices
    for side, name in enumerate(BLINKS):
        row = base.expression_names.index(name)
        way = base.expressions[row].astype(np.float64)
        share, lower = _lid(base, way, base.eye_centres[side])
        ball = base.in_part(BALLS[side])
        goal = base.vertices + way + (1 - share)[:, None] * person + share[:, None] * person[lower]
        centre, radius = head.eye_centres[side], [_radius(h, ball, h.eye_centres[side]) for h in (base, head)]
        stood = np.linalg.norm(base.vertices + way - base.eye_centres[side], axis=1) * radius[1] / radius[0]
        stands = np.linalg.norm(goal - centre, axis=1)
        push = np.clip(2 * share, 0, 1) * np.maximum(stood + CLEAR - stands, 0)
        goal += (push / stands)[:, None] * (goal - centre)
        expressions[row] = np.where((share > 0)[:, None], goal - head.vertices, way)
    return replace(head, expressions=expressions)


def _radius(head: Head, ball: Array, centre: Array) -> float:
    return float(np.median(np.linalg.norm(head.vertices[ball] - centre, axis=1)))


def _lid(base: Head, way: Array, centre: Array) -> tuple[Array, Array]:
    """(share [V] of the upper lid's way that a vertex goes, the lower lid's vertex [V] that it comes to)."""
    place = base.vertices - centre
    near = base.in_part("face") & (np.linalg.norm(place, axis=1) < REACH) & (np.abs(place[:, 0]) < ACROSS)
    length = np.linalg.norm(way, axis=1) * near * (way[:, 1] < 0)
    columns = np.linspace(-ACROSS, ACROSS, COLUMNS)
    width = columns[1] - columns[0]
    longest = np.array([length[np.abs(place[:, 0] - x) < width].max(initial=0) for x in columns])
    share = np.clip(length / np.maximum(np.interp(place[:, 0], columns, longest), 1e-6), 0, 1)
    share[length < 1e-4] = 0
    edge, shut = np.flatnonzero(share > EDGE), base.vertices + way
    rest = np.flatnonzero(near & (share < STILL))
    met = rest[np.linalg.norm(shut[edge, None] - shut[rest], axis=2).argmin(axis=1)]
    lower = np.arange(len(place))
    moved = np.flatnonzero(share > 0)
    lower[moved] = met[np.abs(place[moved, :1] - place[edge, 0]).argmin(axis=1)]
    return share, lower
