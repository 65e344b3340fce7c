"""The process that trains: reproducible numbers, and errors that say what to do when memory or disk runs out."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
import torch

from avatar_runtime import AvatarError
from avatar_runtime.backends.cpu import thread_count
from avatar_runtime.io import MemoryShortage

OUT_OF_MEMORY = ("can't allocate memory", "not enough memory", "out of memory")  # torch's, in a RuntimeError


@contextmanager
def reproducible(seed: int, threads: int) -> Iterator[None]:
    """The same numbers each time: torch's generator seeded, its deterministic kernels, a fixed thread count.

    threads: of Numba's kernels; 0: one per core. torch computes on one thread, since its remaining work is small and
    its sums depend on the number of threads. All settings are restored afterwards.
    """
    count, kernels = thread_count(threads or None), numba.get_num_threads()
    before = torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()
    memory: Any = torch.utils.deterministic  # a module whose one attribute is set by assignment
    fill = memory.fill_uninitialized_memory
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        numba.set_num_threads(count)  # first: if it starts Numba's pool, that sets torch's count too
        torch.set_num_threads(1)
        torch.use_deterministic_algorithms(True)
        memory.fill_uninitialized_memory = False  # nothing reads it, and it costs a pass
        try:
            yield
        finally:
            numba.set_num_threads(kernels)
            memory.fill_uninitialized_memory = fill
            torch.use_deterministic_algorithms(before[1])
            torch.set_num_threads(before[0])


@contextmanager
def memory_advice() -> Iterator[None]:
    """Turns running out of memory into a MemoryShortage that says what to lower."""
    try:
        yield
    except (MemoryError, RuntimeError) as error:
        if isinstance(error, MemoryError) or any(text in str(error) for text in OUT_OF_MEMORY):
            raise MemoryShortage(
                "memory ran out; lower --gaussians (and --set density.max_gaussians), --size or --sh-degree, or "
                "--set cache_megabytes"
            ) from None
        raise


@contextmanager
def disk_advice(out: Path) -> Iterator[None]:
    """Turns an error of the operating system while `out` is written into an AvatarError that names the path."""
    try:
        yield
    except OSError as error:
        if error.errno is None:  # not an error of the disk: a download
            raise
        raise AvatarError(
            f"cannot be written ({error.strerror or error})", file=error.filename or out
        ) from None
