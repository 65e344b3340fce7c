"""The made files of players/native/src/made: interfaces and constants of the shaders as C++. A build has no Python."""

from __future__ import annotations

import json
import re
from typing import Any

from avatar_schema.pack_form import form_lines
from avatar_shaders import VERSION
from avatar_shaders.headers import idle_table, table
from avatar_shaders.web import macros

_MADE = "// Made from the HLSL of avatar_shaders by `python -m avatar_shaders`; do not edit.\n"
_NEEDED = {"polar_steps", "sh_c0", "sh_c1", "sh_c2", "shadow_size"}
_NEEDED |= {"threads", "sort_digits", "sort_items", "sort_block"}
_WIDTH = 118  # of a line that holds several items
_BLOCK = {"uint": "uint", "float": "float1", "float2": "float2", "float3": "float3", "float4": "float4"}


def cpp_files(made: dict[str, str]) -> dict[str, str]:
    """{file name: text} of every file. `made` is what generate_all() makes."""
    rows: dict[str, dict[str, Any]] = json.loads(made["reflection.json"])["entries"]
    texts = {
        "interfaces.cpp": _interfaces(rows),
        "constants.h": _constants(),
        "pack_form.h": _form(),
        "idle.h": _idle(),
    }
    return {name: _MADE + text for name, text in texts.items()}


def _form() -> str:
    """The form of a pack's document, in lines: some compilers take no longer literals."""
    lines = "".join(f"    {json.dumps(line)},\n" for line in form_lines(2000))
    about = "/// What the document of a pack must be: JSON, cut into lines.\n"
    head = f"#pragma once\n\nnamespace avatar {{\n\n{about}"
    return f"{head}constexpr const char* pack_form[] = {{\n{lines}}};\n\n}}  // namespace avatar\n"


def _interfaces(rows: dict[str, dict[str, Any]]) -> str:
    compute = {name: row for name, row in rows.items() if row["kind"] == "compute"}
    arrays = _Arrays()
    tables = "".join(_tables(name, row, arrays) for name, row in compute.items())
    listed = "".join(f"    {_interface(name, row)},\n" for name, row in compute.items())
    whole = (
        f"const Interface interfaces[] = {{\n{listed}}};\nconst uint32_t interface_count = {len(compute)};\n"
    )
    head = '#include "../pack/contracts.h"\n\nnamespace avatar {\nnamespace {\n\n'
    return head + tables + "}  // namespace\n\n" + whole + "\n}  // namespace avatar\n"


def _tables(name: str, row: dict[str, Any], arrays: _Arrays) -> str:
    """The arrays of an entry that no earlier entry has."""
    (block,) = row["uniform_blocks"]
    storage = [
        f"{{{_text(s['name'])}, {s['binding']}, {s['stride']}, {_flag(s['readonly'])}}}"
        for s in row["storage"]
    ]
    members = [
        f"{{{_text(m['name'])}, {m['offset']}, ConstantType::{_BLOCK[m['type']]}}}" for m in block["members"]
    ]
    found = _array("StorageBuffer", f"{name}_storage", storage) + _array("Member", f"{name}_members", members)
    return found + (_contract(name, row["access"], arrays) if "access" in row else "")


def _contract(name: str, access: dict[str, Any], arrays: _Arrays) -> str:
    """A contract, with its keys in the order of struct Contract."""
    most = arrays.of("Most", [f"{{{_text(k)}, {v}}}" for k, v in access.get("most", {}).items()])
    values = arrays.of(
        "Values", [f"{{{_text(k)}, {arrays.numbers(v)}}}" for k, v in access.get("values", {}).items()]
    )
    fits = arrays.of("NamePair", [f"{{{_text(a)}, {_text(b)}}}" for a, b in access.get("fits", [])])
    pose = arrays.of("NamePair", [f"{{{_text(a)}, {_text(b)}}}" for a, b in access.get("pose", {}).items()])
    same = arrays.of(
        "Same", [f"{{{_text(k)}, {arrays.names(v)}}}" for k, v in access.get("same", {}).items()]
    )
    level = arrays.names(access.get("level", []))
    elements = arrays.of(
        "Touched",
        [
            f"{{{_text(k)}, {_text(one['elements'])}, {arrays.when(one)}}}"
            for k, rows in access.get("elements", {}).items()
            for one in rows
        ],
    )
    sections = arrays.of(
        "SectionContract", [_section(k, v, arrays) for k, v in access.get("sections", {}).items()]
    )
    parts = [_text(access["rows"]), most, values, fits, pose, same, _text(access.get("chunk")), level]
    body = _filled([*parts, elements, sections])
    return arrays.taken() + f"const Contract {name}_access = {{\n{body}}};\n\n"


def _section(name: str, section: dict[str, Any], arrays: _Arrays) -> str:
    parts = [
        _text(name),
        _text(section["buffer"]),
        f"SectionKind::{_kind(section['kind'])}",
        _text(section["elements"]),
    ]
    parts += [
        _text(section.get("width")),
        arrays.numbers(section.get("widths", [32])),
        _text(section.get("below")),
    ]
    parts += [str(section.get("pointer", 0)), _text(section.get("scale")), _text(section.get("floats"))]
    return "{" + ", ".join([*parts, arrays.when(section)]) + "}"


