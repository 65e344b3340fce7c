"""What is said of a misfit, and when it is refused: one table of limits for all inputs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from avatar_export.fit.known import Change, unit_of
from avatar_export.notes import DOUBT
from avatar_runtime.io.errors import AvatarError

WARNED, REFUSED = 0.05, 0.25  # of the size: medians above are doubtful, and are refused
LEAST_SAID = 1e-6  # metres
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


def length(metres: float) -> str:
    """A length with three digits, in mm below a metre."""
    if abs(metres) < LEAST_SAID:
        return f"less than {1000 * LEAST_SAID:g} mm"
    return f"{1000 * metres:.3g} mm" if abs(metres) < 1 else f"{metres:.3g} m"


def percent(share: float) -> str:
    """A share of a size, in percent or as a multiple."""
    return f"{100 * share:.2g} % of" if share < 1 else f"{share:.3g} times"


def judged(text: str, share: float, cause: str | None, sides: Sides) -> list[str]:
    """`text` as a doubt if the misfit is `share` of the size above WARNED, or if a `cause` is known; else nothing.

    Raises AvatarError above REFUSED, unless the misfit is accepted."""
    said = text if cause is None else f"{text}; {cause}"
    if share > REFUSED and not sides.accept:
        raise AvatarError(f"{said}; {ACCEPT}", file=sides.file, owner=sides.owner)
    return [f"{DOUBT}{said}"] if share > WARNED or cause is not None else []


def mend(change: Change, median: float, sides: Sides) -> str:
    """What would make the two fit, and how well: the option or the change of a file."""
    steps = []
    if change.scale != 1:
        steps.append(_unit(change.scale, sides))
    if change.turns:
        steps.append(
            f"if x, y, z of {sides.goal} were turned, which are {change.axes} of {sides.own} "
            "(+Y is up, the face looks along +Z)"
        )
    if any(change.shift):
        scale = change.scale if not sides.own_unit else 1.0
        moved = ", ".join(f"{round(-value / scale, 4) + 0.0:g}" for value in change.shift)
        steps.append(f"if {sides.goal} were moved by ({moved}) m")
    left = median / (change.scale if not sides.own_unit else 1.0)
    return f"it would be {length(left)} {' and '.join(steps)}"


def _unit(scale: float, sides: Sides) -> str:
    if sides.option is not None and sides.own_unit:
        return f"with {sides.option} {sides.value / scale:.6g}"
    if sides.own_unit:
        return f"if {sides.own} were {scale:.4g} times larger"
    return (
        f"if {sides.goal} were in metres: its lengths seem to be {unit_of(scale)}; divide them by {scale:.4g}"
    )
