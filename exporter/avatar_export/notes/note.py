"""A note: its kind, the values that its text names, and how much it matters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

Severity = Literal["fact", "doubt", "misfit"]


@dataclass(frozen=True)
class Note:
    """`doubt`: something may be wrong. `misfit`: inputs do not belong together, which is refused unless accepted."""

    kind: str  # a key of `text.TEXTS`
    values: Mapping[str, Any] = field(default_factory=dict)
    severity: Severity = "fact"
    passing: bool = False  # of this conversion alone: printed, but no part of the avatar's provenance

    @property
    def doubtful(self) -> bool:
        """Whether it is a warning."""
        return self.severity != "fact"


@dataclass(frozen=True)
class Setting:
    """A setting of a training."""

    name: str  # `units`, a key of `reading.SETTINGS`, or a rule
    value: float | str
    source: str | None  # the file or option that states it, or why it is assumed; None: nothing states it


def doubt(kind: str, **values: object) -> Note:
    """A note that something may be wrong."""
    return Note(kind, values, "doubt")


def fact(kind: str, **values: object) -> Note:
    """A note that nothing is wrong with."""
    return Note(kind, values)
