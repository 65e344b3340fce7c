"""Where the eyes look: the irises on the eyeballs of the fitted head, as weights of eyeLook shapes."""

from __future__ import annotations

import numpy as np

from avatar_runtime import F64
from avatar_trainer.film.fit.pose import Fit
from avatar_trainer.head import EYE_TURN, Head

IRIS = {"Left": 473, "Right": 468}  # landmark of the middle of each iris
IRIS_RADIUS = 0.0105  # metres from the middle of the eyeball to that of the iris
CLOSED = 0.4  # weight of a blink from which a lid hides the iris
FAR = 0.25  # radians from what MediaPipe says: an eye that is seen from the side, or not at all
TRUST = 0.7  # share of what the irises say beyond MediaPipe's weights


def angles(fit: Fit, head: Head, places: F64) -> dict[str, F64]:
    """Per side [T, 2] radians about x (down) and y (to the subject's left), by irises in `places` [T, 478, 2]."""
    identity = np.tensordot(fit.identity, head.identity.astype(np.float64), 1)
    balls = {"Left": "left_eye", "Right": "right_eye"}
    found = {}
    for side, (index, part) in enumerate(zip(IRIS.values(), balls.values(), strict=True)):
        moved = identity[head.in_part(part)].mean(axis=0)
        middle = head.eye_centres[side] + moved
        ray = np.concatenate(
            [(places[:, index] - fit.principal) / fit.focal, np.ones((len(places), 1))], axis=1
        )
        ray /= np.linalg.norm(ray, axis=1, keepdims=True)
        centre = middle @ fit.rotation.transpose(0, 2, 1) + fit.translation
        along = (ray * centre).sum(axis=1)
        off2 = (centre**2).sum(axis=1) - along**2
        depth = along - np.sqrt(np.maximum(IRIS_RADIUS**2 - off2, 0))
        hit = np.einsum("tji,tj->ti", fit.rotation, ray * depth[:, None] - centre)
        hit /= np.maximum(np.linalg.norm(hit, axis=1, keepdims=True), 1e-9)
        name = ("Left", "Right")[side]
        found[name] = np.stack(
            [-np.arcsin(np.clip(hit[:, 1], -1, 1)), np.arctan2(hit[:, 0], hit[:, 2])], axis=1
        )
    return found


def with_gaze(fit: Fit, head: Head, places: F64, scores: F64) -> F64:
    """Weights [T, K] of `fit` with eyeLook shapes by the irises; `scores` [T, K] MediaPipe's weights by our names.

    Both eyes look at one point, far away, so they share their angles: the mean of the two, each the less the farther it
    is from what MediaPipe says of that frame. A person's eyeballs lie a little elsewhere than the model's: the
    constant part of the angles is MediaPipe's, too.
    """
    weights, names = fit.weights.copy(), head.expression_names
    shapes = {side: {n: np.array(turn) for n, turn in EYE_TURN.items() if n.endswith(side)} for side in IRIS}
    told = np.mean(
        [sum(scores[:, names.index(n), None] * turn for n, turn in shapes[side].items()) for side in IRIS],
        axis=0,
    )
    seen = angles(fit, head, places)
    total, share = np.zeros_like(told), np.full_like(told, 1e-6)
    for side in IRIS:
        off = seen[side] - told
        open_eye = fit.weights[:, names.index(f"eyeBlink{side}")] < CLOSED
        off -= np.median(off[open_eye] if open_eye.any() else off, axis=0)
        trust = np.exp(-((off / FAR) ** 2)) * open_eye[:, None]
        total, share = total + trust * off, share + trust
    off = total / share
    steady = np.median(
        np.pad(off, ((1, 1), (0, 0)), "edge")[np.arange(len(off))[:, None] + np.arange(3)], axis=1
    )
    looks = told + TRUST * steady
    for side in IRIS:
        for name, turn in shapes[side].items():
            axis = int(np.abs(turn).argmax())
            weights[:, names.index(name)] = np.clip(looks[:, axis] / turn[axis], 0, 1)
    return weights
