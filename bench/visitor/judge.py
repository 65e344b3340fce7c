"""Compares the channels that a page saw with the true ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from avatar_runtime.driving.arkit import ARKIT_NAMES
from bench.visitor.takes import Array

ANGLES = ("yaw", "pitch", "roll")
LAGS = range(-2, 9)  # frames that are tried
LEAST_RANGE = 0.1  # of a true weight that is judged
HEAD = len(ARKIT_NAMES)  # where the head's angles begin in a frame


@dataclass(frozen=True)
class Part:
    """One take: true and seen channels [F, 61] of the frames that were looked at."""

    true: Array
    seen: Array

    def r(self, name: str) -> float:
        """Pearson's correlation of a weight; nan where it hardly moves, 0 where it is not seen to move."""
        true, seen = (part[:, ARKIT_NAMES.index(name)] for part in (self.true, self.seen))
        if np.ptp(true) < LEAST_RANGE:
            return float("nan")
        return float(np.corrcoef(true, seen)[0, 1]) if np.ptp(seen) > 1e-6 else 0.0

    def range(self, name: str) -> tuple[float, float]:
        """(the most that was seen, the most that was shown)."""
        at = ARKIT_NAMES.index(name)
        return float(self.seen[:, at].max()), float(self.true[:, at].max())

    def off(self) -> Array:
        """[F, 3] degrees by which the head's angles are wrong."""
        at = slice(HEAD, HEAD + 3)
        result: Array = np.degrees(self.seen[:, at] - self.true[:, at])
        return result


@dataclass(frozen=True)
class Judged:
    """Every take, and how late the page is."""

    parts: Mapping[str, Part]
    lag_frames: float  # by which what is seen follows what is true best
    answered_ms: float  # from the picture to its channels, median
    looked_at: float  # share of the pictures


def judged(rows: list[dict[str, Any]], true: Array, places: Mapping[str, slice]) -> Judged:
    """`rows` as bench/visitor.mjs writes them; `places` of the takes in `true` [F, 61]."""
    live = [row for row in rows if row["seen"] == "live"]
    number = np.array([row["number"] for row in live])
    rising = np.flatnonzero(np.diff(number) < -len(true) // 2)
    end = int(rising[0]) + 1 if len(rising) else len(live)  # the film begins again
    number, seen = number[:end], np.array([row["channels"] for row in live[:end]])
    parts = {}
    for name, place in places.items():
        inside = (number >= place.start) & (number < place.stop)
        parts[name] = Part(true[number[inside]], seen[inside])
    waited = [row["answeredMs"] - row["ms"] for row in live]
    return Judged(parts, _lag(number, seen, true), float(np.median(waited)), len(set(number)) / len(true))


def _lag(number: Array, seen: Array, true: Array) -> float:
    """Frames: the shift of the true jaw, lids and head at which what is seen correlates best."""
    names = [ARKIT_NAMES.index(name) for name in ("jawOpen", "eyeBlinkLeft", "eyeBlinkRight")]
    columns = [*names, HEAD, HEAD + 1, HEAD + 2]
    inside = (number >= LAGS.stop) & (number < len(true) + LAGS.start)
    scores = [
        np.mean([np.corrcoef(true[number[inside] - lag, c], seen[inside, c])[0, 1] for c in columns])
        for lag in LAGS
    ]
    best = min(max(int(np.argmax(scores)), 1), len(LAGS) - 2)
    before, at, after = scores[best - 1 : best + 2]
    return float(LAGS[best] + 0.5 * (before - after) / (before - 2 * at + after))


def table(found: Judged) -> Iterator[str]:
    """Lines for a person: r, and the most that was seen of the most that was shown."""
    yield f"{'':20}" + "".join(f"{name:>22}" for name in found.parts)
    for name in ARKIT_NAMES:
        cells = []
        for part in found.parts.values():
            r, (most, shown) = part.r(name), part.range(name)
            cells.append("-" if np.isnan(r) else f"{r:.2f}  ({most:.2f} of {shown:.2f})")
        yield f"{name:20}" + "".join(f"{cell:>22}" for cell in cells)
    means = [np.nanmean([part.r(name) for name in ARKIT_NAMES]) for part in found.parts.values()]
    yield f"{'mean':20}" + "".join(f"{mean:>22.2f}" for mean in means)
    for at, angle in enumerate(ANGLES):
        cells = []
        for part in found.parts.values():
            off = part.off()[:, at]
            cells.append(
                f"{np.sqrt(np.mean(off**2)):.1f}, most {np.abs(off).max():.1f}, mean {off.mean():.1f}"
            )
        yield f"{'head ' + angle + ', degrees':20}" + "".join(f"{cell:>30}" for cell in cells)
    yield f"lag {found.lag_frames:.1f} frames; answer in {found.answered_ms:.0f} ms; {found.looked_at:.0%} looked at"
