"""JSON of a file, and why a text could not be read as such."""

from __future__ import annotations

import json
from typing import Any

from avatar_runtime.io.errors import AvatarError


def parse_json(text: str | bytes, file: object, owner: str | None = None) -> Any:
    """The value in the `text` of a file. Raises AvatarError that says where it is no JSON."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise AvatarError(f"is not valid JSON ({json_fault(error)})", file=file, owner=owner) from None


def json_fault(error: ValueError | RecursionError) -> str:
    """What is wrong with the text for which `json.loads` raised `error`: the line, or one plain reason."""
    if isinstance(error, json.JSONDecodeError):
        return f"line {error.lineno}, column {error.colno}: {error.msg}"
    if isinstance(error, UnicodeDecodeError):
        return "it is not UTF-8 text"
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    return str(error)[:80]
