"""The exception for bad data. Callers' mistakes and bugs raise other exceptions."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

LONGEST = 1200  # letters of a message


class AvatarError(Exception):
    """Bad data: whose it is, which file and field, what is wrong, what to do. One line.

    A caller's mistake is a TypeError or ValueError; anything else is a bug. The command line prints an
    AvatarError as one line and exits with code 2.
    """

    def __init__(self, message: str, *, file: object = None, field: object = None, owner: object = None):
        self.message = printable(_shown(" ".join(message.split())))
        self.file = None if file is None else str(file)
        self.field = None if field is None else str(field)
        self.owner = None if owner is None else str(owner)
        where = [part for part in (self.owner, self.file, self.field) if part]
        super().__init__(printable(" ".join(": ".join([*where, self.message]).split())))


def printable(text: str) -> str:
    """`text` with a ? for each character that a terminal obeys or hides instead of showing it: control characters (C0,
    C1), line ends, marks of writing direction, surrogates. Files of strangers hold any name."""
    return "".join(c if c.isprintable() else "?" for c in text)


def _shown(text: str) -> str:
    """The beginning and the end of a text that is too long for a line: a file can hold names of any length."""
    return text if len(text) <= LONGEST else f"{text[: LONGEST // 2]} ... {text[-LONGEST // 2 :]}"


class MemoryShortage(AvatarError):
    """Too little memory for what was asked; the command line exits with code 3."""


def no_such(what: str, name: str, known: Iterable[str], **where: object) -> AvatarError:
    """An AvatarError for a `name` that is not among the `known` names of a `what`; it lists near matches."""
    lowered = {k.lower(): k for k in known}
    near = [lowered[m] for m in difflib.get_close_matches(name[:200].lower(), list(lowered), n=3, cutoff=0.5)]
    listed = ", ".join([*list(lowered.values())[:8], *(["..."] if len(lowered) > 8 else [])])
    hint = f"did you mean {' or '.join(near)}?" if near else f"there are {len(lowered)}: {listed or 'none'}"
    article = "an" if what[0].lower() in "aeiou" else "a"
    return AvatarError(f"{name[:80]!r} is not {article} {what}; {hint}", **where)
