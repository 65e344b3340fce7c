"""hlsl/constants.hlsli from the constants of the bundle format."""

from __future__ import annotations

import json
from importlib.resources import files

HEADER = """\
// Render constants. Generated from avatar_schema/v1/constants.json by `python -m avatar_shaders`; do not edit.
// Reads: nothing. Writes: nothing.
#ifndef AVATAR_CONSTANTS_HLSLI
#define AVATAR_CONSTANTS_HLSLI
"""


def constants_hlsli() -> str:
    """Text of constants.hlsli: a macro a number, AVATAR_<NAME> or AVATAR_<NAME>_<index>, with reason and source."""
    table = json.loads((files("avatar_schema") / "v1" / "constants.json").read_text("utf-8"))
    lines = [HEADER]
    for name, entry in table.items():
        lines.append(f"// {entry['reason']} [{entry['source']}]")
        value = entry["value"]
        numbers = {f"_{i}": v for i, v in enumerate(value)} if isinstance(value, list) else {"": value}
        lines += [f"#define AVATAR_{name.upper()}{index} {literal(v)}" for index, v in numbers.items()]
    return "\n".join([*lines, "\n#endif\n"])


def literal(value: float | int) -> str:
    """A number as every HLSL compiler reads it: all digits of the double, float32 by its suffix."""
    if isinstance(value, int):
        return str(value)
    text = f"{value!r}f"
    return f"({text})" if value < 0 else text
