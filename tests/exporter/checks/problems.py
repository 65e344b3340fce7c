"""The problems of a bundle as plain tuples."""

from __future__ import annotations

from pathlib import Path

from avatar_export.checks.bundle import validate


def found(path: Path) -> list[tuple[str, str, bool]]:
    """(path, message, whether it is a warning) of every problem."""
    return [(p.path, p.message, p.warning) for p in validate(path)]
