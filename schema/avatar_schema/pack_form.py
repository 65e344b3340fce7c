"""What the document of a pack must be: pack.schema.json, and for `avatar` the manifest's schema. For every reader."""

from __future__ import annotations

import json
from functools import cache
from itertools import product
from typing import Any

from avatar_schema.documents import schema
from avatar_schema.rule_table import Value, families, rules

# keys of a manifest that packs do not have
OF_BUNDLES = ("asset", "files", "engine", "reference", "enhancer")
SAYS_NOTHING = ("$schema", "$id", "$comment", "title", "description")
FORMATS = {  # patterns, by the names that readers without regular expressions know
    "^(0|[1-9][0-9]{0,8})\\.(0|[1-9][0-9]{0,8})$": "version",
    "^[0-9a-f]{64}$": "sha256",
}
LISTS = ("inputs", "outputs", "matrix")
MATRIX = {  # of `driving`
    "description": f"mode matrix needs the lists {', '.join(LISTS)}",
    "anyOf": [
        {"properties": {"mode": {"enum": ["names", "none"]}}},
        {"required": list(LISTS), "properties": {"matrix": {"type": "array"}}},
    ],
}
KEYWORDS = {
    "type", "required", "properties", "additionalProperties", "items", "minItems", "maxItems", "minLength", "maxLength",
    "minimum", "maximum", "exclusiveMinimum", "enum", "const", "uniqueItems", "anyOf", "$ref", "format", "$defs",
}  # fmt: skip


@cache
def pack_schema() -> dict[str, Any]:
    """The JSON Schema of a whole document."""
    pack, avatar = schema("pack"), schema("avatar")
    known = avatar["properties"]
    kept = {name: part for name, part in known.items() if name not in OF_BUNDLES}
    kept["driving"] = {**known["driving"], **MATRIX}
    required = [name for name in avatar["required"] if name not in OF_BUNDLES]
    properties = {
        **pack["properties"],
        "avatar": {"type": "object", "required": required, "properties": kept},
    }
    about = "rules, bindings and joints do not go together"
    rest = {"description": about, "anyOf": _playable(), "$defs": {**avatar["$defs"], **pack["$defs"]}}
    return {**pack, "properties": properties, **rest}


def _playable() -> list[dict[str, Any]]:
    """Which rules, bindings and joints go together: of each family of rules, with or without a rig."""
    found = []
    for family, rigged in product(families().values(), (True, False)):
        needs = set() if rigged else {"rig", "rotation_joint"}
        ruled = ("rotation", "position", "scale") if family.embedded else ("rotation", "scale")
        allowed = {
            rule: [v.name for v in _values(rule, family.name) if not needs & {*v.needs}] for rule in ruled
        }
        if not all(allowed.values()):
            continue  # no rotation of this family goes without a rig
        named = {rule: {"enum": names} for rule, names in allowed.items()}
        joints: dict[str, Any] = {"type": "array" if rigged else "null"}
        bindings = (
            ["surface"]
            if family.embedded
            else ["skin", "anchor", "joint_mix", "none"]
            if rigged
            else ["none"]
        )
        bound = {
            "items": {"properties": {"groups": {"items": {"properties": {"binding": {"enum": bindings}}}}}}
        }
        avatar = {"properties": {"rules": {"properties": named}, "joints": joints}}
        program = {"properties": {"reads_mesh": {"const": family.embedded}}}
        parts: dict[str, Any] = {"program": program, "avatar": avatar, "levels": bound}
        if family.embedded:
            parts["arrays"] = {
                "properties": {"rig.triangles": {"type": "null"}}
            }  # none: kernels read triangles
        found.append({"properties": parts})
    return found


def _values(rule: str, family: str) -> list[Value]:
    named = rules()[rule].names(family)
    return [value for value in rules()[rule].values if value.name in named]


def form_text() -> str:
    """The same as the players read it: JSON of the keywords above, without what only people read.

    `anyOf` is asked last. Where none fits, the `description` beside it says what is wrong.

    Raises ValueError for a keyword or a pattern that readers do not know.
    """
    return json.dumps(_form(pack_schema()), separators=(",", ":"))


def form_lines(width: int) -> list[str]:
    """`form_text` in pieces of `width` letters, for source files."""
    text = form_text()
    return [text[at : at + width] for at in range(0, len(text), width)]


def _form(part: Any) -> Any:
    if not isinstance(part, dict):
        raise ValueError(f"no reader knows the form {part!r}")
    made: dict[str, Any] = {}
    for word, value in part.items():
        if word in ("properties", "$defs"):
            made[word] = {name: _form(inner) for name, inner in value.items()}
        elif word == "pattern":
            made["format"] = FORMATS[value]
        elif word == "anyOf":
            made[word] = [_form(inner) for inner in value]
        elif word in ("items", "additionalProperties"):
            made[word] = _form(value)
        elif word in KEYWORDS or (word == "description" and "anyOf" in part):
            made[word] = value
        elif word not in (
            *SAYS_NOTHING,
            "oneOf",
        ):  # `oneOf`: bytes or sections of a buffer, which readers ask
            raise ValueError(f"no reader knows the keyword {word!r}")
    return made
