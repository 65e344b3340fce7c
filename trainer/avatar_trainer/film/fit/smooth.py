"""Poses and expressions of a film, smoothed in time: a tracked head trembles, a filmed one does not."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from avatar_runtime import F64, I64
from avatar_trainer.film.fit.pose import Fit

# Weights of a frame and those before and after it: a quadratic by least squares over five frames (Savitzky and Golay
# 1964), which leaves a turn's speed and acceleration as they are.
QUADRATIC = np.array([-3, 12, 17, 12, -3]) / 35
BESIDE = len(QUADRATIC) // 2


JUMP = np.radians(15.0), 0.06  # radians, metres: from one frame to the next such a step is a cut


def runs(rows: I64, fit: Fit) -> list[tuple[int, int]]:
    """(begin, end) of frames without a gap or a cut between; `rows` [T] their numbers in the film."""
    cosine = (np.einsum("tij,tij->t", fit.rotation[1:], fit.rotation[:-1]) - 1) / 2
    turned = np.arccos(np.clip(cosine, -1, 1))
    moved = np.linalg.norm(np.diff(fit.translation, axis=0), axis=1)
    breaks = np.flatnonzero((np.diff(rows) > 1) | (turned > JUMP[0]) | (moved > JUMP[1])) + 1
    edges = [0, *breaks.tolist(), len(rows)]
    return list(pairwise(edges))


def smoothed(fit: Fit, frames: I64) -> Fit:
    """`fit` with smoothed pose and weights, but not across gaps and cuts; `frames` [T] their numbers in the film."""
    rotation, translation, weights = fit.rotation.copy(), fit.translation.copy(), fit.weights.copy()
    for begin, end in runs(frames, fit):
        if end - begin <= 2 * BESIDE:
            continue
        rows = slice(begin, end)
        u, _, vt = np.linalg.svd(_filtered(fit.rotation[rows].reshape(end - begin, 9)).reshape(-1, 3, 3))
        rotation[rows] = u @ vt
        translation[rows] = _filtered(fit.translation[rows])
        weights[rows] = np.clip(_filtered(fit.weights[rows]), 0, 1)
    return replace(fit, rotation=rotation, translation=translation, weights=weights)


def _filtered(values: F64) -> F64:
    """[T, N] smoothed; the first and the last frames stay as they are."""
    result = values.copy()
    count = len(values) - 2 * BESIDE
    result[BESIDE : BESIDE + count] = sum(share * values[k : k + count] for k, share in enumerate(QUADRATIC))
    return result
