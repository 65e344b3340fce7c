"""JSON documents of a capture: parsed, their version and schema checked."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from avatar_runtime import AvatarError
from avatar_runtime.io import read_bytes
from avatar_schema import validate

VERSION = "1.0"  # of capture.json and views.json


def read_document(
    file: Path,
    limit: int,
    schema: str,
    constant: Callable[[str], object] | None = None,
    first: Callable[[dict[str, Any]], object] | None = None,
) -> dict[str, Any]:
    """The JSON object in `file`, at most `limit` bytes; `constant` is called for NaN and Infinity.

    `first` sees an object of a known version before the schema does. Raises AvatarError for anything that is not
    JSON, for a newer version, and for what `schema` refuses.
    """
    try:
        document = json.loads(read_bytes(file, limit), parse_constant=constant)
    except (ValueError, RecursionError) as error:
        raise AvatarError(f"is not JSON ({type(error).__name__})", file=file) from None
    version = validate.parse_version(document.get("version")) if isinstance(document, dict) else None
    if version and version[0] > 1:
        raise AvatarError(
            f"is {document['version']}; {VERSION} is known: update avatar-export", file=file, field="version"
        )
    if first is not None and isinstance(document, dict):
        first(document)
    for problem in validate.schema_problems(document, schema):
        raise AvatarError(problem.message, file=file, field=problem.path.removeprefix("$."))
    return dict(document)
