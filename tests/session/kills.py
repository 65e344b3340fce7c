"""Processes that end, without any clean-up, before their n-th change of the disk."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from typing import Any

CHANGES = {"os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.link", "os.truncate", "shutil.rmtree"}
KILLED = 9  # exit code


def killed_before(change: int, call: Callable[[], Any]) -> bool:
    """Calls in a process of its own; whether it was killed, before that change, counted from 0.

    A process that ends by itself must not fail.
    """
    process = os.fork()
    if process == 0:
        _limit(change)
        call()
        os._exit(0)
    code = os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])
    assert code in (0, KILLED), code
    return code == KILLED


def _limit(changes: int) -> None:
    left = [changes]

    def hook(event: str, values: tuple[Any, ...]) -> None:
        writes = event == "open" and isinstance(values[1], str) and set(values[1]) & set("wax+")
        if event in CHANGES or writes:
            left[0] -= 1
            if left[0] < 0:
                os._exit(KILLED)

    sys.addaudithook(hook)
