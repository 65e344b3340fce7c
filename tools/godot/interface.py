"""Makes players/godot/extension/made/engine.h: what the extension uses of the engine's C interface, and no more.

`python -m tools.godot.interface FOLDER` reads what `godot --dump-gdextension-interface-json --dump-extension-api` wrote
into FOLDER; `--check` compares instead of writing. The extension's own text says what it uses: `engine.NAME` is a
function, METHOD(Class, name) a method, Class_NAME a constant of a class.
"""

from __future__ import annotations

import argparse
import json
import re
import sys
from pathlib import Path
from typing import Any

EXTENSION = Path(__file__).parents[2] / "players/godot/extension"
MADE = EXTENSION / "made/engine.h"
_FUNCTION = re.compile(r"\bengine\.(\w+)\(")
_METHOD = re.compile(r"\bMETHOD\((\w+), (\w+)\)")
_CONSTANT = re.compile(r"\b([A-Z][A-Za-z0-9]+)_([A-Z][A-Z0-9_]+)\b")
_WORD = re.compile(r"\bGD(?:Extension|Object)\w+")
_HEAD = """\
// Made by `python -m tools.godot.interface` of what Godot {version} prints (--dump-gdextension-interface-json,
// --dump-extension-api): the types, functions, methods and constants that this folder uses. Names and values are
// Godot's (MIT licence, NOTICE.md).
#pragma once
#include <cstddef>
#include <cstdint>

"""
_LOAD = """\
    template <class Function>
    static bool load(GDExtensionInterfaceGetProcAddress get, const char* name, Function& function) {
        function = reinterpret_cast<Function>(get(name));
        return function != nullptr;
    }
"""


def engine_header(folder: Path) -> str:
    """The text of engine.h. Raises SystemExit with a line for a name that the engine does not have."""
    interface = json.loads((folder / "gdextension_interface.json").read_text("utf-8"))
    api = json.loads((folder / "extension_api.json").read_text("utf-8"))
    text = "\n".join(
        path.read_text("utf-8")
        for path in sorted(EXTENSION.rglob("*.*"))
        if path.suffix in (".h", ".cpp") and path != MADE
    )
    rows = {row["name"]: row for row in interface["interface"]}
    names = [name for name in dict.fromkeys(_FUNCTION.findall(text)) if name != "load"]
    functions = [_known(rows, name, "interface function") for name in sorted(names)]
    head = api["header"]
    version = ".".join(str(head[f"version_{part}"]) for part in ("major", "minor", "patch"))
    return (
        _HEAD.format(version=version)
        + "\n".join(_types(interface["types"], json.dumps(functions) + text))
        + "\n\n/// The functions of the engine's interface.\nstruct EngineFunctions {\n"
        + "".join(f"    {_signature(row, '(*' + row['name'] + ')')};\n" for row in functions)
        + "    bool load(GDExtensionInterfaceGetProcAddress get) {\n        return "
        + " &&\n            ".join(f'load(get, "{row["name"]}", {row["name"]})' for row in functions)
        + f";\n    }}\n{_LOAD}}};\n\nenum : int64_t {{\n"
        + "".join(_hashes(api, text))
        + "};\n\nenum : int64_t {\n"
        + "".join(_constants(api, text))
        + "};\n"
    )


def _known(rows: dict[str, Any], name: str, what: str) -> dict[str, Any]:
    if name not in rows:
        sys.exit(f"interface: the engine has no {what} {name}")
    row: dict[str, Any] = rows[name]
    return row


def _types(types: list[dict[str, Any]], text: str) -> list[str]:
    """The declarations of the types that `text` names, and of those that these name, in the engine's order."""
    by_name = {row["name"]: row for row in types}
    values = {v["name"]: row["name"] for row in types if row["kind"] == "enum" for v in row["values"]}
    wanted: set[str] = {"GDExtensionInterfaceFunctionPtr", "GDExtensionInterfaceGetProcAddress"}
    left = [word for word in _words(text) | wanted if word in by_name or word in values]
    seen: set[str] = set()
    while left:
        name = values.get(word := left.pop(), word)
        if name not in seen and name in by_name:
            seen.add(name)
            left += _words(json.dumps({k: v for k, v in by_name[name].items() if k != "description"}))
    return [_declared(row) for row in types if row["name"] in seen]


def _words(text: str) -> set[str]:
    return set(_WORD.findall(text)) | set(re.findall(r"\bGDEXTENSION_\w+", text))


def _declared(row: dict[str, Any]) -> str:
    name, kind = row["name"], row["kind"]
    if kind == "enum":
        inside = "".join(f"    {v['name']} = {v['value']},\n" for v in row["values"])
        return f"typedef enum {{\n{inside}}} {name};"
    if kind == "handle":
        return f"typedef {'const ' if row.get('is_const') else ''}void* {name};"
    if kind == "alias":
        return f"typedef {row['type']} {name};"
    if kind == "struct":
        inside = "".join(f"    {_member(m)};\n" for m in row["members"])
        return f"typedef struct {{\n{inside}}} {name};"
    return f"typedef {_signature(row, '(*' + name + ')')};"


def _member(row: dict[str, Any]) -> str:
    return f"{row['type']} {row['name']}"


def _signature(row: dict[str, Any], name: str) -> str:
    given = ", ".join(argument["type"] for argument in row.get("arguments", []))
    return f"{row.get('return_value', {}).get('type', 'void')} {name}({given})"


def _hashes(api: dict[str, Any], text: str) -> list[str]:
    classes = {row["name"]: row for row in api["classes"]}
    made = []
    for owner, name in sorted(set(_METHOD.findall(text)) - {("owner", "name")}):
        methods = {m["name"]: m for m in _known(classes, owner, "class").get("methods", [])}
        made.append(f"    hash_{owner}_{name} = {_known(methods, name, f'method {owner}.')['hash']},\n")
    return made


def _constants(api: dict[str, Any], text: str) -> list[str]:
    found: dict[str, int] = {}
    for row in api["classes"]:
        values = [v for e in row.get("enums", []) for v in e["values"]] + row.get("constants", [])
        found |= {f"{row['name']}_{v['name']}": v["value"] for v in values}
    used = {f"{owner}_{name}" for owner, name in _CONSTANT.findall(text)}
    return [f"    {name} = {found[name]},\n" for name in sorted(used & set(found))]


def main() -> None:
    """Writes engine.h, or says with `--check` that it is not what the engine prints."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--check", action="store_true")
    given = parser.parse_args()
    text = engine_header(given.folder)
    if given.check:
        if MADE.read_text("utf-8") != text:
            sys.exit(f"interface: {MADE} is not what this engine prints; run without --check")
        return
    MADE.parent.mkdir(exist_ok=True)
    MADE.write_text(text, "utf-8")


if __name__ == "__main__":
    main()
