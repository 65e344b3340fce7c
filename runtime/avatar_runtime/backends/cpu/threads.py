"""How many threads the kernels use: each backend chooses, not the process.

The kernels of this package run on threads of Python (`workers`), those of the trainer on Numba's own (`using`).
"""

from __future__ import annotations

import operator
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext

import numba
from numba.core import config

from avatar_runtime.io.errors import AvatarError

MOST = 8  # by default: with more, memory is the limit

FORKED = (
    "this process was forked from one whose kernels had run, and GNU OpenMP would end it; start processes with "
    "multiprocessing's 'spawn' or 'forkserver', or set NUMBA_THREADING_LAYER=workqueue"
)

_TURN = threading.Lock()
_forked = False  # whether this process inherited threads of OpenMP that it does not have


def thread_count(threads: int | None) -> int:
    """`threads`, or by default one a core up to MOST; at most as many as Numba may start.

    Raises TypeError for a value that is not an integer, ValueError for less than 1.
    """
    if threads is None:
        return min(MOST, _most())
    try:
        count = operator.index(threads)
    except TypeError:
        count = None
    if count is None or isinstance(threads, bool):
        raise TypeError(f"threads is {threads!r}; a whole number is needed")
    if count < 1:
        raise ValueError(f"threads is {threads}; at least 1 is needed")
    return min(count, _most())


def _most() -> int:
    """As many threads as Numba may start in this process: one a core, or what NUMBA_NUM_THREADS says."""
    return int(config.NUMBA_NUM_THREADS)  # type: ignore[attr-defined]


def _layer() -> str:
    """Which library runs Numba's threads. Raises ValueError before the first kernel has run."""
    return str(numba.threading_layer())  # type: ignore[attr-defined]  # numba marks its types, and leaves this one out


def _note_fork() -> None:
    global _forked
    try:
        layer = _layer()
    except ValueError:
        return  # no kernel has run
    _forked = layer == "omp"


if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_note_fork)


@contextmanager
def using(threads: int) -> Iterator[None]:
    """Loops that Numba spreads, called inside, run on `threads` threads; then the caller's own number holds again.

    Raises AvatarError in a process that was forked after kernels had run.
    """
    if _forked:
        raise AvatarError(FORKED, field="rasteriser cpu")
    before = numba.get_num_threads()
    # Numba's own pool, taken where neither TBB nor OpenMP is found, ends the process if two threads enter it at once.
    with _TURN if _layer() == "workqueue" else nullcontext():
        numba.set_num_threads(threads)
        try:
            yield
        finally:
            numba.set_num_threads(before)
