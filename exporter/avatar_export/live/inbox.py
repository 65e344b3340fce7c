"""Frames that arrive, from any sender: checked, counted, and passed on one by one. Nothing is kept.

A flood of packets costs time, not memory, and a line at most every few seconds.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from avatar_export.driving.frames import CHANNEL_LIMIT
from avatar_runtime.driving.arkit import CHANNELS

QUIET = 5.0  # seconds between two lines about packets that were not understood
MOST_SENDERS = 8  # that are named
LONGEST = 60  # letters of a stranger's text in a line


@dataclass(frozen=True)
class LiveFrame:
    """One frame: 61 numbers in the order of arkit.CHANNELS."""

    received: float  # seconds since the inbox was made
    sent: float | None  # seconds by the sender's clock, if it tells
    channels: tuple[float, ...]


class Inbox:
    """Takes frames of all senders; the newest counts, whoever sent it."""

    def __init__(
        self,
        take: Callable[[LiveFrame], None],
        say: Callable[[str], None],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        """`take` gets every sound frame, `say` lines for a person. `clock` is in seconds."""
        self._take, self._say, self._clock = take, say, clock
        self._start = clock()
        self._senders: set[str] = set()
        self._quiet_until = -1.0
        self._last_reason = ""
        self.frames = 0
        self.nonsense = 0  # packets that were not understood
        self._unsaid = 0

    def now(self) -> float:
        """Seconds since the inbox was made."""
        return self._clock() - self._start

    def frame(self, sender: str, channels: Sequence[float], sent: float | None = None) -> None:
        """A frame of a sender, 61 channels."""
        if len(channels) != len(CHANNELS) or not all(abs(value) <= CHANNEL_LIMIT for value in channels):
            self.refuse(sender, "a number is neither a weight nor an angle in radians")
            return
        if sender not in self._senders and len(self._senders) < MOST_SENDERS:
            self._senders.add(sender)
            self._say(f"live: motion from {plain(sender)}")
        self.frames += 1
        self._take(LiveFrame(self.now(), sent, tuple(map(float, channels))))

    def refuse(self, sender: str, reason: str) -> None:
        """A packet that was not understood, and why."""
        self.nonsense += 1
        self._unsaid += 1
        self._last_reason = f"{plain(sender)}: {plain(reason)}"
        if self.now() >= self._quiet_until:
            self.flush()

    def flush(self) -> None:
        """Says what was not said about packets that were not understood."""
        if not self._unsaid:
            return
        many = f"{self._unsaid} packets were" if self._unsaid > 1 else "a packet was"
        self._say(f"live: {many} not understood; the last from {self._last_reason}")
        self._unsaid = 0
        self._quiet_until = self.now() + QUIET


def plain(text: str) -> str:
    """A stranger's text for a line on a terminal: short, and without what a terminal obeys."""
    shown = "".join(c if c.isprintable() else "?" for c in text[: 2 * LONGEST])
    return shown if len(shown) <= LONGEST else f"{shown[:LONGEST]}..."
