"""Outputs get their name when they are whole; before that they have a temporary one in the same folder."""

from __future__ import annotations

import os
import re
import shutil
from contextlib import suppress
from pathlib import Path


def partial_of(out: Path) -> Path:
    """The temporary name of this process for the output `out`."""
    return out.with_name(f".{out.name}.{os.getpid()}.partial")


def move(partial: Path, out: Path) -> None:
    """Gives what was written the name `out`; an older folder or file there is replaced."""
    if not out.is_dir():
        partial.replace(out)
        return
    old = out.with_name(f".{out.name}.{os.getpid()}.old")
    out.rename(old)
    try:
        partial.rename(out)
    except OSError:
        old.rename(out)
        raise
    shutil.rmtree(old)


def remove(path: Path) -> None:
    """Removes a file or a folder, if there is one."""
    if path.is_dir():
        shutil.rmtree(path)
    elif path.exists():
        path.unlink()


def remove_leftovers(out: Path) -> None:
    """Removes the partial files that killed processes left beside `out`."""
    name = re.compile(rf"\.{re.escape(out.name)}\.([0-9]{{1,9}})\.partial")
    for path in list(out.parent.iterdir()):
        found = name.fullmatch(path.name)
        if found and not _lives(int(found[1])):
            with suppress(OSError):  # another user's
                remove(path)


def _lives(process: int) -> bool:
    """Whether another process of this number may be alive; Windows has no safe way to find out."""
    if os.name != "posix":
        return True
    if process in (0, os.getpid()):
        return False
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    except OSError:  # another user's
        return True
    return True
