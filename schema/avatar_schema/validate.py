"""Checks documents against their JSON Schema and the version rules. Problems come back as data, with JSON paths."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.validators import extend

from avatar_schema.documents import LATEST, schema

MOST_PROBLEMS = 100  # a damaged or hostile manifest could have millions
BOUNDED_NUMBER = {"type", "minimum", "maximum"}  # the keys of such a schema
EXTENSIONS: tuple[str, ...] = ()  # the ones this version understands


@dataclass(frozen=True)
class Problem:
    """One thing wrong with a manifest; a `warning` does not stop a reader."""

    path: str  # JSON path, e.g. "$.groups[1].binding"
    message: str
    warning: bool = False

    def __str__(self) -> str:
        return f"{self.path}: {self.message}"


def manifest_problems(manifest: Any) -> list[Problem]:
    """All problems of a parsed avatar.json. A version that cannot be read is the only problem that is returned."""
    return document_problems(manifest, "avatar")


def document_problems(document: Any, name: str) -> list[Problem]:
    """As `manifest_problems`, for a document with versions in `asset` and the schema called `name`."""
    if not isinstance(document, dict):
        return [Problem("$", "is not a JSON object")]
    problems = version_problems(document)
    if any(not p.warning for p in problems):
        return problems
    return problems + schema_problems(document, name)


def schema_problems(document: Any, name: str) -> list[Problem]:
    """Problems of a parsed document against the schema called `name`, without the versions; at most MOST_PROBLEMS."""
    return _problems(document, schema(name))


def key_problems(value: Any, key: str) -> list[Problem]:
    """Problems of a value that a manifest has under the top-level `key`; at most MOST_PROBLEMS."""
    return _problems(value, schema("avatar")["properties"][key])


def _problems(document: Any, of: dict[str, Any]) -> list[Problem]:
    errors = islice(_Validator(of).iter_errors(document), MOST_PROBLEMS)
    ordered = sorted(errors, key=lambda e: (e.json_path, e.message))
    return [Problem(error.json_path, _message(error)) for error in ordered]


def _items(validator: Any, items: Any, instance: Any, schema: Any) -> Iterator[Any]:
    """As the draft says. A row of bounded numbers is checked in one pass: a capture has a million of them."""
    bounded = isinstance(items, dict) and items.keys() == BOUNDED_NUMBER and items["type"] == "number"
    if bounded and isinstance(instance, list):
        low, high = items["minimum"], items["maximum"]
        if all(type(number) in (int, float) and low <= number <= high for number in instance):
            return
    yield from Draft202012Validator.VALIDATORS["items"](validator, items, instance, schema)


_Validator = extend(Draft202012Validator, {"items": _items})  # type: ignore[no-untyped-call]


def version_problems(manifest: dict[str, Any]) -> list[Problem]:
    """Refuse a newer major, an unmet minVersion and an unknown required extension; warn on a newer minor."""
    asset = manifest.get("asset")
    version = parse_version(asset.get("version") if isinstance(asset, dict) else None)
    minimum = parse_version(asset.get("minVersion") if isinstance(asset, dict) else None)
    if version is None or minimum is None:
        return [Problem("$.asset", 'needs version and minVersion, each "MAJOR.MINOR"')]
    ours = parse_version(LATEST) or (1, 0)
    if version[0] != ours[0] or minimum > ours:
        need = f"{version[0]}.{version[1]} (needs a reader of {minimum[0]}.{minimum[1]})"
        return [Problem("$.asset.version", f"is {need}; this reader knows {LATEST}: update avatar-export")]
    problems = []
    if version > ours:
        problems.append(
            Problem(
                "$.asset.version",
                f"{version[0]}.{version[1]} is newer than {LATEST}; reading what is known",
                True,
            )
        )
    required = manifest.get("extensionsRequired", [])
    for name in required if isinstance(required, list) else []:
        if name not in EXTENSIONS:
            problems.append(Problem("$.extensionsRequired", f"{name!r} is not known to this reader"))
    return problems


def parse_version(text: Any) -> tuple[int, int] | None:
    """(major, minor), or None for anything but "MAJOR.MINOR"."""
    if not isinstance(text, str):
        return None
    parts = text.split(".")
    if len(parts) != 2 or not all(p.isascii() and p.isdigit() and len(p) <= 9 for p in parts):
        return None
    return int(parts[0]), int(parts[1])


def _message(error: Any) -> str:
    message = str(error.message)
    if error.validator == "enum":
        known = ", ".join(map(str, error.validator_value))
        message = f"{_short(error.instance)} is unknown to this reader (it knows {known})"
    elif error.validator == "oneOf" and "description" in error.schema:
        message = f"{_short(error.instance)} is not {error.schema['description']}"
    return message if len(message) <= 200 else message[:200] + "..."


def _short(instance: Any) -> str:
    text = repr(instance)
    return text if len(text) <= 80 else text[:80] + "..."
