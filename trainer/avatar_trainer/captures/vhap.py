"""Captures as VHAP exports them, and as GaussianAvatars' data sets are: transforms*.json, images, FLAME parameters.

The head's pose is in the mesh: FLAME's root and neck turn, and a translation is added. Cameras are those of NeRF.
Images are composited over a plain background, which is divided out. Rotations are rotation vectors.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export import ReadOptions
from avatar_export.bodies import pose_files, tracked_cameras
from avatar_runtime import AvatarError, PoseArrays
from avatar_runtime.io import read_bytes
from avatar_trainer.captures import image_files
from avatar_trainer.captures.bodies import Body, body_of_model, check_flame, found_inputs
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.paths import inside
from avatar_trainer.captures.rows import MAX_FRAMES, Row, check_rows

FILE = "canonical_flame_param.npz"  # the identity; every export has it
WHOLE = "transforms.json"
DIVIDED = {"transforms_train.json": "train", "transforms_val.json": "test", "transforms_test.json": "test"}
MAX_JSON_BYTES = 512 << 20
SAME_IDENTITY = 0.01  # largest standard deviation, and the largest offset in metres
PLAIN = 0.02  # by which the background of an image may differ from white or black
ABOVE = "../"  # combined data sets name files of the folders beside them
Object = Mapping[str, Any]


@dataclass(frozen=True)
class Entry:
    """One entry of `frames` in one of the files."""

    file: Path
    field: str
    frame: Object
    whole: Object
    split: str | None

    def path(self, folder: Path, key: str) -> Path:
        """The file that the entry names under `key`, in `folder` or, after one "../", in a folder beside it."""
        text = self.frame.get(key)
        if not isinstance(text, str) or not text:
            raise AvatarError("is not a path", file=self.file, field=f"{self.field}.{key}")
        above = text.startswith(ABOVE)
        home = folder.parent if above else folder
        return inside(home, text.removeprefix(ABOVE).removeprefix("./"), self.file, f"{self.field}.{key}")

    def whole_number(self, key: str) -> int:
        """A number that is not negative, under `key`; 0 if the entry lacks it."""
        value = self.frame.get(key, 0)
        if type(value) is not int or value < 0:
            raise AvatarError("is not a whole number", file=self.file, field=f"{self.field}.{key}")
        return value


def read(folder: Path, given: ReadOptions) -> Capture:
    """The capture in `folder`. Raises AvatarError naming file and frame for everything that CAPTURE.md lists."""
    given.refuse_others(("body_model", "anchor_faces"), "capture", "VHAP tracks no eyelids")
    folder = folder.resolve()
    entries = _entries(folder)
    identity = pose_files.read_poses(folder / FILE)
    body = body_of_model(replace(found_inputs(folder, given, shape=folder / FILE), eyelids=None))
    check_flame(body)
    poses: dict[Path, PoseArrays] = {}
    over = _background(entries[0], folder)
    rows = []
    for entry in entries:
        file = entry.path(folder, "flame_param_path")
        if file not in poses:
            poses[file] = _pose(file, body, identity)
        rows.append(_row(entry, folder, poses[file], over))
    frames = check_rows(rows, body.expression_names, _size(entries))
    ground = (
        "straight colour" if over is None else f"over {'white' if over else 'black'}, which is divided out"
    )
    fps = identity.fps
    return Capture(
        name=folder.name,
        folder=folder,
        width=frames[0].camera.width,
        height=frames[0].camera.height,
        fps=fps,
        rig=body.rig,
        expression_names=body.expression_names,
        eyelids=body.eyelids,
        head_pose_in="mesh",
        frames=frames,
        export_inputs=body.export_inputs,
        layout=f"VHAP, {', '.join(sorted({entry.file.name for entry in entries}))}; images {ground}",
        notes=(
            f"{fps:g} frames a second are taken; VHAP's files do not say",
            *_offset_notes(identity, poses),
        ),
    )


def _entries(folder: Path) -> list[Entry]:
    """The frames of the divided files, else of the whole one, in the order of time and camera."""
    divided = {name: split for name, split in DIVIDED.items() if (folder / name).is_file()}
    named: Mapping[str, str | None] = divided if "transforms_train.json" in divided else {WHOLE: None}
    entries = [entry for name, split in named.items() for entry in _of_file(folder / name, split)]
    if not 0 < len(entries) <= MAX_FRAMES:
        raise AvatarError(f"holds {len(entries)} frames; 1 to {MAX_FRAMES} are read", file=folder)
    return sorted(entries, key=lambda e: (e.whole_number("timestep_index"), e.whole_number("camera_index")))


def _of_file(file: Path, split: str | None) -> list[Entry]:
    try:
        document = json.loads(read_bytes(file, MAX_JSON_BYTES))
    except (ValueError, RecursionError) as error:
        raise AvatarError(f"is not JSON ({type(error).__name__})", file=file) from None
    frames = document.get("frames") if isinstance(document, dict) else None
    if not isinstance(frames, list) or not all(isinstance(frame, dict) for frame in frames):
        raise AvatarError("is not a list of objects", file=file, field="frames")
    return [Entry(file, f"frames[{t}]", frame, document, split) for t, frame in enumerate(frames)]


def _row(entry: Entry, folder: Path, pose: PoseArrays, over: float | None) -> Row:
    camera = tracked_cameras.transform_camera(entry.frame, entry.whole, entry.file, entry.field)
    image = entry.path(folder, "file_path")
    view = camera.camera_from_world
    take = "" if image.is_relative_to(folder) else f"{image.relative_to(folder.parent).parts[0]}_"
    return Row(
        entry.file,
        entry.field,
        image,
        _mask(entry, folder, image),
        camera.intrinsics,
        view[:3, :3],
        view[:3, 3],
        pose,
        entry.split,
        take,
        over,
    )


def _size(entries: list[Entry]) -> tuple[int, int] | None:
    """Width and height that all entries state. Raises AvatarError for two sizes."""
    sizes = [tracked_cameras.transform_camera(e.frame, e.whole, e.file, e.field).size for e in entries]
    for entry, size in zip(entries, sizes, strict=True):
        if size != sizes[0]:
            raise AvatarError(
                f"are {size}, those of the first are {sizes[0]}; all images are of one size",
                file=entry.file,
                field=f"{entry.field}.w, h",
            )
    return sizes[0]


def _mask(entry: Entry, folder: Path, image: Path) -> Path:
    if "fg_mask_path" in entry.frame:
        return entry.path(folder, "fg_mask_path")
    if image_files.header(image).mode != "RGBA":
        raise AvatarError("has no alpha, and its frame names no fg_mask_path", file=image)
    return image


def _pose(file: Path, body: Body, identity: pose_files.BodyPoses) -> PoseArrays:
    """The pose of one time. Raises AvatarError for a file of another subject, and for one with several poses."""
    poses = pose_files.read_poses(file)
    if poses.frames != 1:
        raise AvatarError(f"has {poses.frames} poses; one is expected", file=file, field="neck_pose")
    if _differ(poses.shape, identity.shape):
        raise AvatarError(
            f"has another identity than {FILE}: frames of two people in one folder", file=file, field="shape"
        )
    if _differ(poses.static_offset, identity.static_offset):
        raise AvatarError(f"differs from that of {FILE}", file=file, field="static_offset")
    clip = pose_files.body_clip(body.rig, poses, str(file))
    return PoseArrays(
        clip.expression_weights[0],
        clip.late_weights[0],
        clip.joint_delta[0].astype(np.float64),
        clip.world_from_avatar[0].astype(np.float64),
    )


def _differ(a: Any, b: Any) -> bool:
    if a is None or b is None:
        return (a is None) != (b is None)
    return bool(a.shape != b.shape or np.abs(a - b).max(initial=0) > SAME_IDENTITY)


def _background(entry: Entry, folder: Path) -> float | None:
    """1 or 0 if the first image is over white or black, found where its mask is empty; None if over neither."""
    image = entry.path(folder, "file_path")
    mask = image_files.matte(_mask(entry, folder, image), image)
    colour = image_files.colour(image)
    if colour.shape[:2] != mask.shape or not (mask == 0).any():
        return None
    outside = np.median(colour[mask == 0], axis=0)
    return next((ground for ground in (1.0, 0.0) if np.abs(outside - ground).max() <= PLAIN), None)


def _offset_notes(identity: pose_files.BodyPoses, poses: Mapping[Path, PoseArrays]) -> list[str]:
    if identity.static_offset is None or not identity.static_offset.any():
        return []
    most = float(np.linalg.norm(identity.static_offset, axis=1).max())
    return [
        f"the mesh has the static offset of {FILE}, up to {most * 1000:.1f} mm; dynamic offsets are not read"
    ]
