"""Small checks that every reader of this folder shares: file size, values and names in messages."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path

from avatar_runtime.errors import AvatarError


def read_bytes(path: Path, limit: int) -> bytes:
    """The bytes of a file of at most `limit` bytes; AvatarError otherwise."""
    try:
        with path.open("rb") as stream:
            data = stream.read(limit + 1)
    except OSError as error:
        raise AvatarError(f"cannot be read: {error.strerror or error}", file=path.name) from None
    if len(data) > limit:
        raise AvatarError(f"is larger than {limit >> 20} MiB", file=path.name)
    return data


def shown(value: object) -> str:
    """A JSON value for a message; of a list or object only its kind (a deep one cannot be printed)."""
    return type(value).__name__ if isinstance(value, list | dict) else str(value)[:40]


def no_such(what: str, name: str, known: Iterable[str], **where: str) -> AvatarError:
    """An AvatarError that says `name` is no `what`, with near matches from `known`."""
    lowered = {k.lower(): k for k in known}
    near = [lowered[m] for m in difflib.get_close_matches(name[:200].lower(), list(lowered), n=3, cutoff=0.5)]
    listed = ", ".join([*list(lowered.values())[:8], *(["..."] if len(lowered) > 8 else [])])
    hint = f"did you mean {' or '.join(near)}?" if near else f"there are {len(lowered)}: {listed or 'none'}"
    return AvatarError(f"{name[:80]!r} is no {what}; {hint}", **where)
