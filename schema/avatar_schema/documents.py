"""The documents of version 1: where their texts lie, and the two that are read as they are."""

from __future__ import annotations

import json
from functools import cache
from importlib.resources import files
from typing import Any

LATEST = "1.0"  # the newest version of the bundle format


@cache
def text(name: str) -> str:
    """The text of a file of v1/, e.g. "rules.json". Raises FileNotFoundError for another name."""
    return (files(__package__) / "v1" / name).read_text("utf-8")


def schema(name: str) -> dict[str, Any]:
    """The JSON Schema (draft 2020-12) called `name`, e.g. "avatar"; a fresh copy.

    Raises FileNotFoundError for another name.
    """
    document: dict[str, Any] = json.loads(text(f"{name}.schema.json"))
    return document


@cache
def constants() -> dict[str, Any]:
    """Every render constant by name; values only. constants.json gives each its reason and source."""
    return {name: entry["value"] for name, entry in json.loads(text("constants.json")).items()}


@cache
def idle_table() -> dict[str, Any]:
    """The numbers of idle life by name; values only. idle.json gives each its reason and source."""
    return {name: entry["value"] for name, entry in json.loads(text("idle.json")).items()}
