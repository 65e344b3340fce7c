"""Captures tracked by metrical-tracker, in INSTA's and Gaussian Blendshapes' layout.

checkpoint/ID.frame (torch.save of a dict) with images/ID.png. Root and neck rest; the camera holds the head's pose.
Rotations are six numbers, the first two rows of a matrix before Gram-Schmidt; eyelids are added after skinning.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export import ReadOptions
from avatar_export.bodies import subject_files
from avatar_export.formats import npy, pth
from avatar_runtime import F64, AvatarError, PoseArrays
from avatar_runtime import rotation as runtime_rotation
from avatar_trainer.captures import image_files
from avatar_trainer.captures.bodies import FLAME_JOINTS, Body, body_of_model, check_flame, found_inputs
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.rows import MAX_FRAMES, Row, check_rows

PATTERN = "checkpoint/*.frame"
IMAGES = "images"
FPS = 25.0  # the rate to which the tracker converts videos; the files do not store it
MAX_VALUES = 1000  # of one array of a frame; FLAME has 300 + 100 coefficients
SAME_IDENTITY = 0.01  # largest standard deviation: one take has one identity
# Folders of mattes beside images/ and what they hold, in order; INSTA's images carry theirs as alpha.
MATTES = {"masks": "grey mattes in masks/", "mask": "grey mattes in mask/"}
NOT_MATTES = {"seg_mask": "classes of a face parser", "matted": "images before INSTA's postprocess.py"}


@dataclass(frozen=True)
class Tracked:
    """The numbers of one .frame file that are used."""

    file: Path
    expression: F64  # [E]
    shape: F64  # [S]
    eyelids: F64  # [2] left, right; zeros where the tracker had none
    joints: F64  # [3, 3, 3] rotations of jaw, left eye, right eye
    intrinsics: F64  # [3, 3]
    rotation: F64  # [3, 3] camera from world
    translation: F64  # [3] metres
    size: tuple[int, int]  # width, height of the images it was tracked in


def read(folder: Path, given: ReadOptions) -> Capture:
    """The capture in `folder`. Raises AvatarError naming the .frame file for everything that CAPTURE.md lists."""
    files = sorted(folder.glob(PATTERN))
    if len(files) > MAX_FRAMES:
        raise AvatarError(f"holds {len(files)} frames; up to {MAX_FRAMES} are read", file=folder)
    tracked = [read_tracked(file) for file in files]
    body = body_of_model(found_inputs(folder, given, shape=files[0]))
    check_flame(body)
    _check_alike(tracked)
    matte, how = _mattes(folder, files[0].stem)
    rows = [_row(one, body, folder, matte) for one in tracked]
    frames = check_rows(rows, body.expression_names, tracked[0].size)
    return Capture(
        name=folder.resolve().name,
        folder=folder,
        width=tracked[0].size[0],
        height=tracked[0].size[1],
        fps=FPS,
        rig=body.rig,
        expression_names=body.expression_names,
        eyelids=body.eyelids,
        head_pose_in="camera",
        frames=frames,
        export_inputs=body.export_inputs,
        layout=f"metrical-tracker {PATTERN}, {how}",
        notes=(f"{FPS:g} frames a second are taken; the tracker's files do not say",),
    )


def read_tracked(file: Path) -> Tracked:
    """One .frame file. Raises AvatarError for an array that is missing, has another shape or is not numeric."""
    content = pth.read_frame(file)
    flame, opencv = (_part(content, name, file) for name in ("flame", "opencv"))
    lids = _array(flame, "flame", "eyelids", (2,), file) if "eyelids" in flame else np.zeros(2)
    jaw = _array(flame, "flame", "jaw", (6,), file)
    eyes = _array(flame, "flame", "eyes", (12,), file)
    size = _array(content, "", "img_size", (2,), file)
    if (size != np.round(size)).any() or not ((size >= 1) & (size <= image_files.MAX_SIDE)).all():
        raise AvatarError(
            f"is {size.tolist()}, expected height and width in pixels", file=file, field="img_size"
        )
    return Tracked(
        file,
        _array(flame, "flame", "exp", (None,), file),
        _array(flame, "flame", "shape", (None,), file),
        lids,
        _rotations(np.concatenate([jaw, eyes]).reshape(3, 2, 3), file),
        _array(opencv, "opencv", "K", (3, 3), file),
        _array(opencv, "opencv", "R", (3, 3), file),
        _array(opencv, "opencv", "t", (3,), file),
        (int(size[1]), int(size[0])),
    )


def rotation_from_6d(rows: npt.NDArray[Any]) -> F64:
    """Rotations [..., 3, 3] whose first two rows are `rows` [..., 2, 3] after Gram-Schmidt (Zhou et al. 2019)."""
    first = rows[..., 0, :] / np.linalg.norm(rows[..., 0, :], axis=-1, keepdims=True)
    second = rows[..., 1, :] - (first * rows[..., 1, :]).sum(axis=-1, keepdims=True) * first
    second = second / np.linalg.norm(second, axis=-1, keepdims=True)
    return np.stack([first, second, np.cross(first, second)], axis=-2)


def _rotations(rows: F64, file: Path) -> F64:
    with np.errstate(all="ignore"):
        found = rotation_from_6d(rows)
    for name, matrix in zip(("jaw", "eyes[0:6]", "eyes[6:12]"), found, strict=True):
        if not np.isfinite(matrix).all():
            raise AvatarError(
                "is not a rotation: its two rows are parallel or zero", file=file, field=f"flame.{name}"
            )
    return found


def _row(one: Tracked, body: Body, folder: Path, matte: str) -> Row:
    names, known = body.rig.joint_names, len(body.expression_names)
    if len(one.expression) > known and one.expression[known:].any():
        raise AvatarError(
            f"has {len(one.expression)} values, the body model {known} expressions: it was tracked with another",
            file=one.file,
            field="flame.exp",
        )
    if one.eyelids.any() and not body.eyelids:
        raise AvatarError(
            f"moves the eyelids, but there are no {' and '.join(subject_files.EYELID_FILES.values())} "
            "(they come with the tracker); pass --eyelids FOLDER",
            file=one.file,
            field="flame.eyelids",
        )
    weights = np.zeros(known, np.float32)
    weights[: len(one.expression)] = one.expression[:known]
    delta = np.tile(np.eye(4), (len(names), 1, 1))
    delta[[names.index(joint) for joint in FLAME_JOINTS[2:]]] = runtime_rotation.homogeneous(one.joints)
    name = f"{one.file.stem}.png"
    return Row(
        one.file,
        "",
        folder / IMAGES / name,
        folder / matte / name,
        one.intrinsics,
        one.rotation,
        one.translation,
        PoseArrays(weights, one.eyelids[: len(body.eyelids)].astype(np.float32), delta, np.eye(4)),
        None,
    )


def _mattes(folder: Path, first: str) -> tuple[str, str]:
    """(folder of the mattes, what they are), found from the first frame."""
    for name, what in MATTES.items():
        if (folder / name).is_dir():
            return name, f"images in {IMAGES}/, {what}"
    if image_files.header(folder / IMAGES / f"{first}.png").mode == "RGBA":
        return IMAGES, f"images in {IMAGES}/, their alpha is the matte (INSTA)"
    others = [f"{name}/ holds {what}" for name, what in NOT_MATTES.items() if (folder / name).is_dir()]
    raise AvatarError(
        f"has no alpha, and there is no folder of mattes ({' or '.join(MATTES)}); {'; '.join(others) or 'none else'}: "
        "INSTA's generate.sh writes images with alpha",
        file=folder / IMAGES / f"{first}.png",
    )


def _check_alike(tracked: Sequence[Tracked]) -> None:
    first = tracked[0]
    for one in tracked[1:]:
        if one.size != first.size:
            raise AvatarError(
                f"is {one.size[0]}x{one.size[1]}, {first.file.name} has {first.size[0]}x{first.size[1]}; "
                "all images are of one size",
                file=one.file,
                field="img_size",
            )
        if one.shape.shape != first.shape.shape or np.abs(one.shape - first.shape).max() > SAME_IDENTITY:
            raise AvatarError(
                f"has another identity than {first.file.name}: frames of two people or two takes in one folder",
                file=one.file,
                field="flame.shape",
            )


def _part(content: Mapping[str, object], name: str, file: Path) -> Mapping[str, object]:
    part = content.get(name)
    if not isinstance(part, dict):
        raise AvatarError("is missing; metrical-tracker writes it", file=file, field=name)
    return part


def _array(
    part: Mapping[str, object], owner: str, name: str, shape: tuple[int | None, ...], file: Path
) -> F64:
    """Finite numbers of `shape`, None for any size; leading axes of size 1 in the file are ignored."""
    source, field = part.get(name), f"{owner}.{name}" if owner else name
    if isinstance(source, (list, tuple)) and all(type(v) in (int, float) for v in source):
        source = np.array(source, np.float64)
    elif not isinstance(source, (npy.StoredArray, npy.ComputedArray)):
        raise AvatarError("is missing" if source is None else "is not an array", file=file, field=field)
    sizes = tuple(source.shape)
    while len(sizes) > len(shape) and sizes[0] == 1:
        sizes = sizes[1:]
    fits = len(sizes) == len(shape) and all(w in (None, n) for w, n in zip(shape, sizes, strict=True))
    if not fits or source.dtype.kind not in "fiu" or int(np.prod(sizes)) > MAX_VALUES:
        want = ", ".join("any" if n is None else str(n) for n in shape)
        raise AvatarError(
            f"is {source.dtype}{list(source.shape)}, expected numbers [{want}]", file=file, field=field
        )
    values = np.asarray(source if isinstance(source, np.ndarray) else source.read(), np.float64).reshape(
        sizes
    )
    if not np.isfinite(values).all():
        at = [int(i[0]) for i in np.nonzero(~np.isfinite(values))]
        raise AvatarError(
            f"{at} is {values[tuple(at)]}, which is not a usable number", file=file, field=field
        )
    return values
