"""A context and the objects made in it: buffers within the binding limit, and their release.

What nothing refers to any more is released too: at once in the thread of its context, else when that plays again.
"""

from __future__ import annotations

import operator
import threading
import weakref
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from avatar_runtime.backends.gl.context import current, forked, language_of, let_go, own_context
from avatar_runtime.program.chunks import too_large

LEAST_LIMIT = 1024  # bytes; a smaller one has no room even for the constants of a frame
LARGEST_LIMIT = (1 << 31) - 1  # bytes; sizes in OpenGL's interface are signed

_users: dict[int, int] = {}  # id of a context that we made -> how many Gpus play in it
_waiting: list[Held] = []  # dropped in other threads than their own


@dataclass(frozen=True)
class Held:
    """What a Gpu made, apart from it, so that it can be released when the Gpu is gone."""

    context: moderngl.Context
    thread: int = field(default_factory=threading.get_ident)
    items: list[Any] = field(default_factory=list)  # everything that has a release()


class Gpu:
    """One context, the shader language that it takes, and every buffer that we made in it."""

    def __init__(self, context: moderngl.Context | None, es: bool, limit: int) -> None:
        """`context` None makes one. Raises AvatarError if that fails or `context` is too old, ValueError for a
        limit out of range and for `es` with a context, TypeError for a limit that is not a whole number.
        """
        if not LEAST_LIMIT <= operator.index(limit) <= LARGEST_LIMIT:
            raise ValueError(f"buffer_limit is {limit} bytes; {LEAST_LIMIT} to {LARGEST_LIMIT} are taken")
        if context is not None and es:
            raise ValueError("es asks for a context of OpenGL ES; the context given is taken as it is")
        own = context is None
        self.context = own_context(es) if context is None else context
        self.limit = limit
        self._state = Held(self.context)
        self.held = self._state.items
        if own or id(self.context) in _users:
            _users[id(self.context)] = _users.get(id(self.context), 0) + 1
        self._release = weakref.finalize(self, _free, self._state)
        self._release.atexit = False  # the process takes everything with it
        with self.current():
            self.language = language_of(self.context)

    @contextmanager
    def current(self) -> Iterator[None]:
        """Our context is current inside; afterwards the caller's is current again.

        Raises ValueError in another thread than that which made it and after the release, AvatarError in a process
        that was forked from the one that made it.
        """
        if not self._release.alive:
            raise ValueError("this player is closed")
        if self._state.thread != threading.get_ident():
            raise ValueError(
                "a player on backend gl plays in the thread that made it; make one in each thread"
            )
        while mine := [held for held in _waiting if held.thread == threading.get_ident()]:
            _waiting.remove(mine[0])
            _free(mine[0])
        with current(self.context):
            yield

    def buffer(self, what: str, content: npt.NDArray[Any] | int) -> moderngl.Buffer:
        """A buffer with `content`, or of that many bytes. Raises AvatarError if it would exceed the limit."""
        size = content if isinstance(content, int) else content.nbytes
        if size > self.limit:
            raise too_large(what, size, self.limit)
        if isinstance(content, int) or size == 0:
            made = self.context.buffer(reserve=max(size, 16))  # GL has no empty buffers
        else:
            made = self.context.buffer(np.ascontiguousarray(content).tobytes())
        self.held.append(made)
        return made

    def hold(self, made: Any) -> Any:
        """`made`, to be released with the rest."""
        self.held.append(made)
        return made

    def drop(self, *made: Any) -> None:
        """Releases single objects before their time."""
        for item in made:
            self.held.remove(item)
            item.release()

    def release(self) -> None:
        """Releases everything, and the context if we made it and nobody else plays in it. Again, it does nothing."""
        self._release()


def _free(held: Held) -> None:
    if forked():
        return  # it belongs to the other process
    if held.thread != threading.get_ident():
        _waiting.append(held)
        return
    with current(held.context):
        while held.items:
            held.items.pop().release()
    left = _users.pop(id(held.context), None)
    if left == 1:
        let_go(held.context)
    elif left is not None:
        _users[id(held.context)] = left - 1
