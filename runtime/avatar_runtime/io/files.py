"""Opens a file whose name came from a user or from another file."""

from __future__ import annotations

import errno
import io
import os
import stat
from pathlib import Path


def open_file(path: Path) -> io.BufferedReader:
    """Opens a regular file for reading. Raises OSError for anything else, which is not even opened.

    A pipe or a device may never end, and opening one can disturb whoever is at its other end.
    """
    refuse_other(path, os.stat(path).st_mode)
    descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    try:  # it may be another by now
        refuse_other(path, os.fstat(descriptor).st_mode)
        return os.fdopen(descriptor, "rb")
    except BaseException:
        os.close(descriptor)
        raise


def refuse_other(path: Path, mode: int) -> None:
    """Raises OSError unless `mode`, of os.stat, is that of a regular file."""
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "is not a regular file", str(path))
