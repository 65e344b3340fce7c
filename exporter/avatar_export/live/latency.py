"""How long it takes from the arrival of a frame until a page says that it shows it."""

from __future__ import annotations

from collections import deque
from statistics import median

KEPT = 6000  # newest measurements, of which the median is shown
LONGEST = 60.0  # seconds; what is longer is no answer to a frame


class Latency:
    """Collects times, in seconds."""

    def __init__(self) -> None:
        self._newest: deque[float] = deque(maxlen=KEPT)
        self._worst = 0.0
        self._count = 0
        self._said = 0

    def add(self, seconds: float) -> None:
        """One frame that was shown `seconds` after it had arrived."""
        if 0 <= seconds <= LONGEST:
            self._newest.append(seconds)
            self._worst = max(self._worst, seconds)
            self._count += 1

    def line(self) -> str | None:
        """Median and worst for a person, or None if nothing came since the last line."""
        if self._count == self._said:
            return None
        self._said = self._count
        return (
            f"live: packet to picture {1e3 * median(self._newest):.0f} ms (median), "
            f"{1e3 * self._worst:.0f} ms (worst), {self._count} frames"
        )
