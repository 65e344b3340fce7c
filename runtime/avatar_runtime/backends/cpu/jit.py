"""How the kernels of this package are compiled."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import numba

from avatar_schema import constants

# A float32 or float64, as the caller has it: what a formula for both takes and gives.
Scalar = Any
F = TypeVar("F", bound=Callable[..., Any])

# IEEE arithmetic in the order written; a division by 0 is infinite or no number, and raises nothing.
OPTIONS: dict[str, Any] = {"nogil": True, "fastmath": False, "error_model": "numpy"}


def kernel(*, parallel: bool = False) -> Callable[[F], F]:
    """Compiled at the first call for the types of its arguments, and kept on disk for the next process."""

    def compiled(function: F) -> F:
        dispatcher: Any = numba.njit(parallel=parallel, **OPTIONS)(function)
        try:
            dispatcher.enable_caching()
        except RuntimeError:  # nowhere to write: the kernel is compiled anew in each process
            pass
        else:
            _watch_all_sources(dispatcher._cache)
        result: F = dispatcher
        return result

    return compiled


def inlined(function: F) -> F:
    """Compiled into every kernel that calls it."""
    result: F = numba.njit(forceinline=True, **OPTIONS)(function)
    return result


def _watch_all_sources(cache: Any) -> None:
    """Numba looks at the file of the kernel alone; what the kernel calls may stand in another one.

    An index that another version of this package wrote may name what is no more, and is then no good at all.
    """
    index = cache._cache_file
    index._source_stamp = SOURCES
    try:
        index._load_index()
    except Exception:  # unpickling raises anything: a class renamed since, a file cut short
        cache.flush()


def _sources() -> tuple[str, ...]:
    """Name, time and size of every file of this package, and the constants that are compiled in."""
    found = [(path.name, path.stat()) for path in sorted(Path(__file__).parent.glob("*.py"))]
    files = (f"{name} {stat.st_mtime_ns} {stat.st_size}" for name, stat in found)
    return (*files, repr(sorted(constants().items())))


SOURCES = _sources()
