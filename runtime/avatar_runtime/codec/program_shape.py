"""Whether the long lists of a pack's document have the form that pack.schema.json asks for.

The schema's own validator takes 20 ms for them, which is most of the time of loading; this takes 1 ms. It only ever
says that a document is fine: what it doubts goes to the schema, whose message the user gets.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from avatar_runtime.codec.sections import BITS, CODECS

U32_MAX = (1 << 32) - 1
MOST_BYTES = (1 << 31) - 1
MOST_BUFFERS = MOST_PASSES = 4096
MOST_SECTIONS, MOST_RECORD, MOST_NAME, MOST_SOURCE, MOST_NUMBERS = 128, 1024, 96, 64, 4
SECTION_KEYS = {"name", "bits", "count", "codec"}
ALL_SECTION_KEYS = SECTION_KEYS | {"record", "tensor"}
PASS_KEYS = {"entry", "rows", "buffers", "constants"}


def is_plain(program: Any) -> bool:
    """Whether buffers and passes of `program` surely have the schema's form."""
    try:
        lists = [
            program["mesh"],
            *(level[name] for level in program["levels"] for name in ("deform", "view")),
        ]
        return _all(program["buffers"], MOST_BUFFERS, _buffer) and all(
            _all(passes, MOST_PASSES, _pass) for passes in lists
        )
    except (KeyError, TypeError, AttributeError):
        return False


def without_lists(document: dict[str, Any]) -> dict[str, Any]:
    """`document` with empty lists of buffers and passes, for a document that `is_plain`."""
    program = document["program"]
    levels = [{**level, "deform": [], "view": []} for level in program["levels"]]
    return {**document, "program": {**program, "buffers": [], "mesh": [], "levels": levels}}


def _all(values: Any, most: int, check: Callable[[Any], bool]) -> bool:
    return type(values) is list and len(values) <= most and all(map(check, values))


def _buffer(said: Any) -> bool:
    if type(said) is not dict or not _name(said["name"], MOST_NAME):
        return False
    if said.keys() == {"name", "bytes"}:
        return type(said["bytes"]) is int and 0 <= said["bytes"] <= MOST_BYTES
    return (
        said.keys() == {"name", "sections"}
        and len(said["sections"]) > 0
        and _all(said["sections"], MOST_SECTIONS, _section)
    )


def _section(said: Any) -> bool:
    return (
        type(said) is dict
        and said.keys() >= SECTION_KEYS
        and said.keys() <= ALL_SECTION_KEYS
        and _name(said["name"], MOST_NAME)
        and type(said["bits"]) is int
        and said["bits"] in BITS
        and _count(said["count"])
        and said["codec"] in CODECS
        and type(said.get("record", 1)) is int
        and 1 <= said.get("record", 1) <= MOST_RECORD
        and type(said.get("tensor", "")) is str
    )


def _pass(said: Any) -> bool:
    return (
        type(said) is dict
        and said.keys() == PASS_KEYS
        and _name(said["entry"], MOST_SOURCE, least=0)
        and _count(said["rows"])
        and _strings(said["buffers"].values())
        and all(map(_constant, said["constants"].values()))
    )


def _constant(value: Any) -> bool:
    if type(value) is str:
        return len(value) <= MOST_SOURCE
    if type(value) is list:
        return len(value) <= MOST_NUMBERS and all(type(v) in (int, float) for v in value)
    return type(value) in (int, float)


def _strings(values: Iterable[Any]) -> bool:
    return all(type(value) is str for value in values)


def _name(value: Any, most: int, least: int = 1) -> bool:
    return type(value) is str and least <= len(value) <= most


def _count(value: Any) -> bool:
    return type(value) is int and 0 <= value <= U32_MAX
