"""What a row may say besides its source and output: the options of `convert`, by the names that Python gives them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from avatar_export.batch.locations import joined, normal
from avatar_export.bodies.inputs import ZERO
from avatar_export.convert_options import ConvertOptions
from avatar_export.options import declared

# Lists spell it as manifests do.
OPTIONS = {"licence" if name == "license" else name: one for name, one in declared(ConvertOptions).items()}
FILES = tuple(name for name, one in OPTIONS.items() if one.kind is Path)  # options that name files
SEVERAL = tuple(name for name in FILES if OPTIONS[name].several)
BETWEEN = ";"  # several files in one text
YES_NO = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


def read_text(name: str, text: str) -> Any:
    """The value that a text of a list gives the option `name`. Raises ValueError for another text."""
    kind = OPTIONS[name].kind
    if name in SEVERAL:
        return [part.strip() for part in text.split(BETWEEN) if part.strip()]
    if kind is bool:
        if text.lower() not in YES_NO:
            raise ValueError(f"{text[:40]!r} is not true or false")
        return YES_NO[text.lower()]
    if kind in (int, float):
        try:
            return int(text) if kind is int else float(text)
        except ValueError:
            raise ValueError(f"{text[:40]!r} is not a {'whole ' * (kind is int)}number") from None
    return text


def checked(name: str, value: Any, base: str) -> Any:
    """The value of the option `name` as a row keeps it: files as normal locations, seen from the folder `base`.

    Raises TypeError and ValueError for a value that `convert` does not take.
    """
    found = OPTIONS[name].checked(value)
    if name in SEVERAL:
        return tuple(normal(joined(base, str(one))) for one in value)
    if name in FILES:
        return str(value) if names_no_file(name, str(value)) else normal(joined(base, str(value)))
    return found


def names_no_file(name: str, value: str) -> bool:
    """Whether the value of an option that names files is a word instead: `zero`, the mean shape."""
    return name == "shape" and value == ZERO


def locations(options: Mapping[str, Any]) -> dict[str, str]:
    """Role -> location of each file or folder that options name: the option, and of several its number."""
    found: dict[str, str] = {}
    for name in FILES:
        value = options.get(name)
        if name in SEVERAL:
            found |= {f"{name}[{index}]": one for index, one in enumerate(value or ())}
        elif value is not None and not names_no_file(name, value):
            found[name] = value
    return found


def arguments(options: Mapping[str, Any], paths: Mapping[str, Path]) -> ConvertOptions:
    """The options of `convert`; `paths` says where the files of each role lie now."""
    given = {**options}
    for name in FILES:
        if name in SEVERAL:
            given[name] = [paths[f"{name}[{index}]"] for index in range(len(options.get(name) or ()))]
        elif name in paths:
            given[name] = paths[name]
    return ConvertOptions(**{OPTIONS[name].name: value for name, value in given.items()})
