"""Names and NumPy arrays as USD values."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt
from pxr import Vt

from avatar_runtime.avatar import F32
from avatar_runtime.engine_pose import unique_names
from avatar_runtime.io.errors import AvatarError

Array = npt.NDArray[Any]
Box = F32  # [2, 3] smallest and largest corner
LARGEST_HALF = float(np.finfo(np.float16).max)


def text(name: str) -> str:
    """`name`, if it is a valid USD token. Raises AvatarError for NUL and for half a surrogate pair."""
    try:
        name.encode()
    except UnicodeEncodeError:
        raise AvatarError("has half a surrogate pair; rename it", field=f"name {name!a:.80}") from None
    if "\0" in name:
        raise AvatarError(
            "has the character NUL, which USD cannot store; rename it", field=f"name {name!a:.80}"
        )
    return name


def prim_names(names: Iterable[str]) -> tuple[str, ...]:
    """The names as different identifiers that every USD release accepts: other characters become `_`."""
    plain = (re.sub(r"[^A-Za-z0-9_]", "_", name) for name in names)
    return unique_names(f"_{name}" if not name or name[0].isdigit() else name for name in plain)


def tokens(names: Iterable[str]) -> Any:
    """A TokenArray. Raises AvatarError as `text`."""
    return Vt.TokenArray([text(name) for name in names])


def ints(values: Array) -> Any:
    """An IntArray of all values."""
    return Vt.IntArray.FromNumpy(np.ascontiguousarray(values, np.int32).reshape(-1))


def floats(values: Array) -> Any:
    """A FloatArray of all values."""
    return Vt.FloatArray.FromNumpy(np.ascontiguousarray(values, np.float32).reshape(-1))


def vec3f(values: Array) -> Any:
    """A Vec3fArray of rows [n, 3]."""
    return Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(values, np.float32).reshape(-1, 3))


def vec3h(values: Array) -> Any:
    """A Vec3hArray of rows [n, 3]. Half floats: 11 bits, 5e-4 of the value. Raises AvatarError above 65504."""
    if (np.abs(values) > LARGEST_HALF).any():
        raise AvatarError(
            f"{np.abs(values).max():.3g} is more than USD's half floats hold", field="joint scale"
        )
    return Vt.Vec3hArray.FromNumpy(np.ascontiguousarray(values, np.float16).reshape(-1, 3))


def quatf(xyzw: Array) -> Any:
    """A QuatfArray of rows (x, y, z, w), the memory layout of quaternions in Vt."""
    return Vt.QuatfArray.FromNumpy(np.ascontiguousarray(xyzw, np.float32).reshape(-1, 4))


def matrices(column_vector: Array) -> Any:
    """A Matrix4dArray of [n, 4, 4] that act on column vectors; those of USD act on rows, so each is transposed."""
    return Vt.Matrix4dArray.FromNumpy(np.ascontiguousarray(np.swapaxes(column_vector, -1, -2), np.float64))


def box_of(points: Array) -> Box:
    """The box of [..., 3]; corners end at the limits of float32."""
    flat, limit = points.reshape(-1, 3), np.finfo(np.float32).max
    box: Box = np.clip([flat.min(axis=0), flat.max(axis=0)], -limit, limit).astype(np.float32)
    return box
