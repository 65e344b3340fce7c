"""How the kernels of this package are compiled."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numba

from avatar_schema import constants, rules

# A float32 or float64, whichever the caller has: the type of a formula for both.
Scalar = Any
F = TypeVar("F", bound=Callable[..., Any])

NJIT: Any = numba.njit  # its types leave out the options of INNER
# IEEE arithmetic in the order written; a division by 0 gives infinity or NaN, and raises nothing.
# No way in from C: it takes longer to compile than many a kernel.
OPTIONS = {"nogil": True, "fastmath": False, "error_model": "numpy", "no_cfunc_wrapper": True}
INNER = {"no_cpython_wrapper": True}  # nor one from Python, of what only kernels call


def kernel(*, parallel: bool = False) -> Callable[[F], F]:
    """Compiled at the first call for the types of its arguments, and kept on disk for the next process.

    With NUMBA_DISABLE_JIT=1 the function stays Python.
    """

    def compiled(function: F) -> F:
        dispatcher: Any = NJIT(parallel=parallel, **OPTIONS)(function)
        if dispatcher is function:  # NUMBA_DISABLE_JIT=1
            return function
        try:
            dispatcher.enable_caching()
        except RuntimeError:  # nowhere to write: the kernel is compiled anew in each process
            pass
        else:
            _watch_all_sources(dispatcher._cache, Path(function.__code__.co_filename).parent)
        result: F = dispatcher
        return result

    return compiled


def inlined(function: F) -> F:
    """Compiled into every kernel that calls it. Python must not call it: that would end the process."""
    result: F = NJIT(forceinline=True, **INNER, **OPTIONS)(function)
    return result


def called(function: F) -> F:
    """A function of its own that kernels call; Python must not, as of one that is inlined."""
    result: F = NJIT(**INNER, **OPTIONS)(function)
    return result


def _watch_all_sources(kept: Any, folder: Path) -> None:
    """Numba watches only the file of the kernel, but a kernel may call functions of other files.

    That file is in this package or in the kernel's own `folder`. An index that another version wrote may name classes
    that no longer exist; it is then discarded.
    """
    index = kept._cache_file
    index._source_stamp = SOURCES if folder.is_relative_to(HERE) else (*SOURCES, *_files(folder))
    try:
        index._load_index()
    except Exception:  # unpickling raises anything: a class renamed since, a file cut short
        kept.flush()


@cache
def _files(folder: Path) -> tuple[str, ...]:
    """Name, time and size of every module in `folder` and below it."""
    found = [(path.relative_to(folder).as_posix(), path.stat()) for path in sorted(folder.rglob("*.py"))]
    return tuple(f"{name} {stat.st_mtime_ns} {stat.st_size}" for name, stat in found)


HERE = Path(__file__).parent
# Constants and the codes of rules are compiled in.
SOURCES = (*_files(HERE), repr(sorted(constants().items())), repr(sorted(rules().items())))
