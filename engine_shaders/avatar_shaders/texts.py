"""The shader texts of this package and what they bind."""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import Any

from avatar_shaders.entries import ENTRIES, GLSL_VERSIONS, LANGUAGES, path_of


@cache
def source(entry: str, language: str) -> str:
    """Text of an entry: the generated file, for "glsl430" with that version in line 1; or for "hlsl" the wrapper
    file, which includes others of hlsl/.

    Raises ValueError for an unknown entry or language.
    """
    if language == "hlsl" and entry in ENTRIES:
        path = f"hlsl/{ENTRIES[entry].hlsl}"
    else:
        path = path_of(entry, language)
    text = (files(__package__) / path).read_text("utf-8")
    return text.replace(GLSL_VERSIONS["glsl310es"], GLSL_VERSIONS.get(language, ""), 1)


def reflection(language: str) -> dict[str, Any]:
    """What every entry binds in a language, by entry name; a fresh copy. README.md explains the fields.

    Raises ValueError for an unknown language.
    """
    if language not in LANGUAGES:
        raise ValueError(f"{language!r} is not one of {', '.join(LANGUAGES)}")
    table: dict[str, Any] = json.loads((files(__package__) / "reflection.json").read_text("utf-8"))
    return {
        name: {**row, "entry_point": row["entry_point"][language]} for name, row in table["entries"].items()
    }
