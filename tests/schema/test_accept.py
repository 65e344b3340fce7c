"""The fast check says what the library for JSON Schema says, and problems are those that the library finds."""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import islice
from pathlib import Path
from random import Random
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from tools.fuzz.mutate import other, places

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.conformance import driving_cases, encode_driving
from avatar_schema import schema
from avatar_schema.accept import Acceptors
from avatar_schema.pack_form import pack_schema
from avatar_schema.validate import MOST_PROBLEMS, schema_problems
from tests import bundles
from tests.avatars import surface_avatar
from tests.exporter.packing.cases import opened
from tests.runtime.conformance import made
from tests.session.fuzz import examples
from tests.trainer.captures import folders

DOCUMENTS: dict[str, Callable[[Path], Any]] = {
    "avatar": lambda folder: json.loads((bundles.write(folder / "good") / "avatar.json").read_text("utf-8")),
    "capture": lambda folder: json.loads((folders.own(folder / "take") / "capture.json").read_text("utf-8")),
    "driving": lambda _: json.loads(
        next(iter(encode_driving(driving_cases(made.avatar(), generator="made for tests")).values()))
    ),
    "pack": lambda _: opened(pack([surface_avatar(3, rigged=False)], Fineness(40.0)).file)[1],
    "reference": lambda _: json.loads(made.encoded()["cases.json"]),
}
VALUES: list[Any] = [
    None, True, False, 0, 1, 2, -1, 1.0, 1.5, -0.0, 10**400, float("nan"), float("inf"), "", "a", "1", "ab", "abcdef",
    [], [1], [1, 1], [1, True], [1, 1.0], ["a"], ["a", "a"], ["a", "b", "c", 4], [[]], [{}, {}], [None, 2.0],
    [0.5, "a"], {}, {"a": 1},
    {"a": "x", "b": 2}, {"b": None}, {"c": []}, {"a": 1, "b": 2, "c": 3}, {"a": {"a": {"a": 1}}},
]  # fmt: skip
SCHEMAS: list[Any] = [
    *({"type": name} for name in ("object", "array", "string", "boolean", "null", "integer", "number")),
    {"type": ["number", "null"], "minimum": 1, "maximum": 1.5, "description": "said"},
    *({"exclusiveMinimum": 1}, {"exclusiveMaximum": 1}, {"multipleOf": 2}, {"minLength": 1, "maxLength": 2}),
    *({"pattern": "^a.$"}, {"minItems": 1, "maxItems": 2}, {"uniqueItems": True}, {"uniqueItems": False}),
    *(
        {"minProperties": 1, "maxProperties": 2},
        {"required": ["a"]},
        {"enum": [1, "a", None]},
        {"const": True},
    ),
    *({"const": 1}, {"enum": [True, 2]}, {"items": {"type": "number"}}, {"items": False}, {"items": True}),
    {"items": {"type": "number", "minimum": 0, "maximum": 1}},
    {"items": {"type": "integer", "minimum": 0, "maximum": 1}},
    {"prefixItems": [{"type": "number"}], "items": {"type": "string"}},
    {"contains": {"const": 1}, "minContains": 2},
    {"properties": {"a": {"type": "integer"}, "b": False}},
    {"properties": {"a": True}, "additionalProperties": False},
    {"properties": {"a": True}, "additionalProperties": {"type": "null"}},
    {"patternProperties": {"^a": {"type": "integer"}}, "additionalProperties": False},
    {"patternProperties": {"^a": {"type": "integer"}}, "unevaluatedProperties": False},
    {"propertyNames": {"maxLength": 1, "enum": ["a", "b"]}},
    {"anyOf": [{"type": "integer"}, {"minimum": 1.2}]},
    {"oneOf": [{"type": "integer"}, {"minimum": 1}, {"required": ["b"]}]},
    {"allOf": [{"type": "integer"}, {"minimum": 1}]},
    {"not": {"type": "integer"}},
    {"if": {"properties": {"a": {"const": 1}}}, "then": {"required": ["b"]}, "else": {"required": ["a"]}},
    {"if": {"type": "string"}, "then": {"minLength": 2}},
    {"dependentRequired": {"a": ["b"]}},
    {"$ref": "#/$defs/a~1b", "$defs": {"a/b": {"type": "integer"}}, "minimum": 1},
    {"properties": {"a": {"$ref": "#"}}, "additionalProperties": False},
]


@pytest.mark.parametrize("given", SCHEMAS, ids=json.dumps)
def test_each_keyword_accepts_what_the_library_accepts(given: Any) -> None:
    library, accepts = Draft202012Validator(given), Acceptors(given).of(given)
    for value in VALUES:
        assert accepts(value) == library.is_valid(value), value


@pytest.mark.parametrize("name", DOCUMENTS)
def test_problems_are_those_of_the_library(name: str, tmp_path: Path) -> None:
    library, rng, refused = (
        Draft202012Validator(pack_schema() if name == "pack" else schema(name)),
        Random(4),
        0,
    )
    document = DOCUMENTS[name](tmp_path)
    assert schema_problems(document, name) == []
    text = json.dumps(document)
    for _ in range(examples(100)):
        copy = json.loads(text)
        for _ in range(rng.choice((1, 1, 3))):
            holder, key = rng.choice([*places(copy)])
            holder[key] = other(holder[key], rng)
        found = [problem.path for problem in schema_problems(copy, name)]
        assert found == sorted(error.json_path for error in islice(library.iter_errors(copy), MOST_PROBLEMS))
        refused += bool(found)
    assert refused