def _kind(name: str) -> str:
    return f"{name}_" if name == "signed" else name


class _Arrays:
    """Arrays of contracts, each written once."""

    def __init__(self) -> None:
        self._text = ""
        self._known: dict[str, str] = {}

    def taken(self) -> str:
        """What declares those that are new since the last call."""
        text, self._text = self._text, ""
        return text

    def of(self, kind: str, items: list[str]) -> str:
        """A list of these items."""
        if not items:
            return "{nullptr, 0}"
        made = ", ".join(items)
        key = f"{kind} {made}"
        if key not in self._known:
            name = self._known[key] = f"list_{len(self._known)}"
            self._text += _array(kind, name, items)
        return f"{{{self._known[key]}, {len(items)}}}"

    def numbers(self, values: list[int]) -> str:
        """A list of whole numbers."""
        return self.of("uint32_t", [str(value) for value in values])

    def names(self, values: list[str]) -> str:
        """A list of names."""
        return self.of("char* const", [_text(value) for value in values])

    def when(self, part: dict[str, Any]) -> str:
        """The conditions of a part of a contract."""
        rows = part.get("when", {})
        return self.of("Values", [f"{{{_text(k)}, {self.numbers(v)}}}" for k, v in rows.items()])


def _interface(name: str, row: dict[str, Any]) -> str:
    (block,) = row["uniform_blocks"]
    access = f"&{name}_access" if "access" in row else "nullptr"
    lists = f"{{{name}_storage, {len(row['storage'])}}}, {{{name}_members, {len(block['members'])}}}"
    size = f"{row['thread_group'][0]}, {block['binding']}, {block['size']}"
    return f"{{{_text(name)}, {_text(row['stage'])}, {size}, {lists}, {access}}}"


def _array(kind: str, name: str, items: list[str]) -> str:
    kind = f"const {kind}"
    line = f"{kind} {name}[] = {{{', '.join(items)}}};\n"
    return line if len(line) <= _WIDTH else f"{kind} {name}[] = {{\n{_filled(items)}}};\n"


def _filled(items: list[str]) -> str:
    """Lines of as many items as they hold."""
    lines = [""]
    for item in items:
        if lines[-1] and len(lines[-1]) + len(item) + 2 > _WIDTH:
            lines.append("")
        lines[-1] += f" {item}," if lines[-1] else f"    {item},"
    return "".join(f"{line}\n" for line in lines)


def _constants() -> str:
    """The numbers of the shaders that the player's own code needs."""
    lines = [
        _constant(
            "uint32_t", "shader_version", str(VERSION), "Of the kernels. A pack of newer ones is refused."
        )
    ]
    for name, entry in table("constants.json").items():
        value = entry["value"]
        if name in _NEEDED:
            kind = "uint32_t" if isinstance(value, int) else "double"
            number, listed = repr(value), isinstance(value, list)
            text = f"{{{number[1:-1]}}}" if listed else number
            lines.append(_constant(kind, f"{name}[]" if listed else name, text, entry["reason"]))
    for name, number, about in macros():
        if name.lower() not in _NEEDED:
            continue
        formula = re.sub(r"[A-Z_]{2,}", lambda found: found[0].lower(), number)
        lines.append(_constant("uint32_t", name.lower(), formula, about))
    head = "#pragma once\n#include <cstdint>\n\nnamespace avatar {\n\n"
    return head + "\n".join(lines) + "\n}  // namespace avatar\n"


def _idle() -> str:
    """The numbers of idle life."""
    row = "/// A channel, the number of its curve, and the curve's numbers.\nstruct Row {\n"
    row += "    const char* channel;\n    int row;\n    double numbers[2];\n};\n"
    lines = [row]
    for name, (about, value) in idle_table().items():
        if not isinstance(value, list):
            lines.append(_constant("double", name, repr(value), about))
        elif not isinstance(value[0], list):
            lines.append(_constant("double", f"{name}[]", f"{{{', '.join(map(repr, value))}}}", about))
        else:
            rows = [
                f'{{"{channel}", {place}, {{{", ".join(map(repr, numbers))}}}}}'
                for channel, place, *numbers in value
            ]
            lines.append(_constant("Row", f"{name}[]", f"{{\n{_filled(rows)}}}", about))
    head = "#pragma once\n\nnamespace avatar {\nnamespace idle_table {\n\n"
    return head + "\n".join(lines) + "\n}  // namespace idle_table\n}  // namespace avatar\n"


def _constant(kind: str, name: str, value: str, about: str) -> str:
    return f"/// {about[0].upper() + about[1:].rstrip('.')}.\nconstexpr {kind} {name} = {value};\n"


def _text(value: str | None) -> str:
    return "nullptr" if value is None else json.dumps(value)


def _flag(value: bool) -> str:
    return "true" if value else "false"
