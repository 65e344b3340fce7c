"""Tracked poses of a body model, as datasets store them beside their images.

- flame_params.json (IMavatar, SplattingAvatar's heads): shape_params [S], frames[]: expression [K], pose [15].
- poses.npz (InstantAvatar, PeopleSnapshot): betas [S], thetas [T, 72] or global_orient [T, 3] and body_pose
  [T, 69], transl [T, 3].
- flame_param.npz (GaussianAvatars): shape [S], expr [T, K], rotation, neck_pose, jaw_pose, translation [T, 3],
  eyes_pose [T, 6], static_offset [1, V, 3].

Rotations are rotation vectors, parent from joint. Cameras (world_mat, intrinsics) are not read: they do
not move, the head moves in the mesh. GaussianAvatars' dynamic_offset is not read, as its model ignores it.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np

from avatar_export.bodies.body_model import JOINT_NAMES
from avatar_export.formats.archive import Archive
from avatar_export.formats.json_text import parse_json
from avatar_export.formats.npy import parse_npy
from avatar_export.notes.note import Note, doubt, fact
from avatar_runtime.avatar import F32, F64, Clip, Rig
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.stages.joints import rest_transforms

MAX_FILE_BYTES = 512 << 20
MAX_FRAMES = 100_000
MAX_COEFFICIENTS = 1000
REGULAR, GAP = 0.8, 5  # share of images that follow each other evenly; steps between two that do not
MAX_VALUE = 1e6  # of any coefficient, angle or length
FLAME_JOINTS, SMPL_JOINTS = JOINT_NAMES[5], JOINT_NAMES[24]
# None of the files stores its rate: IMavatar's and NeRSemble's videos are cut to 25 frames a second, InstantAvatar's
# (PeopleSnapshot) run at 30.
FLAME_FPS, SMPL_FPS = 25.0, 30.0


@dataclass(frozen=True)
class BodyPoses:
    """T poses of one subject, for a body model with the joints `joint_names`."""

    joint_names: tuple[str, ...]  # [J]
    shape: F64  # [S] identity coefficients
    expression: F64  # [T, K] weights of the first K expressions
    rotation: F64  # [T, J, 3] rotation vectors, parent from joint, in mesh axes at rest
    translation: F64  # [T, 3] metres, added to every posed vertex
    static_offset: F32 | None  # [V, 3] metres, added to the template
    fps: float
    missing: tuple[int, int] | None = None  # numbers of images that nothing lies between, though it should

    @property
    def frames(self) -> int:
        """The number of frames, T."""
        return len(self.rotation)

    def notes(self, file: Path) -> list[Note]:
        """What a user should know of the poses in `file`."""
        rate = fact("rate_assumed", file=file.name, fps=self.fps)
        if self.missing is None:
            return [rate]
        return [rate, doubt("images_missing", file=file.name, last=self.missing[0], next=self.missing[1])]


def is_pose_file(path: Path) -> bool:
    """Whether `path` is named like one of the files above, or is an .npz with the fields of one; never raises."""
    if path.suffix.lower() == ".json":
        return True
    if path.suffix.lower() != ".npz":
        return False
    try:
        return _npz_kind(_names(path)) is not None
    except AvatarError:
        return False


def read_poses(path: Path) -> BodyPoses:
    """The poses in a flame_params.json, poses.npz or flame_param.npz, recognised by their fields.

    Raises AvatarError for anything else, for missing fields, wrong shapes, NaN and infinities.
    """
    if path.suffix.lower() == ".json":
        return _flame_json(path)
    kind = _npz_kind(_names(path))
    if kind is None:
        raise AvatarError("has no poses of a body model: no array thetas, body_pose or neck_pose", file=path)
    return kind(_Npz(path))


def body_clip(rig: Rig, poses: BodyPoses, name: str) -> Clip:
    """`poses` as a clip of `rig`, whose joints must have the names of the body model's.

    Posed vertices equal the body model's plus the translation, which the root joints carry. Raises AvatarError for a
    rotating joint that the rig lacks, and for more expressions than the rig has.
    """
    joints, t, k = rig.joint_count, poses.frames, rig.morphs.columns
    if poses.expression[:, k:].any():
        raise AvatarError(
            f"has {poses.expression.shape[1]} expressions, but the rig has {k}; the poses belong to another body model",
            field=name,
        )
    rotation = np.zeros((t, joints, 3))
    for j, joint in enumerate(poses.joint_names):
        if joint in rig.joint_names:
            rotation[:, rig.joint_names.index(joint)] = poses.rotation[:, j]
        elif poses.rotation[:, j].any():
            raise AvatarError(
                f"rotates joint {joint}, which the rig lacks; the poses belong to another body model",
                field=name,
            )
    rest = rest_transforms(rig)  # from a rotation in mesh axes to one in the joint's rest frame
    turn = homogeneous(np.linalg.solve(rest[:, :3, :3], matrix_from_rotvec(rotation) @ rest[:, :3, :3]))
    for root in np.flatnonzero(rig.parents < 0):
        turn[:, root, :3, 3] = np.linalg.solve(rest[root, :3, :3], poses.translation[..., None])[..., 0]
    expression = np.zeros((t, k))
    expression[:, : poses.expression.shape[1]] = poses.expression[:, :k]
    return Clip(
        name,
        poses.fps,
        expression.astype(np.float32),
        np.zeros((t, rig.late_morphs.columns), np.float32),
        turn.astype(np.float32),
        np.tile(np.eye(4, dtype=np.float32), (t, 1, 1)),
    )


def _flame_json(path: Path) -> BodyPoses:
    document = parse_json(read_bytes(path, MAX_FILE_BYTES), path)
    frames = document.get("frames") if isinstance(document, dict) else None
    if not isinstance(frames, list) or not frames or not all(isinstance(frame, dict) for frame in frames):
        raise AvatarError(
            "is not a non-empty list of objects, as in flame_params.json", file=path, field="frames"
        )
    _check_frames(len(frames), path, "frames")
    shape = _list(document.get("shape_params"), path, "shape_params", None)
    width = len(_list(frames[0].get("expression"), path, "frames[0].expression", None))
    expression, pose = (
        np.array([_list(frame.get(key), path, f"frames[{t}].{key}", count) for t, frame in enumerate(frames)])
        for key, count in (("expression", width), ("pose", 15))
    )
    still = np.zeros((len(frames), 3))
    missing = _missing([frame.get("file_path") for frame in frames])
    return BodyPoses(FLAME_JOINTS, shape, expression, pose.reshape(-1, 5, 3), still, None, FLAME_FPS, missing)


def _missing(images: list[object]) -> tuple[int, int] | None:
    """The numbers of two images on end between which others seem to be missing: nearly all follow each other."""
    found = [
        re.fullmatch(r"(.*?)(\d{1,9})(\.\w+)?", image) if isinstance(image, str) else None for image in images
    ]
    named = [(match[1], int(match[2])) for match in found if match is not None]
    if len(named) < len(images):
        return None
    steps = np.array([b - a if one == other else 0 for (one, a), (other, b) in pairwise(named)])
    usual = float(np.median(steps)) if len(steps) else 0.0
    if usual <= 0 or (steps == usual).mean() < REGULAR or steps.max() < GAP * usual:
        return None
    at = int(steps.argmax())
    return named[at][1], named[at + 1][1]


def _list(value: object, path: Path, field: str, count: int | None) -> F64:
    """A JSON list of numbers [n], or a list of one such list."""
    if isinstance(value, list) and len(value) == 1 and isinstance(value[0], list):
        value = value[0]
    if not isinstance(value, list) or not (
        len(value) == count if count else 0 < len(value) <= MAX_COEFFICIENTS
    ):
        raise AvatarError(
            f"is not a list of {count or f'1 to {MAX_COEFFICIENTS}'} numbers", file=path, field=field
        )
    for number in value:
        if isinstance(number, bool) or not isinstance(number, int | float) or not abs(number) <= MAX_VALUE:
            raise AvatarError(
                "holds a value that is not a finite number, or too large", file=path, field=field
            )
    return np.array(value, np.float64)


def _check_frames(count: int, path: Path, field: str) -> None:
    if not 0 < count <= MAX_FRAMES:
        raise AvatarError(f"has {count} frames; 1 to {MAX_FRAMES} are supported", file=path, field=field)


class _Npz:
    """The arrays of an .npz by name, checked."""

    def __init__(self, path: Path):
        self.path = path
        self.names = _names(path)

    def array(self, name: str, shape: tuple[int | None, ...]) -> F64:
        """A finite array of `shape` (None: any size); leading axes of size 1 in the file are dropped."""
        if name not in self.names:
            raise AvatarError("is missing", file=self.path, field=name)
        with Archive(self.path) as archive:
            source = parse_npy(archive.read(self.names[name], MAX_FILE_BYTES), self.path, name)
        sizes = source.shape
        while len(sizes) > len(shape) and sizes[0] == 1:
            sizes = sizes[1:]
        fits = len(sizes) == len(shape) and all(w in (None, n) for w, n in zip(shape, sizes, strict=True))
        if not fits or source.dtype.kind not in "fiu":
            want = ", ".join("any" if size is None else str(size) for size in shape)
            raise AvatarError(
                f"is {source.dtype}{list(source.shape)}, expected numbers [{want}]",
                file=self.path,
                field=name,
            )
        with np.errstate(invalid="ignore"):  # a signalling NaN, refused below
            values = source.read().reshape(sizes).astype(np.float64)
        bad = ~(np.abs(values) <= MAX_VALUE)
        if bad.any():
            at = [int(i[0]) for i in np.nonzero(bad)]
            raise AvatarError(f"value at {at} is not finite, or too large", file=self.path, field=name)
        return values

    def frames(self, name: str, width: int) -> F64:
        """The array [T, width]; a single [width] is one frame."""
        values = self.array(name, (None, width))
        _check_frames(len(values), self.path, name)
        return values

    def each(self, name: str, width: int, frames: int) -> F64:
        """The array [frames, width]; zeros if the file lacks it."""
        if name not in self.names:
            return np.zeros((frames, width))
        values = self.array(name, (None, width))
        if len(values) == 1:
            values = np.repeat(values, frames, axis=0)
        if len(values) != frames:
            raise AvatarError(
                f"has {len(values)} frames, but other arrays have {frames}", file=self.path, field=name
            )
        return values

    def shape(self, name: str) -> F64:
        values = self.array(name, (None,)) if name in self.names else np.zeros(0)
        if len(values) > MAX_COEFFICIENTS:
            raise AvatarError(
                f"has {len(values)} coefficients; up to {MAX_COEFFICIENTS} are supported",
                file=self.path,
                field=name,
            )
        return values


def _names(path: Path) -> dict[str, str]:
    with Archive(path) as archive:
        return {name.removesuffix(".npy"): name for name in archive.names if name.endswith(".npy")}


def _smpl(npz: _Npz) -> BodyPoses:
    if "thetas" in npz.names:
        pose = npz.frames("thetas", 72)
    else:
        body = npz.frames("body_pose", 69)
        pose = np.concatenate([npz.each("global_orient", 3, len(body)), body], axis=1)
    t = len(pose)
    return BodyPoses(
        SMPL_JOINTS,
        npz.shape("betas"),
        np.zeros((t, 0)),
        pose.reshape(t, 24, 3),
        npz.each("transl", 3, t),
        None,
        SMPL_FPS,
    )


def _gaussian_avatars(npz: _Npz) -> BodyPoses:
    neck = npz.frames("neck_pose", 3)
    t = len(neck)
    eyes = npz.each("eyes_pose", 6, t).reshape(t, 2, 3)
    head = np.stack([npz.each("rotation", 3, t), neck, npz.each("jaw_pose", 3, t)], axis=1)
    expression = npz.array("expr", (None, None))
    if len(expression) != t or expression.shape[1] > MAX_COEFFICIENTS:
        raise AvatarError(f"has shape {list(expression.shape)} for {t} frames", file=npz.path, field="expr")
    offset = (
        npz.array("static_offset", (None, 3)).astype(np.float32) if "static_offset" in npz.names else None
    )
    return BodyPoses(
        FLAME_JOINTS,
        npz.shape("shape"),
        expression,
        np.concatenate([head, eyes], axis=1),
        npz.each("translation", 3, t),
        offset,
        FLAME_FPS,
    )


_KINDS: dict[str, Callable[[_Npz], BodyPoses]] = {
    "neck_pose": _gaussian_avatars,
    "thetas": _smpl,
    "body_pose": _smpl,
}


def _npz_kind(names: Mapping[str, str]) -> Callable[[_Npz], BodyPoses] | None:
    return next((kind for field, kind in _KINDS.items() if field in names), None)
