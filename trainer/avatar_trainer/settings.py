"""Settings of a run and of a system, and reading them from NAME=VALUE texts by the types of their fields."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from avatar_runtime import AvatarError
from avatar_runtime.io import no_such

T = TypeVar("T")
MOST = (1 << 31) - 1  # of a whole number without another bound
MOST_ITERATIONS = 10**9 - 1  # the largest number that the name of a checkpoint holds
MOST_GAUSSIANS = 1_000_000
ABOVE_ZERO = 1e-12
REFINE = ("auto", "on", "off")
Ranges = Mapping[str, tuple[float, float]]  # field -> its least and its largest value


@dataclass(frozen=True)
class Rule:
    """A choice in which a paper and its released code differ, or one of the paper's ablations."""

    values: tuple[str, ...]
    # What the released code does, and what the paper prints: one of the values, or a few words.
    released: str
    paper: str
    default: str
    about: str  # one line
    trainer_only: tuple[str, ...] = ()  # values that the released layout, and so a bundle, cannot hold


@dataclass(frozen=True)
class TrainSettings:
    """Settings of a run, for every system; ValueError for a value out of range.

    `FREE` settings may differ when a run is resumed: they do not change the trained avatar.
    """

    iterations: int = 10_000
    seed: int = 0
    rasteriser: str = "cpu"
    size: int = 0  # pixels of the longer side; 0: as captured
    refine: str = "auto"  # poses and expressions: on, off; auto: on where the capture's are estimated
    threads: int = 0  # of torch and Numba; 0: one a core
    checkpoint_every: int = 500
    log_every: int = 50
    evaluate_every: int = 1000  # held-out PSNR of a few frames; 0: at the end only
    preview_every: int = 0  # contact sheets; 0: none
    cache_megabytes: int = 2048  # of decoded images

    FREE = ("threads", "checkpoint_every", "log_every", "evaluate_every", "preview_every", "cache_megabytes")

    def __post_init__(self) -> None:
        if self.refine not in REFINE:
            raise ValueError(f"refine is {self.refine[:80]!r}; one of {', '.join(REFINE)}")
        numbers = (f.name for f in dataclasses.fields(self) if isinstance(getattr(self, f.name), int))
        anything = dict.fromkeys(numbers, (0, MOST))
        every = dict.fromkeys(("checkpoint_every", "log_every"), (1, MOST))
        expect_ranges(self, {**anything, **every, "iterations": (1, MOST_ITERATIONS)})


def expect_ranges(settings: object, ranges: Ranges) -> None:
    """Raise ValueError if a field of `settings` is out of its range."""
    for name, (least, most) in ranges.items():
        value = getattr(settings, name)
        if not least <= value <= most:
            bounds = f"at least {least}" + ("" if math.isinf(most) else f", at most {most}")
            raise ValueError(f"{name} is {value}; {bounds}")


def rule_defaults(rules: Mapping[str, Rule]) -> dict[str, str]:
    """The default of every rule."""
    return {name: rule.default for name, rule in rules.items()}


def chosen_rules(rules: Mapping[str, Rule], pairs: list[tuple[str, str]]) -> dict[str, str]:
    """Every rule's value: the default, or that in `pairs` of (name, value).

    Raises AvatarError for an unknown rule or value, with near matches, and for a duplicate rule.
    """
    chosen = rule_defaults(rules)
    _expect_once(pairs, "--rule")
    for name, value in pairs:
        if name not in rules:
            raise no_such("rule of this system", name, rules, field="--rule")
        if value not in rules[name].values:
            raise no_such(f"value of rule {name}", value, rules[name].values, field="--rule")
        chosen[name] = value
    return chosen


def settable(settings: object, without: tuple[str, ...] = ()) -> dict[str, Any]:
    """Dotted name -> value of every number, text and boolean of a dataclass, nested ones too."""
    found: dict[str, Any] = {}
    for field in dataclasses.fields(settings):  # type: ignore[arg-type]
        value = getattr(settings, field.name)
        if field.name in without:
            continue
        if dataclasses.is_dataclass(value):
            found.update({f"{field.name}.{inner}": v for inner, v in settable(value).items()})
        elif not isinstance(value, Mapping):
            found[field.name] = value
    return found


def with_values(
    settings: T,
    pairs: Iterable[tuple[str, str]],
    values: Mapping[str, object] | None = None,
    field: str = "settings",
) -> T:
    """`settings`, a dataclass, with other fields, all changed at once.

    pairs: (name, text) of fields, names of nested ones dotted; values: field -> value, None: unchanged. For a field in
    both, the text counts. `field`: the name in errors. Raises AvatarError for an unknown name, a name given twice, a
    text that is not of the field's type, and values that the dataclass refuses.
    """
    pairs = list(pairs)
    _expect_once(pairs, "--set")
    hints = get_type_hints(type(settings))
    changes = {name: value for name, value in (values or {}).items() if value is not None}
    nested: dict[str, list[tuple[str, str]]] = {}
    for name, text in pairs:
        head, dot, rest = name.partition(".")
        if name in settable(settings) and not dot:
            changes[name] = _parsed(hints[name], name, text)
        elif dot and dataclasses.is_dataclass(getattr(settings, head, None)) and head in hints:
            nested.setdefault(head, []).append((rest, text))
        else:
            raise no_such("setting", name, settable(settings), field="--set")
    for head, inner in nested.items():
        changes[head] = with_values(getattr(settings, head), inner, field=f"{field}.{head}")
    try:
        return dataclasses.replace(settings, **changes)  # type: ignore[type-var]
    except ValueError as error:
        raise AvatarError(str(error), field=field) from None


def _expect_once(pairs: Iterable[tuple[str, str]], field: str) -> None:
    names = [name for name, _ in pairs]
    for name in names:
        if names.count(name) > 1:
            raise AvatarError(f"{name[:80]} is given {names.count(name)} times", field=field)


def _parsed(kind: Any, name: str, text: str) -> Any:
    """`text` as a value of the annotated type `kind`."""
    if get_origin(kind) is tuple:
        parts = text.split(",") if text else []
        kinds = get_args(kind)
        kinds = kinds[:1] * len(parts) if kinds[-1] is Ellipsis else kinds
        if len(parts) != len(kinds):
            raise AvatarError(
                f"{name}={text[:80]!r}: expected {len(kinds)} values between commas", field="--set"
            )
        return tuple(_parsed(k, name, part) for k, part in zip(kinds, parts, strict=True))
    read, what = READ[kind]
    try:
        return read(text)
    except (ValueError, KeyError):
        raise AvatarError(f"{name}={text[:80]!r}: expected {what}", field="--set") from None


def _integer(text: str) -> int:
    if len(text) > 18:
        raise ValueError(text)
    return int(text)


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(text)
    return value


def _truth(text: str) -> bool:
    return {"true": True, "yes": True, "1": True, "false": False, "no": False, "0": False}[text.lower()]


READ: dict[Any, tuple[Any, str]] = {
    bool: (_truth, "true or false"),
    int: (_integer, "a whole number"),
    float: (_finite, "a finite number"),
    str: (str, "a text"),
}
