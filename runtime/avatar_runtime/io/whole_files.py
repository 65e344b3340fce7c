"""Reads whole files, after a check of their size."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import BufferedReader
from pathlib import Path

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file


@contextmanager
def opened(path: Path, limit: int) -> Iterator[BufferedReader]:
    """Opens a file of at most `limit` bytes. Raises AvatarError if it is larger or cannot be read."""
    try:
        with open_file(path) as file:
            size = file.seek(0, 2)
            file.seek(0)
            if size > limit:
                raise AvatarError(f"is {size} bytes long; up to {limit} are read", file=path)
            yield file
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=path) from None


def read_bytes(path: Path, limit: int) -> bytes:
    """All of a file; see `opened`."""
    with opened(path, limit) as file:
        return file.read()
