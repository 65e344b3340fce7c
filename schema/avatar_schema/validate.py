"""Checks documents against their JSON Schema and the version rules. Problems come back as data, with JSON paths."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import islice
from typing import Any

from jsonschema import Draft202012Validator
from jsonschema.validators import extend

from avatar_schema.accept import Accept, Acceptors
from avatar_schema.documents import LATEST, schema
from avatar_schema.pack_form import pack_schema

MOST_PROBLEMS = 100  # a damaged or hostile manifest could have millions
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
    return _problems(document, *_checks(name))


def key_problems(value: Any, key: str) -> list[Problem]:
    """Problems of a value that a manifest has under the top-level `key`; at most MOST_PROBLEMS."""
    return _problems(value, *_checks("avatar", key))


@cache
def _checks(name: str, key: str | None = None) -> tuple[Accept, Any]:
    """(whether a document is sound, what says why not) of a schema, or of what it asks for under `key`."""
    whole = pack_schema() if name == "pack" else schema(name)
    of = whole if key is None else whole["properties"][key]
    made = Acceptors(of)

    def items(validator: Any, asked: Any, instance: Any, _: Any) -> Iterator[Any]:
        if isinstance(instance, list):  # no schema here has prefixItems
            accepts = made.of(asked)
            for index, item in enumerate(instance):
                if not accepts(item):
                    yield from validator.descend(item, asked, path=index)

    def properties(validator: Any, asked: Any, instance: Any, _: Any) -> Iterator[Any]:
        if isinstance(instance, dict):
            for key, part in asked.items():
                if key in instance and not made.of(part)(instance[key]):
                    yield from validator.descend(instance[key], part, path=key, schema_path=key)

    # Sound parts of an unsound document are passed over: most of one is sound. The stubs give `extend` no types.
    narrow = extend(Draft202012Validator, {"items": items, "properties": properties})  # type: ignore[no-untyped-call]
    return made.of(of), narrow(of)


def _problems(document: Any, accepts: Accept, validator: Any) -> list[Problem]:
    if accepts(document):
        return []
    errors = islice(validator.iter_errors(document), MOST_PROBLEMS)
    ordered = sorted(errors, key=lambda e: (e.json_path, e.message))
    return [Problem(error.json_path, _message(error)) for error in ordered]


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
    elif error.validator == "anyOf" and "description" in error.schema:
        message = error.schema["description"]
    elif error.validator == "oneOf" and "description" in error.schema:
        message = f"{_short(error.instance)} is not {error.schema['description']}"
    return message if len(message) <= 200 else message[:200] + "..."


def _short(instance: Any) -> str:
    text = repr(instance)
    return text if len(text) <= 80 else text[:80] + "..."
