"""What a row may say besides its source and output: the options of `convert`, by the names that Python gives them."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

from avatar_export.batch.locations import joined, normal
from avatar_export.bodies.inputs import ZERO
from avatar_export.conversion import convert
from avatar_export.options import CONVERT, IN_UNITS, LEAST_UNITS, MOST_UNITS, ReadOptions
from avatar_export.readers.table import READERS
from avatar_export.writers.table import INFLUENCES
from avatar_runtime.handedness import HANDEDNESS
from avatar_runtime.rules import ROTATION_RULES, SH_DIRECTIONS, TRAINED_SIGNS

CALLED = inspect.signature(convert).parameters
OWN = ("source", "out", "options", "force", "progress")  # of `convert`, which a batch sets itself
# option -> annotation, without "| None"
OPTIONS: Mapping[str, str] = {
    name: str(annotation).removesuffix(" | None")
    for name, annotation in (
        *((one.name, one.type) for one in fields(ReadOptions)),
        *((name, one.annotation) for name, one in CALLED.items() if name not in OWN),
    )
}
FILES = tuple(name for name, kind in OPTIONS.items() if "Path" in kind)  # options that name files
SEVERAL = tuple(name for name in FILES if "Sequence" in OPTIONS[name])
CHOICES: Mapping[str, tuple[object, ...]] = {
    "handedness": HANDEDNESS,
    "influences": INFLUENCES,
    "quaternion_sign": TRAINED_SIGNS,
    "rotation": tuple(ROTATION_RULES),
    "sh_direction": SH_DIRECTIONS,
    "system": tuple(reader.system for reader in READERS),
}
RANGES = dict.fromkeys((*IN_UNITS, "units"), (LEAST_UNITS, MOST_UNITS))
BETWEEN = ";"  # several files in one text
YES_NO = {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}


def read_text(name: str, text: str) -> Any:
    """The value that a text of a list gives the option `name`. Raises ValueError for a text that is none."""
    kind = OPTIONS[name]
    if name in SEVERAL:
        return [part.strip() for part in text.split(BETWEEN) if part.strip()]
    if kind == "bool":
        if text.lower() not in YES_NO:
            raise ValueError(f"{text[:40]!r} is not true or false")
        return YES_NO[text.lower()]
    if kind in ("int", "float"):
        try:
            return int(text) if kind == "int" else float(text)
        except ValueError:
            raise ValueError(f"{text[:40]!r} is not a {'whole ' * (kind == 'int')}number") from None
    return text


def checked(name: str, value: Any, base: str) -> Any:
    """The value of the option `name` as a row keeps it: files as normal locations, seen from the folder `base`.

    Raises TypeError and ValueError for a value that `convert` does not take.
    """
    if name in SEVERAL:
        if not isinstance(value, list | tuple) or not all(isinstance(one, str | Path) for one in value):
            raise TypeError(f"{name} is no list of paths")
        return tuple(normal(joined(base, str(one))) for one in value)
    if name in FILES:
        if not isinstance(value, str | Path):
            raise TypeError(f"{name} is no path")
        return str(value) if names_no_file(name, str(value)) else normal(joined(base, str(value)))
    if name in CHOICES and value not in CHOICES[name]:
        known = ", ".join(str(one) for one in CHOICES[name])
        raise ValueError(f"{str(value)[:40]!r} is not one of {known}")
    found = CONVERT[OPTIONS[name]](name, value)
    least, most = RANGES.get(name, (found, found))
    if not least <= found <= most:
        raise ValueError(f"{found} is not {least:g} to {most:g}")
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


def arguments(options: Mapping[str, Any], paths: Mapping[str, Path]) -> dict[str, Any]:
    """The arguments of `convert` besides its source and output; `paths` says where the files of each role lie now."""
    given = {**options}
    for name in FILES:
        if name in SEVERAL:
            given[name] = [paths[f"{name}[{index}]"] for index in range(len(options.get(name) or ()))]
        elif name in paths:
            given[name] = paths[name]
    read = {one.name for one in fields(ReadOptions)} & given.keys()
    rest = {name: value for name, value in given.items() if name not in read}
    return {"options": ReadOptions(**{name: given[name] for name in read}), **rest}
