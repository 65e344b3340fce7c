"""Writes live frames as a Live Link Face CSV, which `--drive`, `--clip` and the viewer page play.

The timecode counts 60 frames a second from 00:00:00:59, so that every reader finds that rate from the first row. Rows
are written as they come to a file beside the output, which gets its name at the end.
"""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

from avatar_export.live.inbox import LiveFrame
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.io.staging import partial_of

RATE = 60  # frames of the timecode a second
FIRST = 59 / RATE  # seconds of the first row
SHORTEST = 1 / 250  # seconds between two rows: a flood does not fill the disk
DRIFT = 1.0  # seconds by which the sender's clock may leave ours before it is set again


class Recorder:
    """One recording. Frames without a newer time are left out."""

    def __init__(self, out: Path) -> None:
        """Raises OSError if the file cannot be written."""
        self.rows = 0
        self.out, self._partial = out, partial_of(out)
        self._file: TextIO = self._partial.open("w", encoding="utf-8", newline="")
        titles = [channel[0].upper() + channel[1:] for channel in CHANNELS]
        self._file.write(",".join(["Timecode", "BlendShapeCount", *titles]) + "\n")
        self._offset: float | None = None  # seconds from the sender's clock to ours
        self._start = self._last = 0.0

    def add(self, frame: LiveFrame) -> None:
        """Writes a frame, at the time that its sender gave it where it gave one."""
        time = self._time(frame)
        if self.rows and time - self._last < SHORTEST:
            return
        if not self.rows:
            self._start = time
        self._last = time
        self.rows += 1
        values = ",".join(f"{value:.9g}" for value in frame.channels)
        self._file.write(f"{timecode(FIRST + time - self._start)},{len(CHANNELS)},{values}\n")

    def _time(self, frame: LiveFrame) -> float:
        if frame.sent is None:
            return frame.received
        if self._offset is None or abs(frame.sent + self._offset - frame.received) > DRIFT:
            self._offset = frame.received - frame.sent
        return frame.sent + self._offset

    def close(self) -> bool:
        """Ends the recording; whether there is one. Without a frame no file is written."""
        self._file.close()
        if self.rows:
            self._partial.replace(self.out)
        else:
            self._partial.unlink(missing_ok=True)
        return bool(self.rows)


def timecode(seconds: float) -> str:
    """HH:MM:SS:FF.sss of a time since midnight; after a day it begins again."""
    thousandths = round(seconds * RATE * 1000)
    whole, frames = divmod(thousandths, RATE * 1000)
    minutes, second = divmod(whole, 60)
    hours, minute = divmod(minutes, 60)
    return f"{hours % 24:02}:{minute:02}:{second:02}:{frames // 1000:02}.{frames % 1000:03}"
