"""What the tested heads do: channels [F, 61] in the order of CHANNELS, 30 frames a second. None was learnt from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.driving.takes import read_take
from avatar_runtime.driving.arkit import ARKIT_NAMES, CHANNELS

Array = npt.NDArray[Any]

FPS = 30
AT_REST = 75  # frames: 2 s in which the neutral face is learnt, and a start
REST = 10  # frames behind a part
RAMP, PAUSE = 20, 4  # frames up and down, and at rest behind it
TURN = 36  # frames of a turn of the head to both sides
TURNS = {"headYaw": 0.5, "headPitch": 0.35, "headRoll": 0.3}  # radians
TOGETHER = (  # beside every shape of both sides, and every shape without sides
    ("mouthSmileLeft",),
    ("eyeBlinkLeft",),
    ("browInnerUp", "browOuterUpLeft", "browOuterUpRight"),
    ("eyeLookInLeft", "eyeLookOutRight"),
    ("eyeLookOutLeft", "eyeLookInRight"),
    ("eyeLookUpLeft", "eyeLookUpRight"),
    ("eyeLookDownLeft", "eyeLookDownRight"),
)
KEYS, STEP = 20, 8  # mixed poses, and frames from one to the next
MIXED = {"headYaw": 0.35, "headPitch": 0.25, "headRoll": 0.2}  # radians, at most
RECORDING = Path(__file__).parents[2] / "samples" / "drive" / "live_link_face_rom_300.csv"


def still(frames: int = AT_REST) -> Array:
    """The neutral face."""
    return np.zeros((frames, len(CHANNELS)))


def shapes() -> list[tuple[str, ...]]:
    """What moves together in a ramp."""
    own = [
        name for name in ARKIT_NAMES if not name.startswith(("eyeLook", "mouthClose"))
    ]  # which needs an open jaw
    pairs = {
        name.replace("Right", "Left"): (name.replace("Right", "Left"), name.replace("Left", "Right"))
        for name in own
        if name.endswith(("Left", "Right")) and name not in ("mouthLeft", "mouthRight", "jawLeft", "jawRight")
    }
    alone = [(name,) for name in own if not any(name in pair for pair in pairs.values())]
    return [*pairs.values(), *alone, *TOGETHER]


def ramps(chosen: list[tuple[str, ...]] | None = None) -> Array:
    """One shape after the other from 0 to 1 and back, then turns of the head."""
    up = 1 - np.abs(np.arange(RAMP) / (RAMP / 2) - 1)
    parts = []
    for names in shapes() if chosen is None else chosen:
        rows = still(RAMP + PAUSE)
        for name in names:
            rows[:RAMP, CHANNELS.index(name)] = up
        parts.append(rows)
    wave = np.sin(2 * np.pi * np.arange(TURN) / TURN)
    for name, radians in TURNS.items():
        rows = still(TURN + PAUSE)
        rows[:TURN, CHANNELS.index(name)] = radians * wave
        parts.append(rows)
    return np.concatenate(parts)


def mixed(seed: int = 5) -> Array:
    """Poses at random of two to four shapes with gaze and a turned head, one flowing into the next."""
    rng = np.random.default_rng(seed)
    single = [
        name
        for name in ARKIT_NAMES
        if not name.startswith(("eyeLook", "cheekPuff", "tongueOut", "mouthClose"))
    ]
    keys = still(KEYS + 1)
    for row in keys[1:-1]:
        for name in rng.choice(single, rng.integers(2, 5), replace=False):
            other = name.replace("Left", "Right") if "Left" in name else name.replace("Right", "Left")
            both = rng.random() < 0.75 and not name.startswith(("jaw", "mouthLeft", "mouthRight"))
            row[[CHANNELS.index(one) for one in ((name, other) if both else (name,))]] = rng.uniform(0.3, 1)
        aside, above = rng.uniform(-0.7, 0.7, 2)
        for side, inwards in (("Left", -aside), ("Right", aside)):
            for way, angle in (("In", inwards), ("Out", -inwards), ("Up", above), ("Down", -above)):
                row[CHANNELS.index(f"eyeLook{way}{side}")] = max(angle, 0)
        for name, most in MIXED.items():
            row[CHANNELS.index(name)] = rng.uniform(-most, most)
    time = np.arange(KEYS * STEP) / STEP
    at, part = time.astype(int), (time % 1)[:, None]
    part = part * part * (3 - 2 * part)
    result: Array = keys[at] * (1 - part) + keys[at + 1] * part
    return result


def recorded(every: int = 2) -> Array:
    """A person's range of motion, recorded with Live Link Face."""
    return read_take(RECORDING).channels[::every]


def joined(parts: Mapping[str, Array]) -> Array:
    """The neutral face, then every part with a rest behind it."""
    rest = still(REST)
    return np.concatenate([still(), *(piece for part in parts.values() for piece in (part, rest))])


def places(parts: Mapping[str, Array]) -> dict[str, slice]:
    """Where each part lies in `joined`."""
    result, at = {}, AT_REST
    for name, part in parts.items():
        result[name] = slice(at, at + len(part))
        at += len(part) + REST
    return result
