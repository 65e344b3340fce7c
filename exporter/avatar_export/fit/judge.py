"""Which note a misfit gives, and when it is refused: one table of limits for all inputs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from avatar_export.fit.known import Change, unit_of
from avatar_export.notes.note import Note, fact
from avatar_export.notes.text import text
from avatar_runtime.io.errors import AvatarError

WARNED, REFUSED = 0.05, 0.25  # of the size: medians above are doubtful, and are refused
ACCEPT = "--accept-misfit converts it all the same"


@dataclass(frozen=True)
class Sides:
    """The two inputs that are compared, in the words of a message: `own` should lie on `goal`."""

    own: str  # "the Gaussians"
    goal: str  # "body_model.npz"
    owner: str  # the reader
    file: Path | None  # that a refusal names
    option: str | None = None  # that gives the unit of `own`
    value: float = 1.0  # of that option now
    own_unit: bool = True  # whether a wrong unit is more likely that of `own` than that of `goal`
    accept: bool = False  # --accept-misfit


def judged(kind: str, share: float, cause: Note | None, sides: Sides, **values: object) -> list[Note]:
    """A note of that kind if the misfit is `share` of the size above WARNED, or if a `cause` is known; else nothing.

    Raises AvatarError above REFUSED, unless the misfit is accepted."""
    if share <= WARNED and cause is None:
        return []
    whole = {"own": sides.own, "goal": sides.goal, "share": share, "cause": cause, **values}
    note = Note(kind, whole, "misfit" if share > REFUSED else "doubt")
    if note.severity == "misfit" and not sides.accept:
        raise AvatarError(f"{text(note)}; {ACCEPT}", file=sides.file, owner=sides.owner)
    return [note]


def mend(change: Change, median: float, sides: Sides) -> Note:
    """What would make the two fit, and how well: the option or the change of a file."""
    steps = []
    if change.scale != 1:
        steps.append(_unit(change.scale, sides))
    if change.turns:
        steps.append(fact("if_turned", goal=sides.goal, axes=change.axes, own=sides.own))
    if any(change.shift):
        scale = change.scale if not sides.own_unit else 1.0
        moved = ", ".join(f"{round(-value / scale, 4) + 0.0:g}" for value in change.shift)
        steps.append(fact("if_moved", goal=sides.goal, by=moved))
    return fact("mend", left=median / (change.scale if not sides.own_unit else 1.0), steps=steps)


def _unit(scale: float, sides: Sides) -> Note:
    if sides.option is not None and sides.own_unit:
        return fact("with_option", option=sides.option, value=sides.value / scale)
    if sides.own_unit:
        return fact("if_larger", own=sides.own, times=scale)
    return fact("if_metres", goal=sides.goal, unit=unit_of(scale), times=scale)
