"""drivers.npz: what drove each frame of a dump. The names and shapes of its arrays stand here and nowhere else."""

from __future__ import annotations

import io
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.formats.archive import Archive
from avatar_export.formats.casts import as_float64
from avatar_export.formats.npy import parse_npy, parse_text_npy
from avatar_runtime.avatar import F64, I64
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.text_files import write_bytes

FILE = "drivers.npz"
MAX_ARRAY_BYTES = 1 << 30
LARGEST = 1e12  # number in a dump
LAST_ROW = (0.0, 0.0, 0.0, 1.0)  # of a matrix that is affine
LEAST_VOLUME = 1e-18  # determinant of a joint's transform that has an inverse
TEXTS = ("joint_names", "driver_names")
WHOLE = ("parents", "take")


@dataclass(frozen=True)
class Drivers:
    """Joints and drivers of F frames: right-handed, metres, the axes of the dump. The fields are the file's arrays.

    A file without joints has J = 0, one without drivers D = 0. Frames of one take belong together: whole takes are held
    out.
    """

    joint_names: tuple[str, ...]  # [J], a parent before its children
    parents: I64  # [J], -1 for a root
    rest: F64  # [J, 4, 4] mesh from joint at rest, in the pose in which skinning is the identity
    world_from_joint: F64  # [F, J, 4, 4] posed
    driver_names: tuple[str, ...]  # [D]
    drivers: F64  # [F, D] in natural units: weights of expressions
    take: I64  # [F]

    @property
    def frames(self) -> int:
        """The number of frames, F."""
        return len(self.take)


def write(drivers: Drivers, path: Path, *, force: bool) -> None:
    """Write `drivers` as an .npz. Raises AvatarError as `checked`, and if `path` exists without `force`."""
    checked(drivers, path)
    data = io.BytesIO()
    arrays = {field.name: getattr(drivers, field.name) for field in fields(Drivers)}
    arrays |= {name: np.array(arrays[name], np.str_) for name in TEXTS}
    np.savez(data, **arrays)
    write_bytes(path, data.getvalue(), force=force)


def read(path: Path) -> Drivers:
    """The drivers in an .npz. Raises AvatarError for a missing, unsound or badly shaped array."""
    arrays: dict[str, Any] = {}
    with Archive(path) as archive:
        for field in fields(Drivers):
            name = field.name
            if f"{name}.npy" not in archive.names:
                raise AvatarError("is missing", file=path, field=name)
            data = archive.read(f"{name}.npy", MAX_ARRAY_BYTES)
            arrays[name] = (parse_text_npy if name in TEXTS else _numbers)(data, path, name)
    return checked(Drivers(**arrays), path)


def checked(drivers: Drivers, file: Path) -> Drivers:
    """`drivers` itself. Raises AvatarError, which names `file`, for shapes that disagree and for unusable values."""
    j, d, f = len(drivers.joint_names), len(drivers.driver_names), drivers.frames
    for name, shape in (
        ("parents", (j,)),
        ("rest", (j, 4, 4)),
        ("world_from_joint", (f, j, 4, 4)),
        ("drivers", (f, d)),
        ("take", (f,)),
    ):
        array = getattr(drivers, name)
        if array.shape != shape:
            raise AvatarError(f"has shape {list(array.shape)}, expected {list(shape)}", file=file, field=name)
        fine = np.abs(array) <= LARGEST  # False for NaN
        if not fine.all():
            raise AvatarError(
                f"{_first(~fine)} is not a finite number of at most {LARGEST:g}", file=file, field=name
            )
    if not f:
        raise AvatarError("has no frame", file=file, field="take")
    for name in TEXTS:
        names = getattr(drivers, name)
        if len(set(names)) != len(names) or not all(names):
            raise AvatarError("holds an empty name, or a name twice", file=file, field=name)
    wrong = (drivers.parents < -1) | (drivers.parents >= np.arange(j))
    if wrong.any():
        at = int(np.argmax(wrong))
        raise AvatarError(
            f"joint {at} has parent {drivers.parents[at]}; parents must come before children",
            file=file,
            field="parents",
        )
    for name in ("rest", "world_from_joint"):
        matrix = getattr(drivers, name)
        volume = np.abs(np.linalg.det(matrix))
        bad = (matrix[..., 3, :] != LAST_ROW).any(axis=-1) | (volume < LEAST_VOLUME)
        if bad.any():
            raise AvatarError(f"{_first(bad)} is not an affine matrix with an inverse", file=file, field=name)
    return drivers


def _numbers(data: bytes, file: object, name: str) -> F64 | I64:
    source = parse_npy(data, file, name)
    kinds = "iu" if name in WHOLE else "fiu"
    if source.dtype.kind not in kinds and 0 not in source.shape:
        wanted = "whole numbers" if name in WHOLE else "numbers"
        raise AvatarError(f"has type {source.dtype}, {wanted} are needed", file=file, field=name)
    values = source.read()
    return values.astype(np.int64) if name in WHOLE else as_float64(values)


def _first(wrong: npt.NDArray[np.bool_]) -> list[int]:
    """The index of the first entry that is true."""
    return [int(index[0]) for index in np.nonzero(wrong)]
