"""The manifest's schema and version rules, as data."""

from __future__ import annotations

import json
from typing import Any

import pytest

from avatar_schema import schema
from avatar_schema.validate import Problem, manifest_problems, parse_version
from tests import bundles
from tests.bundles import Document


@pytest.fixture(scope="module")
def text(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = bundles.write(tmp_path_factory.mktemp("bundle") / "good")
    return (folder / "avatar.json").read_text("utf-8")


@pytest.fixture
def document(text: str) -> Document:
    found: Document = json.loads(text)
    return found


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


def test_parse_version() -> None:
    assert parse_version("1.0") == (1, 0)
    assert parse_version("12.345678901") == (12, 345678901)
    for wrong in ("1", "1.", ".1", "1.0.0", "-1.0", "1.0 ", "1.٣", "1.1234567890", None, 1.0, ["1.0"]):
        assert parse_version(wrong) is None
