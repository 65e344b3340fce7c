"""How the filmed heads move: recorded and performed expressions, and a head that turns, bows and leans."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from samples.capture.head import exercises
from samples.capture.unseen import recorded as talked
from samples.subjects.take import recording

Array = npt.NDArray[Any]

FPS = 30.0
TALK_FPS = 60.0  # of the second recording
# The head, degrees: turn, bow, lean; how far the trunk does the same.
TURN, TRUNK = (12.0, 30.0, 6.0), (0.12, 0.2, 0.3)
PERIOD = (3.0, 6.5)  # seconds of the slowest and the fastest beat of a turn
NEARER, ASIDE = 0.12, (0.025, 0.012, 0.0)  # share of the distance; metres
BLINK = 0.26  # seconds of a blink
BLINKS_APART, SMILES_APART = 2.6, 6.0  # seconds, on average
SMILE, JAW = 1.4, 0.7  # seconds of a smile, of an open mouth
EXERCISED, EACH = 0.2, 0.5  # of the frames, the last ones: single expressions; seconds of each


@dataclass(frozen=True)
class Motion:
    """T frames."""

    weights: Array  # [T, names], 0..1
    root: Array  # [T, 3] rotation vectors of the trunk
    neck: Array  # [T, 3] of the neck on the trunk
    shift: Array  # [T, 3] metres, of the whole figure; z is the share of the distance that it comes nearer


def motion(names: tuple[str, ...], frames: int, seed: int) -> Motion:
    """Recorded expressions from a place of their own, blinks, smiles and an opening jaw between them; a moving head."""
    rng = np.random.default_rng(seed)
    turn = np.radians(TURN) * np.stack([_sway(frames, rng) for _ in range(3)], axis=1)
    trunk = turn * TRUNK
    shift = np.stack([_sway(frames, rng) for _ in range(3)], axis=1) * (*ASIDE[:2], NEARER)
    return Motion(_weights(names, frames, rng), trunk, turn - trunk, shift)


def _sway(frames: int, rng: np.random.Generator) -> Array:
    """[frames] a smooth wave whose largest value is 1: two beats."""
    time = np.arange(frames) / FPS
    beats = 1 / rng.uniform(*PERIOD, 2)
    phase = rng.uniform(0, 2 * np.pi, 2)
    wave = np.sin(2 * np.pi * beats[0] * time + phase[0]) + 0.5 * np.sin(
        2 * np.pi * beats[1] * time + phase[1]
    )
    result: Array = wave / max(np.abs(wave).max(), 1.0)
    return result


def _weights(names: tuple[str, ...], frames: int, rng: np.random.Generator) -> Array:
    """Weights [frames, names]."""
    columns, values = recording()
    moved = np.zeros((len(values), len(names)))
    for k, name in enumerate(names):
        if name in columns:
            moved[:, k] = values[:, columns.index(name)]
    talk = talked(names)[:: round(TALK_FPS / FPS)]
    lone = round(frames * EXERCISED)
    both = _looped(_joined(moved, talk), frames - lone, int(rng.integers(len(moved) + len(talk))))
    single = np.zeros((lone, len(names)))
    shown = rng.permutation(len(names))[: max(round(lone / (EACH * FPS)), 1)]
    single[:, shown] = exercises(len(shown), lone)
    result = _smooth(_joined(both, single))
    for chosen, length, apart in (
        (("eyeBlinkLeft", "eyeBlinkRight"), BLINK, BLINKS_APART),
        (("mouthSmileLeft", "mouthSmileRight"), SMILE, SMILES_APART),
        (("jawOpen",), JAW, SMILES_APART),
    ):
        columns_of = [names.index(name) for name in chosen]
        bump = _bumps(frames, length, apart, rng)[:, None]
        result[:, columns_of] = np.maximum(result[:, columns_of], bump)
    return np.clip(result, 0, 1)


def _joined(before: Array, after: Array, edge: int = 8) -> Array:
    """Both, one after the other; the last rows before and the first after fade to rest."""
    before, after = before.copy(), after.copy()
    fade = np.linspace(1, 0, edge + 2)[1:-1, None]
    n, m = min(edge, len(before)), min(edge, len(after))
    if n:
        before[-n:] *= fade[-n:]
    if m:
        after[:m] *= fade[::-1][:m]
    return np.concatenate([before, after])


def _smooth(values: Array) -> Array:
    """Rows averaged with those before and after."""
    padded = np.concatenate([values[:1], values, values[-1:]])
    result: Array = (padded[:-2] + 2 * padded[1:-1] + padded[2:]) / 4
    return result


def _looped(values: Array, frames: int, first: int) -> Array:
    """`frames` rows from row `first` on, beginning anew at the end."""
    result: Array = values[(first + np.arange(frames)) % len(values)]
    return result


def _bumps(frames: int, length: float, apart: float, rng: np.random.Generator) -> Array:
    """[frames] 0..1: rises and falls of `length` seconds, `apart` seconds from one to the next on average."""
    time, result = np.arange(frames) / FPS, np.zeros(frames)
    begin = rng.uniform(0.2, apart)
    while begin < frames / FPS:
        x = np.clip((time - begin) / length, 0, 1)
        result = np.maximum(result, rng.uniform(0.75, 1.0) * np.minimum(1, 1.6 * np.sin(np.pi * x) ** 2))
        begin += length + apart * rng.uniform(0.6, 1.4)
    return result
