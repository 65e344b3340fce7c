"""Passes that bind and set exactly what their kernel declares."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import Any

import avatar_shaders
from avatar_runtime.program.model import Constant, Pass

PADDING = "unused"  # the constant that fills a row of four
SHADERS: int = avatar_shaders.VERSION  # the newest kernels that this reader has


@cache
def interfaces() -> Mapping[str, Any]:
    """Storage buffers and constants of every entry; they are the same in all languages."""
    return avatar_shaders.reflection("glsl430")


def make_pass(entry: str, rows: int, bound: Mapping[str, str], values: Mapping[str, Constant]) -> Pass:
    """A pass of `entry` over `rows` rows; `bound` and `values` may hold more than it declares, by its names.

    Constant `unused` is padding. Raises KeyError if a name is missing.
    """
    table = interfaces()[entry]
    members = [m["name"] for block in table["uniform_blocks"] for m in block["members"]]
    return Pass(
        entry,
        rows,
        {item["name"]: bound[item["name"]] for item in table["storage"]},
        {name: values[name] for name in members if name != PADDING},
    )
