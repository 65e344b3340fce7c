"""The enums of the JSON Schemas, made from the table of rules."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterable
from json.decoder import JSONDecoder
from pathlib import Path
from typing import Any

from avatar_schema.rule_table import Rule, families, rules

V1 = Path(__file__).parent / "v1"
WIDTH = 120
_DECODER = JSONDecoder()


def schema_texts(folder: Path = V1) -> dict[str, str]:
    """{file: text} of the schemas in `folder` that list rules. An enum that is right stays as it is, byte by byte.

    Raises KeyError where an enum is not where the table says.
    """
    texts: dict[str, str] = {}
    for rule in rules().values():
        for place, names in _enums(rule):
            file, _, pointer = place.partition("#")
            text = texts[file] if file in texts else (folder / file).read_text("utf-8")
            texts[file] = with_array(text, pointer, names)
    return texts


def _enums(rule: Rule) -> Iterable[tuple[str, list[str]]]:
    embedded = {family.name for family in families().values() if family.embedded}
    with_mesh = [v.name for v in rule.values if not v.families or embedded & set(v.families)]
    yield from ((place, list(rule.names())) for place in rule.enums)
    yield from ((place, with_mesh) for place in rule.embedded_enums)


def with_array(text: str, pointer: str, items: list[str]) -> str:
    """The JSON `text` with `items` for the array at a JSON pointer; the same text where they are there already.

    Raises KeyError where the pointer leads nowhere.
    """
    start, end = _span(text, 0, [step for step in pointer.split("/") if step])
    if json.loads(text[start:end]) == items:
        return text
    line = text[text.rfind("\n", 0, start) + 1 : start]
    rest = text[end:].partition("\n")[0]
    one_line = json.dumps(items)
    if len(line) + len(one_line) + len(rest) <= WIDTH:
        return text[:start] + one_line + text[end:]
    indent = " " * (len(line) - len(line.lstrip()))
    rows = textwrap.wrap(
        one_line[1:-1], WIDTH - len(indent) - 2, break_long_words=False, break_on_hyphens=False
    )
    body = "".join(f"\n{indent}  {row}" for row in rows)
    return f"{text[:start]}[{body}\n{indent}]{text[end:]}"


def _span(text: str, at: int, steps: list[str]) -> tuple[int, int]:
    """(start, end) in `text` of what `steps` lead to from the value that begins at `at`."""
    at = _after_space(text, at)
    if not steps:
        return at, _value(text, at)[1]
    in_object, index = text[at] == "{", 0
    if text[at] not in "{[":
        raise KeyError(steps[0])
    at = _after_space(text, at + 1)
    while text[at] not in "}]":
        key: Any = str(index)
        if in_object:
            key, at = _value(text, at)
            at = _after_space(text, at) + 1  # the colon
        if key == steps[0]:
            return _span(text, at, steps[1:])
        at = _after_space(text, _value(text, _after_space(text, at))[1])
        at = _after_space(text, at + (text[at] == ","))
        index += 1
    raise KeyError(steps[0])


def _value(text: str, at: int) -> tuple[Any, int]:
    value, end = _DECODER.raw_decode(text, at)
    return value, int(end)


def _after_space(text: str, at: int) -> int:
    while text[at].isspace():
        at += 1
    return at
