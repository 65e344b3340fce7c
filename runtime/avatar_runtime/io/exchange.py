"""Two names exchange what they stand for, in one step of the file system that a kill cannot divide."""

from __future__ import annotations

import ctypes
import os
import sys
from pathlib import Path

AT_FDCWD = -100  # Linux, fcntl.h: paths are relative to the working directory
RENAME_EXCHANGE = 2  # Linux, linux/fs.h
RENAME_SWAP = 2  # macOS, sys/stdio.h


def exchange(one: Path, other: Path) -> bool:
    """Exchanges two files or folders of one file system; whether that was done. False: the system cannot."""
    try:
        library = ctypes.CDLL(None, use_errno=True)
        first, second = os.fsencode(one), os.fsencode(other)
        if sys.platform == "linux":
            return int(library.renameat2(AT_FDCWD, first, AT_FDCWD, second, RENAME_EXCHANGE)) == 0
        if sys.platform == "darwin":
            return int(library.renamex_np(first, second, RENAME_SWAP)) == 0
    except (OSError, AttributeError, TypeError):  # no such call: Windows, an old C library
        pass
    return False
