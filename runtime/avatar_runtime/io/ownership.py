"""Whose an error is: a codec says which field, the reader that called it says which file and system."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from avatar_runtime.io.errors import AvatarError


@contextmanager
def owned(owner: str) -> Iterator[None]:
    """Says whose an AvatarError is, where nobody has said so."""
    try:
        yield
    except AvatarError as error:
        if error.owner:
            raise
        raise AvatarError(error.message, file=error.file, field=error.field, owner=owner) from error


@contextmanager
def of_file(file: object) -> Iterator[None]:
    """Says which file an AvatarError is about, where nobody has said so."""
    try:
        yield
    except AvatarError as error:
        if error.file:
            raise
        raise AvatarError(error.message, file=file, field=error.field, owner=error.owner) from None
