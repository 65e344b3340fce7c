"""The made files of players/unity/Core/Made: interfaces and constants of the shaders as C#."""

from __future__ import annotations

import html
import json
import re
from typing import Any

from avatar_shaders import VERSION
from avatar_shaders.headers import table
from avatar_shaders.web import macros

_MADE = "// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.\n"
_OPEN = "namespace AvatarExport.Core\n{\n"
_INDENT = 4 * " "


def csharp_files(made: dict[str, str]) -> dict[str, str]:
    """{file name: text} of every file. `made` is what generate_all() makes."""
    rows: dict[str, dict[str, Any]] = json.loads(made["reflection.json"])["entries"]
    return {"Interfaces.cs": _MADE + _interfaces(rows), "Constants.cs": _MADE + _constants()}


def _interfaces(rows: dict[str, dict[str, Any]]) -> str:
    entries = {name: _interface(row) for name, row in rows.items() if row["kind"] == "compute"}
    about = "Every compute entry of the shaders, by name."
    head = "using System.Collections.Generic;\n\n" + _OPEN + _class("Interfaces", "What the shaders bind.")
    field = "public static readonly Dictionary<string, Interface> All = new Dictionary<string, Interface>\n"
    lines = _indented("".join(f'["{name}"] = {text},\n' for name, text in entries.items()), 1)
    body = _summary(about) + field + "{\n" + lines + "};\n"
    return head + _indented(body, 2) + _INDENT + "}\n}\n"


def _interface(row: dict[str, Any]) -> str:
    (block,) = row["uniform_blocks"]
    storage = [
        f"new StorageBuffer({_text(s['name'])}, {s['stride']}, {_flag(s['readonly'])})"
        for s in row["storage"]
    ]
    members = [f"new Member({_text(m['name'])}, {m['offset']}, {_text(m['type'])})" for m in block["members"]]
    access = _object("Contract", row["access"]) if "access" in row else "null"
    parts = [_text(row["stage"]), str(row["thread_group"][0]), _list(storage), _list(members), access]
    return "new Interface(\n" + _indented(",\n".join(parts), 1).rstrip("\n") + ")"


def _list(items: list[str]) -> str:
    return "new[]\n{\n" + _indented("".join(f"{item},\n" for item in items), 1) + "}"


def _object(kind: str, members: dict[str, Any]) -> str:
    lines = [f"{_pascal(name)} ={_member(name, value)},\n" for name, value in members.items()]
    return f"new {kind}\n{{\n" + _indented("".join(lines), 1) + "}"


def _member(name: str, value: Any) -> str:
    if not isinstance(value, dict):
        return " " + _value(value)
    kind = {"elements": "Touched", "sections": "SectionContract"}.get(name)
    rows = {key: _told(kind, one) for key, one in value.items()}
    return "\n{\n" + _indented("".join(f"[{_text(key)}] = {row},\n" for key, row in rows.items()), 1) + "}"


def _told(kind: str | None, value: Any) -> str:
    if kind is None:
        return _value(value)
    if isinstance(value, list):
        return _list([_object(kind, one) for one in value])
    return _object(kind, value)


def _value(value: Any) -> str:
    if isinstance(value, list):
        return "new[] { " + ", ".join(map(_value, value)) + " }"
    return _text(value) if isinstance(value, str) else str(value)


def _constants() -> str:
    """The numbers of the shaders that a player's own code may need."""
    about = "Version of the kernels. A pack that needs a newer one is refused."
    lines = [_constant("int", "Shaders", str(VERSION), about)]
    for name, entry in table("constants.json").items():
        value = entry["value"]
        if not isinstance(value, list):
            kind = "int" if isinstance(value, int) else "double"
            lines.append(_constant(kind, _pascal(name), repr(value), entry["reason"]))
    for name, number, about in macros():
        formula = re.sub(r"[A-Z_]{2,}", lambda found: _pascal(found[0].lower()), number)
        lines.append(_constant("int", _pascal(name.lower()), formula, about))
    head = _OPEN + _class("Constants", "Numbers of the shaders.")
    return head + _indented("\n".join(lines), 2) + _INDENT + "}\n}\n"


def _constant(kind: str, name: str, value: str, about: str) -> str:
    return _summary(about) + f"public const {kind} {name} = {value};\n"


def _class(name: str, about: str) -> str:
    return _indented(_summary(about) + f"public static class {name}\n{{\n", 1)


def _summary(about: str) -> str:
    capital = about[0].upper() + about[1:] if about[1].isalpha() else about
    return f"/// <summary>{html.escape(capital.rstrip('.'), quote=False)}.</summary>\n"


def _indented(text: str, steps: int) -> str:
    return re.sub(r"^(?=.)", steps * _INDENT, text, flags=re.MULTILINE)


def _text(value: str) -> str:
    return json.dumps(value)


def _flag(value: bool) -> str:
    return "true" if value else "false"


def _pascal(name: str) -> str:
    return "".join(part[:1].upper() + part[1:] for part in name.split("_"))
