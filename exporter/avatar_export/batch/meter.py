"""What a row costs in its worker: time, CPU time, and the most memory that the process held."""

from __future__ import annotations

import os
import socket
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

STATUS, CLEAR = Path("/proc/self/status"), Path("/proc/self/clear_refs")
RESET_PEAK = "5"  # Linux, proc(5)


class Meter:
    """Counts from the moment it is made. A worker does one row at a time."""

    def __init__(self) -> None:
        with suppress(OSError):  # not Linux, or not allowed: the peak is then that of the process's life
            CLEAR.write_text(RESET_PEAK)
        self._began, self._cpu = time.perf_counter(), time.process_time()

    def spent(self) -> dict[str, Any]:
        """The fields of a Result that say what was spent, and where."""
        return {
            "seconds": time.perf_counter() - self._began,
            "cpu_seconds": time.process_time() - self._cpu,
            "peak_bytes": peak_bytes(),
            "worker": f"{socket.gethostname()}:{os.getpid()}",
        }


def peak_bytes() -> int:
    """The most bytes that this process held in memory since its peak was reset; 0 where the system does not say."""
    with suppress(OSError, ValueError):
        rows = (line.partition(":") for line in STATUS.read_text("ascii").splitlines())
        return next(int(value.split()[0]) * 1024 for name, _, value in rows if name == "VmHWM")
    try:
        import resource
    except ImportError:  # Windows
        return 0
    unit = 1 if sys.platform == "darwin" else 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
