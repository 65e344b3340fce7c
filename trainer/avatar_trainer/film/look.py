"""The first pass over a film: the landmarks of every frame, and the square that becomes the capture's image."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
import numpy.typing as npt

from avatar_runtime import F32, F64, I64
from avatar_trainer.film.fit.landmark_fit import CHIN, FOREHEAD
from avatar_trainer.film.judge import glance
from avatar_trainer.film.networks import LANDMARKS, Networks
from avatar_trainer.film.track import Looked

SCORES = 52
# Around the landmarks of all frames, in heights of the face: hair above, ears beside, the neck below.
ABOVE, BESIDE, BELOW = 0.62, 0.40, 0.50
OUTLIERS = 0.02  # share of the frames that may reach further

Picture = npt.NDArray[np.uint8]


def look(
    frames: Iterable[tuple[int, float, Picture]], networks: Networks, said: Callable[[int], None]
) -> Looked:
    """The faces of all frames."""
    rows: list[tuple[float, F64, F32, F64, int, tuple[float, ...]]] = []
    width = height = 0
    small: F64 | None = None
    for _, time, picture in frames:
        height, width = picture.shape[:2]
        face = networks.face(picture)
        seen, small = glance(picture, None if face is None else face.landmarks, small)
        if face is None:
            rows.append((time, np.zeros((LANDMARKS, 2)), np.zeros(SCORES, np.float32), np.eye(3), 0, seen))
        else:
            rows.append((time, face.landmarks, face.scores, face.rotation, face.faces, seen))
        said(len(rows))
    times, landmarks, scores, rotation, faces, glances = zip(*rows, strict=True) if rows else ((),) * 6
    return Looked(
        np.array(times),
        width,
        height,
        np.array(landmarks).reshape(-1, LANDMARKS, 2),
        np.array(scores, np.float32).reshape(-1, SCORES),
        networks.score_names,
        np.array(rotation).reshape(-1, 3, 3),
        np.array(faces, np.int64),
        np.array(glances, np.float32).reshape(-1, 3),
    )


def square(looked: Looked) -> tuple[float, float, float]:
    """(left, top, side) in pixels of the frames: the head in all of them; it may reach beyond the frame."""
    places = looked.landmarks[looked.seen, :468]
    face = float(np.median(np.linalg.norm(places[:, FOREHEAD] - places[:, CHIN], axis=-1)))
    low = np.quantile(places.min(axis=1), OUTLIERS, axis=0) - face * np.array([BESIDE, ABOVE])
    high = np.quantile(places.max(axis=1), 1 - OUTLIERS, axis=0) + face * np.array([BESIDE, BELOW])
    low, high = np.maximum(low, 0), np.minimum(high, (looked.width, looked.height))
    side = float(min(max(high - low), looked.width, looked.height))
    middle = (low + high) / 2
    corner = np.clip(middle - side / 2, 0, np.array([looked.width, looked.height]) - side)
    return float(corner[0]), float(corner[1]), side


def spread_out(looked: Looked, count: int) -> I64:
    """At most `count` frames that differ most in pose and expression, the first one near the middle of all.

    Each further one is the one farthest from all before it; so a blink or a turn that comes once is among them.
    """
    rows = np.flatnonzero(looked.seen)
    at = looked.landmarks[rows]
    middle = at[:, :468].mean(axis=1, keepdims=True)
    size = np.linalg.norm(at[:, FOREHEAD] - at[:, CHIN], axis=-1)[:, None, None]
    shape = ((at - middle) / size)[:, ::6].reshape(len(rows), -1)
    feature = np.concatenate([shape / np.maximum(shape.std(), 1e-6) / 4, looked.scores[rows]], axis=1)
    chosen = [int(np.linalg.norm(feature - np.median(feature, axis=0), axis=1).argmin())]
    away = np.linalg.norm(feature - feature[chosen[0]], axis=1)
    while len(chosen) < min(count, len(rows)):
        chosen.append(int(away.argmax()))
        away = np.minimum(away, np.linalg.norm(feature - feature[chosen[-1]], axis=1))
    found: I64 = rows[np.sort(chosen)]
    return found
