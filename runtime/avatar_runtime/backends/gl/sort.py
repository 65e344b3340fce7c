"""One stable sort of all drawn splats, across all avatars and chunks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.backends.gl.interpreter import Chunk
from avatar_runtime.backends.gl.programs import Programs

PAIR, WORD = 8, 4  # bytes of (key, id), of a count
DIGITS, BITS, PASSES = 16, 4, 8
BLOCK = 1024  # pairs a thread group: AVATAR_SORT_BLOCK of sort.hlsli
NOT_DRAWN = 0xFFFFFFFF  # the key of splats without radius; sorts last


class Sort:
    """Pairs (key, id) of chunks that follow each other; an id counts through all of them."""

    def __init__(self, gpu: Gpu, programs: Programs, chunks: Sequence[Chunk]) -> None:
        """Raises AvatarError if all pairs together exceed the buffer limit: one sort cannot be split."""
        self._gpu = gpu
        counts = [chunk.run.count for chunk in chunks]
        self.count = sum(counts)
        self.first = np.cumsum([0, *counts])[:-1].tolist()  # id of each chunk's first splat
        blocks = -(-self.count // BLOCK)
        what = f"the sort of {self.count} splats"
        self.pairs = gpu.buffer(what, PAIR * self.count)
        other = gpu.buffer(what, PAIR * self.count)
        digits = gpu.buffer(what, WORD * DIGITS * blocks)
        self._keys = [
            programs.dispatch(
                "sort_keys",
                chunk.run.count,
                {"Projected": chunk.projected, "Pairs": self.pairs},
                {"count": chunk.run.count, "first": first},
            )
            for chunk, first in zip(chunks, self.first, strict=True)
        ]
        self._steps = []
        here, there = self.pairs, other
        for number in range(PASSES):
            buffers = {"Pairs": here, "PairsOut": there, "Counts": digits}
            values = {"count": self.count, "groups": blocks, "shift": BITS * number, "total": DIGITS * blocks}
            self._steps += [
                programs.dispatch("sort_count", self.count, buffers, values, BLOCK),
                programs.dispatch("sort_scan", 1, buffers, values),
                programs.dispatch("sort_scatter", self.count, buffers, values, BLOCK),
            ]
            here, there = there, here  # an even number of passes ends where it began

    def run(self) -> None:
        """Stage sort: front to back by view z, ties by id; splats that are not drawn come last."""
        barrier = self._gpu.context.memory_barrier
        for kernel in self._keys:
            kernel.run()
        barrier()
        for kernel in self._steps if self.count else ():
            kernel.run()
            barrier()

    def put(self, order: npt.NDArray[np.int64]) -> None:
        """Sets an order given from outside: ids of the drawn splats, front to back."""
        rest = np.setdiff1d(np.arange(self.count), order)
        pairs = np.full((self.count, 2), NOT_DRAWN, np.uint32)
        pairs[:, 1] = np.concatenate([order, rest])
        pairs[: len(order), 0] = 0
        self.pairs.write(pairs.tobytes())

    def take(self) -> npt.NDArray[np.int64]:
        """Ids of the drawn splats, front to back."""
        pairs = np.frombuffer(self.pairs.read(PAIR * self.count), np.uint32).reshape(-1, 2)
        order: npt.NDArray[np.int64] = pairs[pairs[:, 0] != NOT_DRAWN, 1].astype(np.int64)
        return order
