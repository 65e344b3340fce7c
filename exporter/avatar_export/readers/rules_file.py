"""rules.json: the rules that a checkpoint was trained with, where the paper and the released code differ.

{"system": "splatting_avatar", "training_units_per_metre": 4, "rules": {"scale": "linear_area"}}, beside the files of
the released layout. The trainer of this project writes it; so may users who changed the released code. Other rules are
those of the released code; an unstated unit is that of the release, or assumed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from avatar_export.formats.json_text import parse_json
from avatar_export.notes.note import Note, fact
from avatar_export.options import LEAST_UNITS, MOST_UNITS
from avatar_runtime.io.errors import AvatarError, no_such
from avatar_runtime.io.whole_files import read_bytes

RULES_FILE = "rules.json"
MAX_BYTES = 1 << 16
UNITS = "training_units_per_metre"

Values = Mapping[str, tuple[str, ...]]  # the known values of each rule


@dataclass(frozen=True)
class TrainedRules:
    """The content of a rules.json; empty without a file."""

    file: Path | None
    played: Mapping[str, str]  # value of each rule that changes how the avatar is played
    recorded: Mapping[str, str]  # value of each rule whose effect is already in the stored numbers
    units: float | None = None  # training units per metre; None: not stated

    def notes(self) -> list[Note]:
        """A note on the recorded rules, if there are any."""
        return [fact("recorded_rules", file=RULES_FILE, rules=self.recorded)] if self.recorded else []


def read_rules(path: Path | None, system: str, played: Values, recorded: Values) -> TrainedRules:
    """The rules.json at `path` (None: there is no file) of a checkpoint of `system`, whose rules have those values.

    Raises AvatarError for a file that is too large, not such JSON or of another system, and for an unknown rule or
    value.
    """
    if path is None:
        return TrainedRules(None, {}, {})
    stored, units = _stored(path, system)
    known = {**played, **recorded}
    for name, value in stored.items():
        if name not in known:
            raise no_such(f"rule of {system}", name, known, file=path, field="rules", owner=system)
        if value not in known[name]:
            found = ascii(value[:40]) if isinstance(value, str) else "not text"
            raise AvatarError(
                f"is {found}, expected one of {', '.join(known[name])}",
                file=path,
                field=f"rules.{name}",
                owner=system,
            )
    return TrainedRules(
        path,
        {name: value for name, value in stored.items() if name in played},
        {name: value for name, value in stored.items() if name in recorded},
        units,
    )


def _stored(path: Path, system: str) -> tuple[dict[str, str], float | None]:
    """(the object `rules` of the file, whose values are not checked; the unit)."""
    document = parse_json(read_bytes(path, MAX_BYTES), path, system)
    if not isinstance(document, dict) or not isinstance(document.get("rules"), dict):
        raise AvatarError('is not of the form {"system": ..., "rules": {...}}', file=path, owner=system)
    if document.get("system") != system:
        found = document.get("system")
        named = ascii(found[:40]) if isinstance(found, str) else "no system"
        raise AvatarError(
            f"is for {named}, but the checkpoint beside it is of {system}",
            file=path,
            field="system",
            owner=system,
        )
    units = document.get(UNITS)
    if units is None:
        return dict(document["rules"]), None
    if type(units) not in (int, float) or not LEAST_UNITS <= units <= MOST_UNITS:
        raise AvatarError(
            f"is not a number from {LEAST_UNITS:g} to {MOST_UNITS:g}", file=path, field=UNITS, owner=system
        )
    return dict(document["rules"]), float(units)
