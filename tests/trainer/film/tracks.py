"""The track of a good film, made up."""

from __future__ import annotations

import numpy as np

from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.film.track import Track

FRAMES, SIZE = 300, 512
FACING = np.diag([1.0, -1.0, -1.0])  # camera from head
SCORES = (
    "jawOpen", "mouthSmileLeft", "mouthSmileRight", "browOuterUpLeft", "browOuterUpRight", "browDownLeft",
    "browDownRight", "mouthPucker", "eyeBlinkLeft", "eyeBlinkRight",
)  # fmt: skip


def turned(degrees: np.ndarray, axis: int) -> np.ndarray:
    """Poses of a head that turns about an axis of its own."""
    turns = np.zeros((len(degrees), 3))
    turns[:, axis] = np.radians(degrees)
    return np.asarray(FACING @ matrix_from_rotvec(turns))


def good() -> Track:
    """A film of ten seconds in which a face of 200 pixels turns by 35 degrees and shows everything."""
    time = np.arange(FRAMES) / 30
    chance = np.random.default_rng(1)
    face = chance.uniform(-1, 1, (478, 2)) * (80, 100)
    face[[10, 152]] = (0, -100), (0, 100)
    face[[234, 454]] = (-80, 0), (80, 0)
    middle = np.stack([256 + 40 * np.sin(time), 250 + 10 * np.cos(time)], 1)
    scores = np.zeros((FRAMES, len(SCORES)), np.float32)
    for k in range(len(SCORES)):
        scores[20 * k + 10 : 20 * k + 50, k] = 0.8
    wave = 1 + 0.05 * np.sin(np.arange(FRAMES))
    return Track(
        width=SIZE,
        height=SIZE,
        fps=30.0,
        times=time,
        corner=np.zeros(2),
        scale=1.0,
        focal=1000.0,
        principal=np.full(2, SIZE / 2),
        identity=np.zeros(60),
        names=("jawOpen",),
        weights=np.zeros((FRAMES, 1), np.float32),
        rotation=turned(35 * np.sin(time), 1),
        translation=np.tile((0.0, 0.0, 0.6), (FRAMES, 1)),
        seen=np.ones(FRAMES, bool),
        landmarks=(middle[:, None] + face).astype(np.float32),
        scores=scores,
        score_names=SCORES,
        faces=np.ones(FRAMES, np.int64),
        residual_px=np.ones(FRAMES, np.float32),
        glances=np.stack([0.2 * wave, 120 * wave, 2 * wave], axis=1).astype(np.float32),
        turned=0,
    )
