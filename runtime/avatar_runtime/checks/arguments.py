"""Checks of what a caller passes. Each raises TypeError or ValueError and names the argument."""

from __future__ import annotations

import operator
import os
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

F64 = npt.NDArray[np.float64]
T = TypeVar("T")
SHOWN = 40  # characters of a text in a message


def described(value: object) -> str:
    """What `value` is, in a few words: its type, and of an array its shape."""
    if value is None:
        return "None"
    if isinstance(value, np.ndarray):
        return f"an array {value.dtype}{list(value.shape)}"
    if isinstance(value, str):
        return f"the text {value[:SHOWN]!r}"
    return _one(type(value).__name__)


def _one(noun: str) -> str:
    return f"{'an' if noun[0].lower() in 'aeiou' else 'a'} {noun}"


def wrong_type(name: str, value: object, want: str) -> TypeError:
    """The error for an argument of another type; `want` is what is needed, in words."""
    return TypeError(f"{name} is {described(value)}; {want} is needed")


def instance(name: str, value: object, kind: type[T], want: str | None = None) -> T:
    """`value` itself. Raises TypeError unless it is a `kind`, in words `want`."""
    if not isinstance(value, kind):
        raise wrong_type(name, value, want or _one(kind.__name__))
    return value


def mapping(name: str, value: object) -> Mapping[Any, Any]:
    """`value` itself. Raises TypeError unless it is a mapping."""
    if not isinstance(value, Mapping):
        raise wrong_type(name, value, "a mapping by name")
    return value


def text(name: str, value: object, known: Iterable[str]) -> str:
    """`value` itself. Raises TypeError unless it is a text, ValueError unless it is among `known`."""
    found = instance(name, value, str, "a text")
    known = tuple(known)
    if found not in known:
        raise ValueError(f"{name}: {found[:SHOWN]!r} is not one of {', '.join(known)}")
    return found


def path(name: str, value: object) -> Path:
    """`value` as a path. Raises TypeError unless it is a text or a path."""
    if not isinstance(value, str | os.PathLike):
        raise wrong_type(name, value, "a path")
    return Path(value)


def whole(name: str, value: Any, least: float = -np.inf, most: float = np.inf) -> int:
    """`value` as an int. Raises TypeError unless it is a whole number, ValueError unless it is `least` to `most`."""
    try:
        found = operator.index(value)
    except TypeError:
        raise wrong_type(name, value, "a whole number") from None
    if not least <= found <= most:
        raise ValueError(f"{name} is {found}; {least} to {most} is needed")
    return found


def real(name: str, value: Any) -> float:
    """`value` as a float, which may be NaN or infinite.

    Raises TypeError unless it is one real number, ValueError for an integer that no float can hold.
    """
    if type(value) is float:
        return value
    dimensions: int = getattr(value, "ndim", 0)
    if isinstance(value, str | bytes | bytearray | np.complexfloating) or dimensions:
        raise wrong_type(name, value, "a number")
    try:
        return float(value)
    except OverflowError:
        raise ValueError(f"{name} is too large for a float") from None
    except (TypeError, ValueError):
        raise wrong_type(name, value, "a number") from None


def finite(name: str, value: Any) -> float:
    """`value` as a float. Raises TypeError as `real`, ValueError for NaN and infinity."""
    found = real(name, value)
    if not np.isfinite(found):
        raise ValueError(f"{name} is {found}; a finite number is needed")
    return found


def array(name: str, value: Any, shape: Sequence[int]) -> F64:
    """`value` as an array of `shape`, which may hold NaN and infinities.

    Raises TypeError unless it holds real numbers, ValueError for another shape.
    """
    try:
        found = np.asarray(value)
    except (TypeError, ValueError, RuntimeError):  # rows of several lengths, or a tensor on a GPU
        raise wrong_type(name, value, f"an array {list(shape)}") from None
    if found.dtype.kind not in "fiub":
        raise wrong_type(name, value, f"an array {list(shape)} of real numbers")
    if found.shape != tuple(shape):
        raise ValueError(f"{name} has shape {list(found.shape)}; {list(shape)} is needed")
    return found.astype(np.float64, copy=False)


def finite_array(name: str, value: Any, shape: Sequence[int]) -> F64:
    """`value` as an array of `shape`. Raises as `array`, and ValueError for a number that is not finite."""
    found = array(name, value, shape)
    if not np.isfinite(found).all():
        raise ValueError(f"{name} holds a number that is not finite")
    return found
