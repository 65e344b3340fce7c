"""CPU time of this process and of those that it started."""

from __future__ import annotations

import os


def cpu_seconds() -> float:
    """CPU seconds up to now, those of the processes included that ended. Other work on the machine disturbs it less
    than wall time.
    """
    spent = os.times()
    return spent.user + spent.system + spent.children_user + spent.children_system
