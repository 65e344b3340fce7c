"""The interface of an entry from the JSON that `spirv-cross --reflect` gives."""

from __future__ import annotations

import json
import re
from typing import Any

from avatar_shaders.entries import LANGUAGES, Entry
from avatar_shaders.spirv import CONSTANTS_BINDING

_HLSL = {  # as HLSL spells a type
    **{f"vec{n}": f"float{n}" for n in (2, 3, 4)},
    **{f"uvec{n}": f"uint{n}" for n in (2, 3, 4)},
    **{f"ivec{n}": f"int{n}" for n in (2, 3, 4)},
}
_SHARED = re.compile(r"^shared (\w+) \w+((?:\[\d+\])*);", re.MULTILINE)


def interface(name: str, row: Entry, reflected: str, glsl: str) -> dict[str, Any]:
    """One row of reflection.json. `glsl` is the GLSL ES 3.10 of the entry: shared memory is counted in it."""
    reflection = json.loads(reflected)
    types = reflection.get("types", {})
    result: dict[str, Any] = {
        "hlsl": row.hlsl,
        "kind": row.kind,
        "stage": row.stage,
        "entry_point": {language: "main" if language.startswith("glsl") else name for language in LANGUAGES},
        "storage": [_storage(s, types) for s in _by_binding(reflection.get("ssbos", []))],
        "uniform_blocks": [_block(u, types) for u in reflection.get("ubos", [])],
        "textures": [
            {"name": t["name"], "binding": t["binding"]} for t in reflection.get("separate_images", [])
        ],
    }
    if row.kind == "compute":
        result["thread_group"] = reflection["entryPoints"][0]["workgroup_size"]
        result["shared_bytes"] = sum(_bytes(*found) for found in _SHARED.findall(glsl))
    if row.kind == "vertex":
        inputs = sorted(reflection.get("inputs", []), key=lambda i: i["location"])
        result["inputs"] = [
            {"name": _plain(i["name"]), "location": i["location"], "type": _type(i["type"])} for i in inputs
        ]
    return result


def _by_binding(resources: list[dict[str, Any]]) -> list[dict[str, Any]]:
    return sorted(resources, key=lambda r: int(r["binding"]))


def _storage(buffer: dict[str, Any], types: dict[str, Any]) -> dict[str, Any]:
    (data,) = types[buffer["type"]]["members"]
    return {
        "name": buffer["name"],
        "binding": buffer["binding"],
        "type": _type(data["type"]),
        "stride": data["array_stride"],
        "readonly": buffer.get("readonly", False),
    }


def _block(block: dict[str, Any], types: dict[str, Any]) -> dict[str, Any]:
    members = []
    for member in types[block["type"]]["members"]:
        entry = {"name": member["name"], "offset": member["offset"], "type": _type(member["type"])}
        if "array" in member:
            entry |= {"count": member["array"][0], "stride": member["array_stride"]}
        members.append(entry)
    # spirv-cross gives the end of the last member; the size of a GL block is a multiple of 16.
    size = -(-block["block_size"] // 16) * 16
    return {"name": block["name"], "binding": CONSTANTS_BINDING, "size": size, "members": members}


def _type(glsl: str) -> str:
    return _HLSL.get(glsl, glsl)


def _plain(name: str) -> str:
    return name.replace(".", "_").replace("@", "_")


def _bytes(kind: str, dimensions: str) -> int:
    components = int(kind[-1]) if kind[-1].isdigit() else 1
    count = 1
    for size in re.findall(r"\d+", dimensions):
        count *= int(size)
    return 4 * components * count
