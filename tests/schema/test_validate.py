"""The manifest's schema and version rules, as data."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from avatar_schema import LATEST, constants, schema
from avatar_schema.validate import Problem, manifest_problems, parse_version
from tests import bundles
from tests.bundles import Document


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = bundles.write(tmp_path_factory.mktemp("bundle") / "good")
    return (folder / "avatar.json").read_text("utf-8")


@pytest.fixture
def document(text: str) -> Document:
    """A sound manifest to damage."""
    found: Document = json.loads(text)
    return found


def test_the_schema_is_one_and_says_its_version() -> None:
    found = schema("avatar")
    Draft202012Validator.check_schema(found)
    assert f"v{LATEST}" in found["$id"]
    found["title"] = "changed"
    assert schema("avatar")["title"] != "changed", "a fresh copy each time"


def test_the_schema_demands_every_key_but_the_optional_ones() -> None:
    optional = {"extensionsUsed", "extensionsRequired", "extras", "enhancer"}
    assert set(schema("avatar")["required"]) == set(schema("avatar")["properties"]) - optional


def test_every_required_key_is_missed_by_name(document: Document) -> None:
    assert manifest_problems(document) == []
    for key in schema("avatar")["required"]:
        if key == "asset":
            continue
        shorter = {k: v for k, v in document.items() if k != key}
        assert manifest_problems(shorter) == [Problem("$", f"'{key}' is a required property")]


def test_problems_come_in_order_and_say_where(document: Document) -> None:
    document["units"]["training_per_bundle"] = 0
    document["groups"][2]["joint_mix"]["jaw"] = "most"
    document["expressions"][1]["range"] = [0]
    document["bounds"]["rest"]["min"][0] = None
    assert [p.path for p in manifest_problems(document)] == [
        "$.bounds.rest.min[0]",
        "$.expressions[1].range",
        "$.groups[2].joint_mix.jaw",
        "$.units.training_per_bundle",
    ]


@pytest.mark.parametrize("value", [None, [], "x", 3])
def test_what_is_no_object(value: Any) -> None:
    assert manifest_problems(value) == [Problem("$", "is not a JSON object")]


@pytest.mark.parametrize("asset", [None, [], "1.0", {}, {"version": "1.0"}, {"minVersion": "1.0"}])
def test_without_versions_nothing_else_is_looked_at(asset: Any) -> None:
    (problem,) = manifest_problems({"asset": asset})
    assert problem.path == "$.asset" and not problem.warning


def test_a_long_message_is_cut(document: Document) -> None:
    document["files"][0]["path"] = "/" * 10_000
    (problem,) = manifest_problems(document)
    assert len(str(problem)) < 300


@pytest.mark.parametrize("required", ["VENDOR_x", [3], [[]]])
def test_extensions_required_of_a_wrong_kind(document: Document, required: Any) -> None:
    document["extensionsRequired"] = required
    assert all(p.path.startswith("$.extensionsRequired") for p in manifest_problems(document))
    assert manifest_problems(document)


def test_parse_version() -> None:
    assert parse_version("1.0") == (1, 0)
    assert parse_version("12.345678901") == (12, 345678901)
    for wrong in ("1", "1.", ".1", "1.0.0", "-1.0", "1.0 ", "1.٣", "1.1234567890", None, 1.0, ["1.0"]):
        assert parse_version(wrong) is None


def test_every_constant_has_a_value_a_reason_and_a_source() -> None:
    path = Path(__file__).parents[2] / "schema" / "avatar_schema" / "v1" / "constants.json"
    entries = json.loads(path.read_text("utf-8"))
    for name, entry in entries.items():
        assert set(entry) == {"value", "reason", "source"}, name
        assert len(entry["reason"]) > 15 and len(entry["source"]) > 15, name
    assert constants() == {name: entry["value"] for name, entry in entries.items()}
