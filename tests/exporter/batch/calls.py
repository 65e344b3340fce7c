"""What tests let workers do. Each call leaves a file NAME-ATTEMPT in a folder."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

from avatar_export.batch.result import Result


def ends(name: str, attempt: str, *, folder: Path, state: str = "done", retryable: bool = False) -> Result:
    """Ends at once."""
    (folder / f"{name}-{attempt}").touch()
    return Result(name, state, retryable=retryable)


def waits(name: str, attempt: str, *, folder: Path, seconds: float) -> Result:
    """Takes its time."""
    (folder / f"{name}-{attempt}").touch()
    time.sleep(seconds)
    return Result(name, "done")


def kills(name: str, attempt: str, *, folder: Path) -> Result:
    """Kills its worker."""
    (folder / f"{name}-{attempt}").touch()
    os.kill(os.getpid(), signal.SIGKILL)
    raise AssertionError


def raises(name: str, attempt: str, *, folder: Path) -> Result:
    """Has a bug."""
    (folder / f"{name}-{attempt}").touch()
    raise ZeroDivisionError(f"{name} divides")
