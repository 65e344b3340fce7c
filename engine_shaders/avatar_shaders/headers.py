"""The headers of hlsl/ that are made from the tables of the bundle format: constants.hlsli and rules.hlsli."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import Any

_HEADER = """\
// {what}. Generated from avatar_schema/v1/{table} by `python -m avatar_shaders`; do not edit.
// Reads: nothing. Writes: nothing.
#ifndef AVATAR_{guard}_HLSLI
#define AVATAR_{guard}_HLSLI
"""
_END = "\n#endif\n"


def made_headers() -> dict[str, str]:
    """{file name in hlsl/: text} of every header that is made."""
    return {"constants.hlsli": constants_hlsli(), "rules.hlsli": rules_hlsli()}


def constants_hlsli() -> str:
    """Text of constants.hlsli: a macro a number, AVATAR_<NAME> or AVATAR_<NAME>_<index>, with reason and source."""
    lines = [_HEADER.format(what="Render constants", table="constants.json", guard="CONSTANTS")]
    for name, entry in table("constants.json").items():
        lines.append(f"// {entry['reason']} [{entry['source']}]")
        value = entry["value"]
        numbers = {f"_{i}": v for i, v in enumerate(value)} if isinstance(value, list) else {"": value}
        lines += [f"#define AVATAR_{name.upper()}{index} {literal(v)}" for index, v in numbers.items()]
    return "\n".join([*lines, _END])


def rules_hlsli() -> str:
    """Text of rules.hlsli: a macro a value of a rule, AVATAR_<RULE>_<VALUE>; hosts set constants to these codes."""
    lines = [_HEADER.format(what="Codes of the values of rules", table="rules.json", guard="RULES")]
    for name, rule in table("rules.json")["rules"].items():
        lines.append(f"// {name}: {rule['about']} [schema/SPEC.md, section {rule['spec']}]")
        codes = {f"AVATAR_{name}_{value['name']}".upper(): value["code"] for value in rule["values"]}
        lines += [f"#define {macro} {code}" for macro, code in codes.items()]
    return "\n".join([*lines, _END])


def literal(value: float | int) -> str:
    """A number as every HLSL compiler reads it: all digits of the double, float32 by its suffix."""
    if isinstance(value, int):
        return str(value)
    text = f"{value!r}f"
    return f"({text})" if value < 0 else text


def idle_table() -> dict[str, tuple[str, Any]]:
    """name -> (reason, value) of idle.json. A list of rows is one of [channel, number of the row, numbers ...]."""
    return {
        name: (entry["reason"], _by_channel(entry["value"])) for name, entry in table("idle.json").items()
    }


def _by_channel(value: Any) -> Any:
    if not isinstance(value, list) or not isinstance(value[0], list):
        return value
    return [
        [channel, place, *numbers]
        for place, (channels, *numbers) in enumerate(value)
        for channel in channels.split()
    ]


def table(name: str) -> dict[str, Any]:
    """A table of avatar_schema/v1 as plain data."""
    data: dict[str, Any] = json.loads((files("avatar_schema") / "v1" / name).read_text("utf-8"))
    return data
