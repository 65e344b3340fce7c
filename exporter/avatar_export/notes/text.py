"""The one place where a note becomes a text: the console, a page, or the provenance of a manifest."""

from __future__ import annotations

import string
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from avatar_export.notes import (
    checking,
    converting,
    distilling,
    filming,
    fitting,
    packing,
    playing,
    reading,
    unlike,
    wrong,
)
from avatar_export.notes.note import Note
from avatar_export.notes.words import FORMS

DOUBTFUL = "doubtful: "  # begins a note of a manifest that says something may be wrong
TABLES = (reading, fitting, wrong, unlike, converting, packing, playing, checking, distilling, filming)
TEXTS: Mapping[str, str | Callable[..., str]] = {
    "said": "{text}",  # by an older bundle, which holds texts alone
    **{kind: text for table in TABLES for kind, text in table.TEXTS.items()},
}


class _Formatter(string.Formatter):
    """Takes `{lengths:FORM}` for the forms of `words`, and for those of notes within notes."""

    def format_field(self, value: Any, spec: str) -> Any:
        form = {**FORMS, **INNER}.get(spec)
        return super().format_field(value, spec) if form is None else form(value)


def text(note: Note) -> str:
    """The note in words."""
    made = TEXTS[note.kind]
    return _FORMATTER.vformat(made if isinstance(made, str) else made(**note.values), (), note.values)


def stored(notes: Sequence[Note]) -> list[str]:
    """The notes as the provenance of a manifest has them."""
    return [f"{DOUBTFUL * note.doubtful}{text(note)}" for note in notes if not note.passing]


def from_stored(texts: object) -> list[Note]:
    """The notes of a manifest; what is no text is passed over."""
    return [
        Note("said", {"text": one.removeprefix(DOUBTFUL)}, "doubt" if one.startswith(DOUBTFUL) else "fact")
        for one in (texts if isinstance(texts, list) else ())
        if isinstance(one, str)
    ]


INNER: Mapping[str, Callable[[Any], str]] = {
    "settings": reading.settings,
    "unstated": lambda settings: " and ".join(map(reading.setting, settings)),
    "note": text,
    "also": lambda note: "" if note is None else f"; {text(note)}",
    "and": lambda notes: " and ".join(map(text, notes)),
}
_FORMATTER = _Formatter()
