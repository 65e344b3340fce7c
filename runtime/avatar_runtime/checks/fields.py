"""Checks that every field of an avatar has the type that the model's annotations say."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from avatar_runtime.avatar import (
    Avatar,
    Blendshapes,
    Clip,
    Driving,
    Embedding,
    Enhancer,
    Expression,
    Gaussians,
    Group,
    Packed,
    RasterSettings,
    Relight,
    Rig,
    Rules,
    SparseRows,
)
from avatar_runtime.checks import arguments
from avatar_runtime.io.errors import AvatarError

Check = Callable[[str, Any], object]
PARTS = (Blendshapes, Driving, Gaussians, RasterSettings, Rules, SparseRows)
OPTIONAL_PARTS = (Embedding, Enhancer, Relight, Rig)  # None is none
ROWS = (Clip, Expression, Group)  # tuples of them


def check_types(avatar: Avatar) -> None:
    """Raise TypeError or ValueError for a field of another type than its annotation; shapes are not looked at, except
    that an array has rows (AvatarError).
    """
    arguments.instance("avatar", avatar, Avatar)
    _fields("", avatar)


def _fields(where: str, part: Any) -> None:
    for field in fields(part):
        CHECKS[str(field.type)](where + field.name, getattr(part, field.name))


def _array(name: str, value: Any) -> None:
    if arguments.instance(name, value, np.ndarray, "a NumPy array").ndim == 0:
        raise AvatarError(f"expected an array, got a single {value.dtype}", field=name)


def _arrays(name: str, value: Any) -> None:
    for attribute, array in arguments.mapping(name, value).items():
        arguments.instance(f"{name} {attribute}", array, np.ndarray, "a NumPy array")


def _numbers(name: str, value: Any) -> None:
    for key, number in arguments.mapping(name, value).items():
        _text(f"a name in {name}", key)
        arguments.real(f"{name} {key}", number)


def _text(name: str, value: Any) -> None:
    arguments.instance(name, value, str, "a text")


def _texts(name: str, value: Any) -> None:
    for index, one in enumerate(arguments.instance(name, value, tuple)):
        _text(f"{name}[{index}]", one)


def _tuple(count: int) -> Check:
    return lambda name, value: arguments.array(name, value, (count,))


def _optional(check: Check) -> Check:
    return lambda name, value: None if value is None else check(name, value)


def _part(kind: type) -> Check:
    return lambda name, value: _fields(f"{name}.", arguments.instance(name, value, kind))


def _rows(kind: type) -> Check:
    def check(name: str, value: Any) -> None:
        for index, row in enumerate(arguments.instance(name, value, tuple)):
            _fields(f"{name}[{index}].", arguments.instance(f"{name}[{index}]", row, kind))

    return check


def _colour(name: str, value: Any) -> None:
    if not isinstance(value, str):
        arguments.array(name, value, (3,))


CHECKS: Mapping[str, Check] = {  # by annotation
    **dict.fromkeys(("F32", "I32", "U16", "U32"), _array),
    "F32 | None": _optional(_array),
    "Mapping[str, F32]": _arrays,
    "Mapping[str, float]": _numbers,
    "Mapping[str, Any]": arguments.mapping,
    "bytes": lambda name, value: arguments.instance(name, value, bytes),
    "str": _text,
    "str | None": _optional(_text),
    "tuple[str, ...]": _texts,
    "int": arguments.whole,
    "float": arguments.real,
    "float | None": _optional(arguments.real),
    "tuple[float, float]": _tuple(2),
    "tuple[float, float, float]": _tuple(3),
    "tuple[float, float, float] | str": _colour,
    "Packed | None": _optional(lambda name, value: arguments.instance(name, value, Packed)),
    **{kind.__name__: _part(kind) for kind in PARTS},
    **{f"{kind.__name__} | None": _optional(_part(kind)) for kind in OPTIONAL_PARTS},
    **{f"tuple[{kind.__name__}, ...]": _rows(kind) for kind in ROWS},
}
