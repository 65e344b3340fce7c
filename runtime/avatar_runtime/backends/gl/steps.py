"""Stages queued one after another; optionally each one is timed."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeVar

import moderngl

from avatar_runtime.posed import Clock

T = TypeVar("T")


class Steps:
    """The stages of one frame."""

    def __init__(self, context: moderngl.Context, clock: Clock | None) -> None:
        """With `clock` None the stages are queued without waiting; else each is waited for and its wall time noted."""
        self._context, self._clock = context, clock

    def run(self, stage: str, queue: Callable[[], T]) -> T:
        """What `queue` returns; it queues the kernels of `stage`."""
        if self._clock is None:
            return queue()

        def finished() -> T:
            result = queue()
            self._context.finish()
            return result

        return self._clock.timed(stage, finished)


def clocked(context: moderngl.Context, clock: Clock, each: bool, run: Callable[[Steps], T]) -> T:
    """What `run` returns; if `each`, `clock` gets one entry per stage, else one entry `gl`."""
    if each:
        return run(Steps(context, clock))
    return clock.timed("gl", lambda: run(Steps(context, None)))
