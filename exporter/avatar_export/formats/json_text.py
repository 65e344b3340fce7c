"""Why a text could not be read as JSON, in words for an error message."""

from __future__ import annotations

import json


def json_fault(error: ValueError | RecursionError) -> str:
    """What is wrong with the text for which `json.loads` raised `error`: the line, or one plain reason."""
    if isinstance(error, json.JSONDecodeError):
        return f"line {error.lineno}, column {error.colno}: {error.msg}"
    if isinstance(error, UnicodeDecodeError):
        return "it is not UTF-8 text"
    if isinstance(error, RecursionError):
        return "it is nested too deeply"
    return str(error)[:80]
