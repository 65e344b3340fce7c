"""The one exception that stands for bad data, as against a caller's mistake or a bug."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class AvatarError(Exception):
    """Bad data: whose it is, which file and field, what is wrong, what to do. One line.

    A caller's mistake is a TypeError or ValueError; anything else is a bug. The command line prints an
    AvatarError as one line and exits with code 2.
    """

    def __init__(
        self, message: str, *, file: object = None, field: str | None = None, owner: str | None = None
    ):
        self.message = " ".join(message.split())
        self.file = None if file is None else str(file)
        self.field = field
        self.owner = owner
        where = [part for part in (owner, self.file, field) if part]
        super().__init__(" ".join(": ".join([*where, self.message]).split()))


def unknown_name(what: str, name: str, known: Iterable[str], **where: str) -> AvatarError:
    """An AvatarError for a name that is not in `known`, with near matches."""
    known = list(known)
    lowered = {k.lower(): k for k in known}
    near = [lowered[m] for m in difflib.get_close_matches(name.lower(), list(lowered), n=3, cutoff=0.5)]
    if near:
        hint = f"did you mean {' or '.join(near)}?"
    elif known:
        hint = f"there are {len(known)}: {', '.join(known[:8])}{', ...' if len(known) > 8 else ''}"
    else:
        hint = f"this avatar has no {what}"
    return AvatarError(f"{name!r} is no {what} of this avatar; {hint}", **where)
