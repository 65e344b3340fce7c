"""One thread a test process: workers of pytest-xdist must not take the cores from each other.

A test of "the same bits on any number of threads" asks for its threads itself and gets them: nothing here is a limit.
Import this module before NumPy, Numba and torch: OpenMP and OpenBLAS read the environment once.
"""

from __future__ import annotations

import os

# avatar-train sets it too: threads of torch and Numba that wait must not keep a core busy.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ.setdefault(variable, "1")


def use_one() -> None:
    """One thread for every kernel that gets no number of threads. Call it in the thread that runs the tests."""
    import numba

    from avatar_runtime.backends.cpu import threads

    numba.set_num_threads(1)
    threads.MOST = 1
