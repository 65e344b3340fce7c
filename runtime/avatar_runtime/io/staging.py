"""Outputs get their name when they are whole and on the disk; before that they have a temporary one in the same folder.

An older output is exchanged for the new one in one step where the system can do that. Where it cannot, a killed process
may leave the older one under the name `.NAME.PID.old`; the next that writes to the same place puts it back.
"""

from __future__ import annotations

import errno
import os
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.exchange import exchange

MEANWHILE = "was written by another process meanwhile; pass --force to replace it"


@contextmanager
def staged(out: Path, *, force: bool) -> Iterator[Path]:
    """A temporary name for what becomes `out` when the block ends; nothing is left if the block raises.

    Raises AvatarError if it cannot be written, or if `out` exists at the end; `force` replaces it.
    """
    partial = partial_of(out)
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        heal(out)
        yield partial
        move(partial, out, force=force)
    except OSError as error:
        raise AvatarError(f"cannot be written ({error.strerror or error})", file=out) from None
    finally:
        remove(partial)


def partial_of(out: Path) -> Path:
    """The temporary name of this process for the output `out`."""
    return out.with_name(f".{out.name}.{os.getpid()}.partial")


def followed(out: Path) -> Path:
    """`out` without links. Raises AvatarError for a link that leads to itself."""
    try:
        out.stat()
    except OSError as error:
        if error.errno == errno.ELOOP:
            raise AvatarError("is a link that leads to itself; name another", file=out) from None
    return Path(os.path.realpath(out))


def move(partial: Path, out: Path, *, force: bool) -> None:
    """Gives what was written the name `out`, once it is on the disk; with `force` in place of what is there.

    Raises AvatarError if `out` exists without `force`, OSError if it cannot be done.
    """
    sync(partial)
    put(partial, out, force=force)


def put(partial: Path, out: Path, *, force: bool) -> None:
    """`move` of what is on the disk already."""
    try:
        _name(partial, out)
    except OSError:
        if not os.path.lexists(out):
            raise
        if not force:
            raise AvatarError(MEANWHILE, file=out) from None
        _replace(partial, out)
    sync_folder(out.parent)


def remove(path: Path) -> None:
    """Removes a file or a folder, if there is one."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        with suppress(FileNotFoundError, NotADirectoryError):
            path.unlink()


def heal(out: Path) -> None:
    """Puts back or removes what killed processes left beside `out`."""
    name = re.compile(rf"\.{re.escape(out.name)}\.([0-9]{{1,9}})\.(partial|old)")
    try:
        beside = sorted(out.parent.iterdir())
    except OSError:  # no folder yet, or one that nobody may list
        return
    for path in beside:
        found = name.fullmatch(path.name)
        if found is None or lives(int(found[1])):
            continue
        with suppress(OSError):  # another user's
            if found[2] == "old" and not os.path.lexists(out):
                path.rename(out)
            else:
                remove(path)


def _name(partial: Path, out: Path) -> None:
    """Renames where nothing is. Raises OSError if something is there; an empty folder is replaced by a folder."""
    if partial.is_dir() or os.name == "nt":
        partial.rename(out)
        return
    try:
        os.link(partial, out)
    except FileExistsError:
        raise
    except OSError:  # a file system without hard links
        if os.path.lexists(out):
            raise
        partial.rename(out)
        return
    partial.unlink()


def _replace(partial: Path, out: Path) -> None:
    """Puts `partial` in the place of `out`, which exists."""
    if not partial.is_dir() and not out.is_dir():
        partial.replace(out)
        return
    if exchange(partial, out):
        remove(partial)
        return
    old = out.with_name(f".{out.name}.{os.getpid()}.old")
    try:
        out.rename(old)
        partial.rename(out)
    except BaseException:
        if old.exists() and not os.path.lexists(out):
            old.rename(out)
        raise
    remove(old)


def sync(path: Path) -> None:
    """Waits until a file, or a folder with all that is in it, is on the disk."""
    if not path.is_dir():
        _sync_file(path)
        return
    for folder, _, files in os.walk(path):
        for name in files:
            _sync_file(Path(folder, name))
        sync_folder(Path(folder))


def _sync_file(path: Path) -> None:
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def sync_folder(folder: Path) -> None:
    """Waits until a folder's entries are on the disk. Windows has no such call; some file systems have none either."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(descriptor)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(descriptor)


def lives(process: int) -> bool:
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
