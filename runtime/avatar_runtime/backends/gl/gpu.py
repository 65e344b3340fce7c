"""A context and the objects made in it: buffers within the binding limit, and their release."""

from __future__ import annotations

import operator
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from avatar_runtime.backends.gl.context import current, language_of, let_go, own_context
from avatar_runtime.program.chunks import too_large

LEAST_LIMIT = 1024  # bytes; a smaller one has no room even for the constants of a frame
LARGEST_LIMIT = (1 << 31) - 1  # bytes; sizes in OpenGL's interface are signed


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
        self._own = context is None
        self.context = own_context(es) if context is None else context
        self.limit = limit
        self.held: list[Any] = []  # everything that has a release()
        with self.current():
            self.language = language_of(self.context)

    @contextmanager
    def current(self) -> Iterator[None]:
        """Our context is current inside; afterwards the caller's is current again."""
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
        """Releases everything, and the context if we made it."""
        with self.current():
            while self.held:
                self.held.pop().release()
        if self._own:
            let_go(self.context)
            self._own = False
