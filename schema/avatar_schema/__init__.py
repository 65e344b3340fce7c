"""The bundle format: JSON Schemas, constants and version rules. See SPEC.md beside this package."""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import Any

LATEST = "1.0"


@cache
def _text(name: str) -> str:
    return (files(__package__) / "v1" / name).read_text("utf-8")


def schema(name: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) called `name`, e.g. "avatar"; a fresh copy."""
    document: dict[str, Any] = json.loads(_text(f"{name}.schema.json"))
    return document


@cache
def constants() -> dict[str, Any]:
    """Every render constant by name; values only. constants.json gives each its reason and source."""
    return {name: entry["value"] for name, entry in json.loads(_text("constants.json")).items()}
