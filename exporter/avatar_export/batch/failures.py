"""Kinds of failures, and what to do about each."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from dataclasses import dataclass

from avatar_export.batch.locations import cleaned, is_url
from avatar_runtime.io.errors import AvatarError, MemoryShortage


@dataclass(frozen=True)
class Kind:
    """One kind of failure."""

    remedy: str  # one line
    retryable: bool  # whether another attempt may end otherwise


KINDS = {
    "input": Kind("correct the row's source or options; `avatar-export convert` on it says the same", False),
    "output": Kind("name another output, remove what is there, or make it writable", False),
    "check": Kind("report it: what was written does not pass its own checks", False),
    "memory": Kind("give each worker more memory, or start fewer workers on a machine", True),
    "disk full": Kind("make room on the worker's disk, or set TMPDIR to a larger one", True),
    "disk": Kind("look at the worker's disk and at TMPDIR", True),
    "access": Kind(
        "give the workers credentials for the store, by its own ways (see the page on batches)", False
    ),
    "store": Kind("try again with --resume; the store or the network failed", True),
    "library": Kind("install the store's library on every worker", False),
    "worker": Kind("convert it alone and see why; for want of memory, give each worker more", False),
    "bug": Kind("this is a bug of avatar-export: report it, with the row", True),
}
FULL = (errno.ENOSPC, errno.EDQUOT)


class StoreError(AvatarError):
    """A store that did not do what was asked; `kind` is one of KINDS."""

    def __init__(self, message: str, *, kind: str, file: object = None):
        super().__init__(cleaned(message), file=None if file is None else cleaned(str(file)))
        self.kind = kind


def lost(error: Exception, location: str, *, writing: bool = False) -> AvatarError:
    """The AvatarError for what a store raised when it was asked for `location`."""
    name = type(error).__name__
    said = " ".join(str(error).split()) or name
    if is_full(error):
        return StoreError("there is no space left on the worker's disk", kind="disk full", file=location)
    if isinstance(error, FileNotFoundError | NotADirectoryError):
        if writing:
            return StoreError("there is no such bucket; make it first", kind="output", file=location)
        return AvatarError("no such file or folder", file=location)
    if isinstance(error, ImportError):
        return StoreError(said, kind="library", file=location)
    if isinstance(error, OSError) and not is_url(location):
        return AvatarError(f"cannot be read ({error.strerror or error})", file=location)
    if isinstance(error, PermissionError) or "Credential" in name:
        return StoreError(f"the store refuses it ({said})", kind="access", file=location)
    return StoreError(f"the store failed ({name}: {said})", kind="store", file=location)


def is_full(error: BaseException) -> bool:
    """Whether a full disk caused an error."""
    return any(isinstance(one, OSError) and one.errno in FULL for one in _causes(error))


def kind_of(error: BaseException) -> str:
    """The kind of an error that bad data or the machine caused; a key of KINDS."""
    if isinstance(error, StoreError):
        return error.kind
    if isinstance(error, MemoryError | MemoryShortage):
        return "memory"
    if is_full(error):
        return "disk full"
    return "disk" if isinstance(error, OSError) else "input"


def _causes(error: BaseException | None) -> Iterator[BaseException]:
    """An error and those that led to it, also where its message hides them."""
    while error is not None:
        yield error
        error = error.__cause__ or error.__context__
