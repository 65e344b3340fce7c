"""JSON of strangers: one strict grammar for bundles and packs, so that every reader in every language says the same.

RFC 8259 in UTF-8 without a byte order mark. SPEC.md section 12 has what is refused beyond its grammar.
"""

from __future__ import annotations

import json
import math
import re
from collections import Counter
from typing import Any

import numpy as np

MOST_DEPTH = 64  # lists and objects inside each other
MOST_VALUES = 1 << 21  # of one text, lists and objects included
LARGEST = 1 << 53  # of an integer: the largest up to which a double holds every one
_TEXT = re.compile(r'"[^"\\]*(?:\\.[^"\\]*)*"', re.DOTALL)
_SPACE = str.maketrans("", "", " \t\n\r")
_NUL = re.compile(r"(?<!\\)(?:\\\\)*\\u0000")  # an interface of C could not name it
_HALF = re.compile(r"\\u[dD][89a-fA-F]")  # what may be half a surrogate pair


def parse(data: bytes | str, *, as_written: bool = False) -> Any:
    """The value of a JSON text. A number whose value is whole is an integer, however it is written: 8.0 is 8.

    `as_written`: 8.0 stays a float, so that it is written again as it was. Raises ValueError for anything else than one
    strict value.
    """
    text = data if isinstance(data, str) else _decoded(data)
    _check_size(text)
    value = json.loads(
        text,
        parse_constant=_refuse,
        parse_float=_finite if as_written else _number,
        parse_int=_integer,
        object_pairs_hook=_object,
    )
    if _NUL.search(text):
        raise ValueError("a text holds U+0000")
    if _HALF.search(text):
        json.dumps(value, ensure_ascii=False).encode()  # raises for half a pair
    return value


def _decoded(data: bytes) -> str:
    try:
        return bytes(data).decode("utf-8")
    except UnicodeDecodeError:
        raise ValueError("it is not UTF-8") from None


def _check_size(text: str) -> None:
    """Depth and number of values, before anything is made of them. What is no JSON is left to the parser."""
    bare = _TEXT.sub("", text).translate(_SPACE)
    letters = np.frombuffer(bare.encode("utf-32-le", "surrogatepass"), np.uint32)
    opens = (letters == ord("[")) | (letters == ord("{"))
    closes = (letters == ord("]")) | (letters == ord("}"))
    depth = np.cumsum(opens.astype(np.int32) - closes)
    if depth.size and depth.max() > MOST_DEPTH:
        raise ValueError(f"more than {MOST_DEPTH} values inside each other")
    empty = bare.count("[]") + bare.count("{}")
    if 1 + bare.count(",") + int(opens.sum()) - empty > MOST_VALUES:
        raise ValueError(f"more than {MOST_VALUES} values")


def _refuse(text: str) -> Any:
    raise ValueError(f"{text[:40]} is not a number that every reader can hold")


def _finite(text: str) -> float:
    value = float(text)
    return value if math.isfinite(value) else float(_refuse(text))


def _number(text: str) -> int | float:
    value = _finite(text)
    return int(value) if value.is_integer() and abs(value) <= LARGEST else value


def _integer(text: str) -> int:
    if len(text) > len("-9007199254740992") or abs(int(text)) > LARGEST:
        _refuse(text)
    return int(text)


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    made = dict(pairs)
    if len(made) < len(pairs):
        twice = next(name for name, times in Counter(name for name, _ in pairs).items() if times > 1)
        raise ValueError(f"a name stands twice: {twice[:40]!r}")
    return made
