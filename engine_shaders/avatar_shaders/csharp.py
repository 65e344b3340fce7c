"""The made files of players/unity/Core/Made: interfaces and constants of the shaders as C#."""

from __future__ import annotations

import html
import json
import re
import textwrap
from typing import Any

from avatar_schema.pack_form import form_lines
from avatar_shaders import VERSION
from avatar_shaders.headers import idle_table, table
from avatar_shaders.web import macros

_MADE = "// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.\n"
_OPEN = "namespace AvatarExport.Core {\n"
_INDENT = 4 * " "
_TIED = "\0"  # a space at which no line breaks
_WIDTH = 94  # of a line, without the indentation of its block


def csharp_files(made: dict[str, str]) -> dict[str, str]:
    """{file name: text} of every file. `made` is what generate_all() makes."""
    rows: dict[str, dict[str, Any]] = json.loads(made["reflection.json"])["entries"]
    made_texts = {
        "Interfaces.cs": _interfaces(rows),
        "Constants.cs": _constants(),
        "PackForm.cs": _form(),
        "IdleTable.cs": _idle(),
    }
    return {name: _MADE + text for name, text in made_texts.items()}


def _interfaces(rows: dict[str, dict[str, Any]]) -> str:
    entries = {name: _interface(row) for name, row in rows.items() if row["kind"] == "compute"}
    about = "Every compute entry of the shaders, by name."
    head = "using System.Collections.Generic;\n\n" + _OPEN + _class("Interfaces", "What the shaders bind.")
    field = "public static readonly Dictionary<string, Interface> All = new Dictionary<string, Interface> {\n"
    lines = _indented("".join(f'["{name}"] = {text},\n' for name, text in entries.items()), 1)
    body = _summary(about) + field + lines + "};\n"
    return head + _indented(body, 2) + _INDENT + "}\n}\n"


def _interface(row: dict[str, Any]) -> str:
    """A constructor: stage, buffers, members by name and, where it is not uint, type; and the contract."""
    (block,) = row["uniform_blocks"]
    storage = [
        f"new StorageBuffer({_text(s['name'])}, {s['stride']}, {_flag(s['readonly'])})"
        for s in row["storage"]
    ]
    members = [m["name"] + ("" if m["type"] == "uint" else f":{m['type']}") for m in block["members"]]
    names = textwrap.wrap(" ".join(members), _WIDTH)
    told = " +\n".join(_text(line + " ") for line in names[:-1]) + (" +\n" if names[1:] else "")
    access = _contract(row["access"]) if "access" in row else "null"
    parts = [_text(row["stage"]), _wrapped(_list(storage)), told + _text(names[-1]), access]
    return "new Interface(\n" + _indented(",\n".join(parts), 1) + ")"


def _contract(access: dict[str, Any]) -> str:
    """An object: a line for a field, and for a section."""
    lines = []
    for name, value in access.items():
        kind = {"elements": "Touched", "sections": "SectionContract"}.get(name)
        if not isinstance(value, dict):
            lines.append(f"{_pascal(name)} = {_value(value)},\n")
            continue
        rows = [f"[{_text(key)}] = {_row_text(kind, one)}" for key, one in value.items()]
        if name == "sections":
            body = "".join(_wrapped(f"{row},") + "\n" for row in rows)
            lines.append(f"{_pascal(name)} = {{\n{_indented(body, 1)}}},\n")
        else:
            lines.append(_wrapped(f"{_pascal(name)} = {{ {', '.join(rows)} }},") + "\n")
    return "new Contract {\n" + _indented("".join(lines), 1) + "}"


def _list(items: list[str]) -> str:
    return "new[] { " + ", ".join(items) + " }"


def _row_text(kind: str | None, value: Any) -> str:
    if kind is None:
        return _value(value)
    if isinstance(value, list):
        return _list([_row_text(kind, one) for one in value])
    fields = ", ".join(f"{_pascal(name)} = {_field(one)}" for name, one in value.items())
    return f"new {kind} {{ {fields} }}"


def _field(value: Any) -> str:
    if not isinstance(value, dict):
        return _value(value)
    return "{ " + ", ".join(f"[{_text(key)}] = {_value(one)}" for key, one in value.items()) + " }"


def _value(value: Any) -> str:
    if isinstance(value, list):
        return _list([_value(one) for one in value])
    return _text(value) if isinstance(value, str) else str(value)


def _wrapped(text: str) -> str:
    """Lines that break between fields and between rows alone."""
    tied = re.sub(r"(?<!,) |(?<=\d,) ", _TIED, text)
    lines = textwrap.wrap(tied, _WIDTH, subsequent_indent=_INDENT, break_long_words=False)
    return "\n".join(lines).replace(_TIED, " ")


def _constants() -> str:
    """The numbers of the shaders that a player's own code may need."""
    about = "Version of the kernels. A pack that needs a newer one is refused."
    lines = [_constant("int", "Shaders", str(VERSION), about)]
    for name, entry in table("constants.json").items():
        value = entry["value"]
        if isinstance(value, list):
            lines.append(_array(_pascal(name), value, entry["reason"]))
        else:
            kind = "int" if isinstance(value, int) else "double"
            lines.append(_constant(kind, _pascal(name), repr(value), entry["reason"]))
    for name, number, about in macros():
        formula = re.sub(r"[A-Z_]{2,}", lambda found: _pascal(found[0].lower()), number)
        lines.append(_constant("int", _pascal(name.lower()), formula, about))
    head = _OPEN + _class("Constants", "Numbers of the shaders.")
    return head + _indented("\n".join(lines), 2) + _INDENT + "}\n}\n"


def _idle() -> str:
    """The numbers of idle life."""
    lines = []
    for name, (about, value) in idle_table().items():
        if not isinstance(value, list):
            lines.append(_constant("double", _pascal(name), repr(value), about))
        elif isinstance(value[0], list):
            rows = [f'new IdleRow("{c}", {place}, {", ".join(map(repr, n))}),\n' for c, place, *n in value]
            text = f"{{\n{_indented(''.join(rows), 1)}}}"
            lines.append(_summary(about) + f"public static readonly IdleRow[] {_pascal(name)} = {text};\n")
        else:
            lines.append(_array(_pascal(name), value, about))
    head = _OPEN + _class("IdleTable", "Numbers of idle life.")
    return head + _indented("\n".join(lines), 2) + _INDENT + "}\n}\n"


def _form() -> str:
    """The form of a pack's document as one text."""
    lines = " +\n".join(_text(line) for line in form_lines(2000))
    body = (
        _summary("JSON, of the keywords that `Form` knows")
        + f"public const string Text =\n{_indented(lines, 1)};\n"
    )
    return (
        _OPEN
        + _class("PackForm", "What the document of a pack must be.")
        + _indented(body, 2)
        + _INDENT
        + "}\n}\n"
    )


def _constant(kind: str, name: str, value: str, about: str) -> str:
    return _summary(about) + f"public const {kind} {name} = {value};\n"


def _array(name: str, values: list[float], about: str) -> str:
    numbers = ", ".join(map(repr, values))
    return _summary(about) + f"public static readonly double[] {name} = {{ {numbers} }};\n"


def _class(name: str, about: str) -> str:
    return _indented(_summary(about) + f"public static class {name} {{\n", 1)


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
