"""Values in words, by the name of a form: `{median:length}`, `{names:some}`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

LEAST_SAID = 1e-6  # metres
MOST_NAMED = 5


def length(metres: float) -> str:
    """A length with three digits, in mm below a metre."""
    if abs(metres) < LEAST_SAID:
        return f"less than {1000 * LEAST_SAID:g} mm"
    return f"{1000 * metres:.3g} mm" if abs(metres) < 1 else f"{metres:.3g} m"


def percent(share: float) -> str:
    """A share of a size, in percent or as a multiple."""
    return f"{100 * share:.2g} % of" if share < 1 else f"{share:.3g} times"


def units(per_metre: float) -> str:
    """Training units a metre."""
    return f"{per_metre:g} training unit{'s' * (per_metre != 1)} a metre"


def some(names: Sequence[str]) -> str:
    """The first names."""
    return ", ".join(names[:MOST_NAMED]) + " ..." * (len(names) > MOST_NAMED)


def over(names: Sequence[str]) -> str:
    """What was passed over, behind what was taken; nothing where there was no choice."""
    if not names:
        return ""
    more = f" and {len(names) - MOST_NAMED} more" * (len(names) > MOST_NAMED)
    return f"; passed over: {', '.join(names[:MOST_NAMED])}{more}"


def listed(names: Sequence[str]) -> str:
    """All names."""
    return ", ".join(names)


def each(values: Mapping[str, str]) -> str:
    """Names with their values."""
    return ", ".join(f"{name} {value}" for name, value in values.items())


def lengths(values: Mapping[str, float]) -> str:
    """Names with lengths."""
    return each({name: length(value) for name, value in values.items()})


def kilobytes(sizes: Mapping[str, int]) -> str:
    """Names with sizes."""
    return each({name.lower(): f"{size / 1e3:.1f} kB" for name, size in sizes.items()})


def many(names: Sequence[str]) -> str:
    """How many names there are."""
    return str(len(names))


FORMS: Mapping[str, Callable[[Any], str]] = {
    form.__name__: form
    for form in (length, percent, units, some, over, listed, each, lengths, kilobytes, many)
}
