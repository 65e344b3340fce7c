"""Compares the outputs of a stage with the reference, element by element."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F64
from avatar_runtime.conformance.arrays import FLIP_STEP
from avatar_runtime.conformance.model import Expected, Step, Tensor

Mask = npt.NDArray[np.bool_]
Compared = tuple[F64, Mask]  # differences, and which rows lie on the other side of a threshold


@dataclass(frozen=True)
class Element:
    """One element of an array, and what it should be."""

    index: tuple[int, ...]  # the row first
    got: float
    want: float
    allowed: float  # how far apart the two may be; 0 for one that counts as a flip


@dataclass(frozen=True)
class Verdict:
    """How far one array lies from its reference."""

    error: float  # largest absolute difference, without flips
    used: float  # largest share of the tolerance that an element takes up; 1 is the most that passes
    flips: int  # rows or pixels on the other side of a threshold
    most_flips: int
    note: str = ""  # why nothing could be compared; `used` is then infinite
    worst: Element | None = field(
        default=None, compare=False
    )  # the element that uses most of its tolerance, or the largest of too many flips

    @property
    def passed(self) -> bool:
        """Whether every element is within its tolerance and no more elements flip than may."""
        return self.used <= 1 and self.flips <= self.most_flips


def judge(step: Step, got: Mapping[str, Tensor], tensors: Mapping[str, Tensor]) -> dict[str, Verdict]:
    """A verdict for every output of `step`, by array."""
    drawn = _drawn_in_both(step, got, tensors)
    brightest = (
        max(1.0, float(np.abs(tensors[step.inputs["rgb"]]).max(initial=0.0))) if "rgb" in step.inputs else 1.0
    )
    verdicts = {}
    for array, expected in step.outputs.items():
        want = tensors[expected.tensor]
        if array not in got or np.shape(got[array]) != want.shape:
            found = "nothing" if array not in got else f"shape {list(np.shape(got[array]))}"
            verdicts[array] = Verdict(np.inf, np.inf, 0, 0, f"gave {found}, expected {list(want.shape)}")
            continue
        with np.errstate(invalid="ignore"):  # a signalling NaN
            have, want = np.asarray(got[array], np.float64), want.astype(np.float64)
        weight = None if expected.weight is None else tensors[expected.weight].astype(np.float64)
        allowed = np.broadcast_to(_allowed(expected, want, weight), want.shape)
        difference, flipped = RULES[expected.flips](have, want, allowed, brightest)
        if drawn is not None and expected.flips != "drawn":
            difference = np.where(drawn.reshape(-1, *(1,) * (want.ndim - 1)), difference, 0.0)
        verdicts[array] = _verdict(have, want, allowed, difference, flipped, expected.most_flips)
    return verdicts


def _verdict(have: F64, want: F64, allowed: F64, difference: F64, flipped: Mask, most: int) -> Verdict:
    """Of `flipped` rows only the number is judged."""
    flips = int(flipped.sum())
    left = np.where(flipped.reshape(-1, *(1,) * (want.ndim - 1)), 0.0, difference)
    share = _share(left, allowed)
    error, used = _largest(left), _largest(share)
    if not want.size:
        return Verdict(error, used, flips, most)
    by = share if used > 1 or flips <= most else difference - left
    at = tuple(map(int, np.unravel_index(int(np.argmax(by)), want.shape)))
    limit = 0.0 if by is not share else float(allowed[at])
    return Verdict(error, used, flips, most, worst=Element(at, float(have[at]), float(want[at]), limit))


def _allowed(expected: Expected, want: F64, weight: F64 | None) -> F64:
    rows = 1.0 if weight is None else weight.reshape(-1, *(1,) * (want.ndim - 1))
    allowed: F64 = expected.atol * rows + expected.rtol * np.abs(want)
    return allowed


def _drawn_in_both(step: Step, got: Mapping[str, Tensor], tensors: Mapping[str, Tensor]) -> Mask | None:
    """Of a stage with a radius: rows that are drawn, or not drawn, in both; None for any other stage."""
    if "radius" not in step.outputs:
        return None
    want = tensors[step.outputs["radius"].tensor]
    have = got.get("radius")
    if have is None or have.shape != want.shape:
        return np.ones(len(want), bool)
    same: Mask = (have > 0) == (want > 0)
    return same


def _close(have: F64, want: F64, allowed: F64, brightest: float) -> Compared:
    return _difference(have, want), np.zeros(len(want), bool)


def _either_sign(have: F64, want: F64, allowed: F64, brightest: float) -> Compared:
    """q and -q are the same rotation."""
    plus, minus = _difference(have, want), _difference(-have, want)
    nearer = np.where((plus.max(axis=1) <= minus.max(axis=1))[:, None], plus, minus)
    return nearer, np.zeros(len(want), bool)


def _ceil(have: F64, want: F64, allowed: F64, brightest: float) -> Compared:
    """A whole number that may be one off, or gone; anything else is wrong."""
    off = _difference(have, want)
    return off, np.isfinite(off) & ((off == 1) | ((have == 0) != (want == 0)))


def _cutoff(have: F64, want: F64, allowed: F64, brightest: float) -> Compared:
    """Pixels [P, ...]: differences beyond the tolerance that a threshold explains are counted separately."""
    difference = _difference(have, want)
    rest = tuple(range(1, want.ndim))
    over = (difference > allowed).any(axis=rest)
    step = difference.max(axis=rest, initial=0.0)
    return difference, over & (step <= FLIP_STEP * brightest)


def _shadow(have: F64, want: F64, allowed: F64, brightest: float) -> Compared:
    """Texels or rows beyond the tolerance, whatever they are."""
    difference = _difference(have, want)
    over = np.asarray(difference > allowed, bool).reshape(len(want), -1)
    return difference, np.asarray(over.any(axis=1), bool)


RULES: Mapping[str | None, Callable[[F64, F64, F64, float], Compared]] = {
    None: _close,
    "sign": _either_sign,
    "drawn": _ceil,
    "cutoff": _cutoff,
    "shadow": _shadow,
}


def _difference(have: F64, want: F64) -> F64:
    """Magnitudes; NaN counts as infinite."""
    with np.errstate(invalid="ignore"):
        difference: F64 = np.nan_to_num(np.abs(have - want), nan=np.inf, posinf=np.inf)
    return difference


def _largest(difference: F64) -> float:
    return float(difference.max(initial=0.0))


def _share(difference: F64, allowed: F64) -> F64:
    """Difference / allowed; 0 for equal values, even if the allowed difference is 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        share: F64 = np.where(difference == 0, 0.0, difference / allowed)
    return share
