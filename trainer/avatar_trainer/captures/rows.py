"""Frames as a reader found them, checked together: names, images, cameras, numbers, split."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime import AvatarError, Camera, PoseArrays
from avatar_trainer.captures import image_files
from avatar_trainer.captures.model import Frame

# held out: the last 350 frames as in the papers, or the last fifth of a short take
TEST_FRAMES, TEST_SHARE = 350, 5
TRAIN_FRAMES = 2  # the fewest training frames of a capture
MAX_FRAMES = 100_000
MAX_VALUE = 1e6  # of any number of a pose
ROTATION_TOLERANCE = 1e-3  # of any entry of R R^T - I


@dataclass(frozen=True)
class Row:
    """One frame as a reader found it; lengths in metres, not yet checked."""

    file: Path  # the file with its numbers
    field: str  # which of them, e.g. "frames[3]"; "" where the file is one frame
    image: Path
    mask: Path
    intrinsics: npt.NDArray[Any]  # [3, 3] pixels
    rotation: npt.NDArray[Any]  # [3, 3] camera from world
    translation: npt.NDArray[Any]  # [3] metres
    pose: PoseArrays
    split: str | None  # None: not stated
    prefix: str = ""  # of the frame's name, where images of several folders have the same names
    over: float | None = None  # as in `Frame`

    @property
    def name(self) -> str:
        """Of the frame: its image's name without the ending, after the prefix."""
        return self.prefix + self.image.stem

    def wrong(self, message: str, part: str = "") -> AvatarError:
        """An error about `part` of this row."""
        field = ".".join(filter(None, (self.field, part)))
        return AvatarError(message, file=self.file, field=field or None)


def check_rows(
    rows: Sequence[Row], expressions: Sequence[str], size: tuple[int, int] | None
) -> tuple[Frame, ...]:
    """The frames of `rows`. `size`: (width, height) as declared; None: that of the first image.

    Only headers are read. Raises AvatarError that names file and row: a duplicate name, an image
    or mask that is missing, cut off or of another size, an invalid camera, a number that is not finite, a split
    that leaves fewer than TRAIN_FRAMES frames.
    """
    _check_names(rows)
    for row in rows:
        check_pose(row, expressions)
        check_camera(row)
    width, height = check_images(rows, size)
    return tuple(
        Frame(
            row.name,
            row.image,
            row.mask,
            Camera.from_opencv(row.rotation, row.translation, row.intrinsics, width, height),
            row.pose,
            split,
            row.over,
        )
        for row, split in zip(rows, splits(rows), strict=True)
    )


def splits(rows: Sequence[Row]) -> list[str]:
    """ "train" or "test" of every row: as stated, else the last are held out (TEST_FRAMES, TEST_SHARE)."""
    said = [row.split for row in rows]
    if None in said:
        if odd := next((row for row in rows if row.split is not None), None):
            raise odd.wrong("is given here but not in every frame", "split")
        held_out = min(TEST_FRAMES, len(rows) // TEST_SHARE)
        found = ["train"] * (len(rows) - held_out) + ["test"] * held_out
    else:
        found = [str(split) for split in said]
    if found.count("train") < TRAIN_FRAMES:
        raise too_few(found.count("train"), rows[0].file if rows else None)
    return found


def too_few(count: int, file: Path | None) -> AvatarError:
    """The error for a capture with `count` frames to train on."""
    return AvatarError(
        f"leaves {count} to train on; training needs at least {TRAIN_FRAMES} frames", file=file
    )


def check_images(rows: Sequence[Row], size: tuple[int, int] | None) -> tuple[int, int]:
    """(width, height) of all images and masks. Raises AvatarError for the first that differs or is not an image."""
    says = "the capture says"
    for row in rows:
        for path in dict.fromkeys((row.image, row.mask)):
            found = image_files.header(path)
            if path == row.image:
                image_files.check_colour(path, found.mode)
            if path == row.mask:
                image_files.check_matte(path, found.mode, row.mask == row.image)
            if size is None:
                size, says = (found.width, found.height), f"{path.name}, the first, has"
            if (found.width, found.height) != size:
                raise AvatarError(
                    f"is {found.width}x{found.height} pixels, {says} {size[0]}x{size[1]}; all are of one size",
                    file=path,
                )
    if size is None:
        raise ValueError("no rows have no size")
    return size


def check_camera(row: Row) -> None:
    """Raise AvatarError unless a row's K is a camera matrix and its R a rotation."""
    for part, values in (("K", row.intrinsics), ("R", row.rotation), ("t", row.translation)):
        if not (np.abs(values) <= MAX_VALUE).all():
            raise row.wrong(f"{_first_bad(values)} is not a usable number", f"camera.{part}")
    k = row.intrinsics
    for axis in range(2):
        if not k[axis, axis] > 0:
            raise row.wrong(
                f"is singular or mirrored: focal length f{'xy'[axis]} is {k[axis, axis]:g} pixels", "camera.K"
            )
    if k[1, 0] != 0 or (k[2] != (0, 0, 1)).any():
        raise row.wrong("is not [[fx, skew, cx], [0, fy, cy], [0, 0, 1]]", "camera.K")
    if fault := rotation_fault(row.rotation):
        raise row.wrong(f"{fault}; is it camera from world?", "camera.R")


def rotation_fault(matrix: npt.NDArray[Any]) -> str | None:
    """Why a [3, 3] matrix is not a rotation, in words; None if it is one."""
    m = np.asarray(matrix, np.float64)
    off = float(np.abs(m @ m.T - np.eye(3)).max())
    if not off <= ROTATION_TOLERANCE:
        return f"is not a rotation: an entry of R R^T - I is {off:.3g}"
    return None if np.linalg.det(m) > 0 else "is not a rotation: its determinant is -1, it mirrors"


def check_pose(row: Row, expressions: Sequence[str]) -> None:
    """Raise AvatarError for a number of a row's pose that is not usable."""
    pose = row.pose
    for part, values in (
        ("expression", pose.expression_weights),
        ("eyelids", pose.late_weights),
        ("joints", pose.joint_delta),
        ("world_from_avatar", pose.world_from_avatar),
    ):
        if not (np.abs(values) <= MAX_VALUE).all():
            at = _first_bad(values)
            name = f" ({expressions[at[0]]})" if part == "expression" else ""
            raise row.wrong(f"{at}{name} is not a usable number", part)


def _first_bad(values: npt.NDArray[Any]) -> list[int]:
    return [int(i[0]) for i in np.nonzero(~(np.abs(values) <= MAX_VALUE))]


def _check_names(rows: Iterable[Row]) -> None:
    first: dict[str, Row] = {}
    for row in rows:
        earlier = first.setdefault(row.name, row)
        if earlier is not row:
            at = earlier.field or earlier.file.name
            raise row.wrong(
                f"is called {row.name!a} as {at} is; every frame needs a name of its own", "image"
            )
