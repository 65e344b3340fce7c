"""Progress of training: a bar on a terminal, a line every ten seconds elsewhere."""

from __future__ import annotations

import sys
import time
from datetime import timedelta

from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from avatar_export.commands import console


def note(text: str) -> None:
    """A line of its own, above a bar."""
    console.messages.print(f"note: {text}")


class TrainProgress:
    """`with` it around a run of `total` iterations of which `done` are."""

    def __init__(self, total: int, done: int) -> None:
        self._total, self._first = total, done
        self._bar = Progress(
            TextColumn("training"),
            BarColumn(),
            MofNCompleteColumn(),
            TimeRemainingColumn(),
            TextColumn("{task.fields[state]}"),
            console=console.messages,
            disable=not sys.stderr.isatty(),
        )
        self._task = self._bar.add_task("", total=total, completed=done, state="")
        self._began: float | None = None  # the end of the first iteration, in which kernels are compiled
        self._spoke = time.monotonic()

    def __enter__(self) -> TrainProgress:
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def update(self, iteration: int, psnr_db: float, gaussians: int) -> None:
        """After an iteration; psnr_db of the images that it was trained on last."""
        state = f"{psnr_db:.2f} dB on training images, {gaussians} Gaussians"
        self._bar.update(self._task, completed=iteration, state=state)
        now = time.monotonic()
        if self._began is None:
            self._began, self._first = now, iteration
        if self._bar.disable and (now - self._spoke >= console.SECONDS or iteration == self._total):
            self._spoke = now
            console.messages.print(
                f"iteration {iteration} of {self._total}, {state}, {self._left(iteration, now)} left"
            )

    def _left(self, iteration: int, now: float) -> str:
        if self._began is None or iteration == self._first:
            return "?"
        each = (now - self._began) / (iteration - self._first)
        return str(timedelta(seconds=round(each * (self._total - iteration))))
