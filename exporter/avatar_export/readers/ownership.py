"""Whose an error is: a codec says which file and field, the reader that called it says which system."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from avatar_runtime.errors import AvatarError


@contextmanager
def owned(owner: str) -> Iterator[None]:
    """Says whose an AvatarError is, where nobody has said so."""
    try:
        yield
    except AvatarError as error:
        if error.owner:
            raise
        raise AvatarError(error.message, file=error.file, field=error.field, owner=owner) from error
