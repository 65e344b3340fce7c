"""Completes errors: a codec names the field; the reader that called it adds the file and the system."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from avatar_runtime.io.errors import AvatarError


@contextmanager
def owned(owner: str) -> Iterator[None]:
    """Adds `owner` to an AvatarError that has none."""
    try:
        yield
    except AvatarError as error:
        if error.owner:
            raise
        raise AvatarError(error.message, file=error.file, field=error.field, owner=owner) from error


@contextmanager
def of_file(file: object) -> Iterator[None]:
    """Adds `file` to an AvatarError that has none."""
    try:
        yield
    except AvatarError as error:
        if error.file:
            raise
        raise AvatarError(error.message, file=file, field=error.field, owner=error.owner) from None
