"""Vectors of idle life for every player.

    python -m tests.conformance.idle_vectors

rewrites `idle.json`. No code of the project is used, only its table of numbers: all glances and blinks of half a minute
are laid out, and their parts at a time are summed, while the project looks up the few that matter.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

FILE = Path(__file__).with_name("idle.json")
SCHEMA = Path(__file__).parents[2] / "schema" / "avatar_schema" / "v1"
TABLE = {name: row["value"] for name, row in json.loads((SCHEMA / "idle.json").read_text("utf-8")).items()}
SPLINE = np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6  # powers of x -> knots
LEAST_JERK = [6, -15, 10, 0, 0, 0]
AROUND_S = 15.0
EYES_PER_WEIGHT = 0.609  # radians
Array = npt.NDArray[Any]
TIMES = (0.0, 1.0, 7.34, 9.2, 33.21, 61.5, 599.75, 3601.125, -0.25, -77.7, 86400.3, 1e9)
SEEDS = (0, 1, 2**32 - 1)


def random(seed: int, stream: int, index: Array) -> Array:
    """Numbers from 0 to below 1."""

    def mixed(bits: Array) -> Array:
        for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35)):
            bits = (bits ^ bits >> np.uint32(shift)) * np.uint32(factor)
        return bits ^ bits >> np.uint32(16)

    key = mixed(np.array([(seed + stream * 0x9E3779B9) % 2**32], np.uint32))
    return mixed(key ^ (index % 2**32).astype(np.uint32)) / 2.0**32


def curve(knots: float, seed: int, stream: int) -> float:
    first = int(np.floor(knots))
    values = 2 * random(seed, stream, np.arange(first - 1, first + 3)) - 1
    return float((knots - first) ** np.arange(4) @ SPLINE @ values)


def eased(part: Array) -> Array:
    return np.polyval(LEAST_JERK, np.clip(part, 0, 1))


class Glances:
    """All fixations about a time."""

    def __init__(self, seconds: float, seed: int) -> None:
        every = TABLE["fixation_every_s"]
        at = np.arange(int((seconds - AROUND_S) // every), int((seconds + AROUND_S) // every))
        self.start = every * (at + TABLE["fixation_window"] * random(seed, 3, at))
        on_viewer = random(seed, 4, at) < TABLE["gaze_viewer_chance"]
        yaw, pitch = 2 * random(seed, 5, at) - 1, 2 * random(seed, 6, at) - 1
        near = [size * value for size, value in zip(TABLE["gaze_viewer_deg"], (yaw, pitch), strict=True)]
        aside = np.where(yaw >= 0, 0.4, -0.4) + 0.6 * yaw
        away = [size * value for size, value in zip(TABLE["gaze_away_deg"], (aside, pitch), strict=True)]
        self.target = np.where(on_viewer, near, away)  # [2, fixations] degrees
        self.change = np.diff(self.target, axis=1, prepend=self.target[:, :1])
        self.size = np.hypot(*self.change)

    def at(self, since: Array, duration: Array | float) -> Array:
        """Where all shifts have led, [2]: each takes a duration."""
        return self.target[:, 0] + self.change @ eased(since / duration)


def blinks(seconds: float, seed: int, glances: Glances) -> float:
    every, window = TABLE["blink_every_s"], TABLE["blink_window"]
    closed = 0.0
    for slot in range(int(seconds // every) - 1, int(seconds // every) + 2):
        inside = (glances.start >= slot * every) & (glances.start < (slot + window) * every)
        chosen = np.where(inside, glances.size, 0).argmax()
        own = every * (slot + window * random(seed, 1, np.array([slot]))[0])
        large = inside[chosen] and glances.size[chosen] > TABLE["blink_with_gaze_deg"]
        starts = [glances.start[chosen] if large else own]
        if random(seed, 2, np.array([slot]))[0] < TABLE["blink_pair_chance"]:
            starts.append(starts[0] + TABLE["blink_pair_s"])
        closed += sum(lids(seconds - start) for start in starts)
    return closed


def lids(since: float) -> float:
    shut = TABLE["blink_close_s"] + TABLE["blink_closed_s"]
    if since < shut:
        return float(eased(np.array(since / TABLE["blink_close_s"])))
    left = max(1 - (since - shut) / TABLE["blink_open_s"], 0)
    return 4 * left**3 - 3 * left**4


def frame(seconds: float, seed: int) -> dict[str, float]:
    """The channels that are not zero, and zeros."""
    found: dict[str, float] = {}

    def add(names: str, size: float, angle: float, weight: float) -> None:
        for name in names.split():
            value = np.radians(size) * angle if name.startswith("head") else size * weight
            found[name] = found.get(name, 0.0) + float(value)

    for row, (names, knot_s, size) in enumerate(TABLE["wander"]):
        value = curve(seconds / knot_s, seed, 10 + row)
        add(names, size, value, 1 + value)
    part, knot_s = TABLE["breath_drift"]
    breath = (seconds / TABLE["breath_every_s"] + part * curve(seconds / knot_s, seed, 9)) % 1
    blown = eased(np.array((breath - TABLE["breath_in"]) / TABLE["breath_out"]))
    full = float(eased(np.array(breath / TABLE["breath_in"])) - blown)
    for names, size in TABLE["breath"]:
        add(names, size, full, full)
    glances = Glances(seconds, seed)
    since = seconds - glances.start
    gaze = glances.at(since, TABLE["saccade_s"] + TABLE["saccade_s_per_deg"] * glances.size)
    head = glances.at(since - TABLE["head_delay_s"], TABLE["head_turn_s"])
    knot_s, size = TABLE["gaze_wander"]
    for axis, (angle, more, less) in enumerate(
        (("Yaw", "OutLeft InRight", "InLeft OutRight"), ("Pitch", "UpLeft UpRight", "DownLeft DownRight"))
    ):
        add(f"head{angle}", TABLE["head_share"], head[axis], 0)
        drifted = gaze[axis] + size * curve(seconds / knot_s, seed, 7 + axis)
        turn = float(np.radians(drifted)) - found[f"head{angle}"]
        found[f"leftEye{angle}"] = found[f"rightEye{angle}"] = -turn
        for way in (more if turn > 0 else less).split():
            found[f"eyeLook{way}"] = abs(turn) / EYES_PER_WEIGHT
    found["eyeBlinkLeft"] = found["eyeBlinkRight"] = blinks(seconds, seed, glances)
    return found


def cases() -> list[tuple[float, int]]:
    """Times and seeds: far apart, in glances, in blinks of which some come in pairs."""
    found = [(seconds, seed) for seconds, seed in zip(TIMES, SEEDS * len(TIMES), strict=False)]
    for seed in SEEDS:
        glance = Glances(15.0, seed)
        found += [(float(glance.start[k] + 0.4 * glance.size[k] * 0.003 + 0.008), seed) for k in (4, 9)]
        moments = np.arange(0, 60, 1 / 30)
        blinking = [float(t) for t in moments if frame(t, seed)["eyeBlinkLeft"] > 0]
        found += [(seconds, seed) for seconds in blinking[3::50]]
    return found


def made() -> list[dict[str, Any]]:
    """What the file holds."""
    rows = []
    for seconds, seed in cases():
        channels = {name: float(f"{value:.12g}") for name, value in frame(seconds, seed).items()}
        rows.append({"seconds": seconds, "seed": seed, "channels": channels})
    return rows


if __name__ == "__main__":
    FILE.write_text("[\n" + ",\n".join(map(json.dumps, made())) + "\n]\n", "utf-8")
