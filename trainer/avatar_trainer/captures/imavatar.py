"""Captures in IMavatar's layout, from which SplattingAvatar's heads are trained: flame_params.json and images.

The head's pose is in the mesh (FLAME's root and neck turn). `world_mat` is camera from world with y up and z backwards:
rows 1 and 2 are negated for OpenCV (SplattingAvatar, dataset/imavatar_data.py:15-21). Lengths are FLAME's times 4
(flame.py:75), so translations are divided by 4. Intrinsics are fractions of the image; their signs are ignored.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export import ReadOptions
from avatar_export.bodies import pose_files, tracked_cameras
from avatar_runtime import F64, AvatarError, Clip, PoseArrays
from avatar_runtime.io import read_bytes
from avatar_trainer.captures import image_files
from avatar_trainer.captures.bodies import body_of_model, check_flame, found_inputs
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.paths import inside
from avatar_trainer.captures.rows import Row, check_rows

FILE = "flame_params.json"
MAX_JSON_BYTES = 512 << 20
IMAGES, MASKS = ("image", "images"), ("mask", "masks")
ENDINGS = (".png", ".jpg", ".jpeg")


def read(folder: Path, given: ReadOptions) -> Capture:
    """The capture in `folder`. Raises AvatarError naming the frame for everything that CAPTURE.md lists."""
    file = folder / FILE
    given.refuse_others(("body_model", "anchor_faces"), "capture", f"{FILE} has no eyelids")
    poses = pose_files.read_poses(file)
    document = json.loads(read_bytes(file, MAX_JSON_BYTES))  # read_poses has shown that it can be read
    inputs = replace(found_inputs(folder, given, shape=file), eyelids=None)
    body = body_of_model(inputs)
    check_flame(body)
    clip = pose_files.body_clip(body.rig, poses, str(file))
    fractions = tracked_cameras.numbers(document.get("intrinsics"), (4,), file, "intrinsics")
    images = [_image(folder, frame, t) for t, frame in enumerate(document["frames"])]
    first = image_files.header(images[0])
    matte, how = _mattes(images[0], first)
    k = _intrinsics(fractions, first)
    rows = [_row(file, frame, t, images[t], matte, k, clip) for t, frame in enumerate(document["frames"])]
    return Capture(
        name=folder.resolve().name,
        folder=folder,
        width=first.width,
        height=first.height,
        fps=poses.fps,
        rig=body.rig,
        expression_names=body.expression_names,
        eyelids=body.eyelids,
        head_pose_in="mesh",
        frames=check_rows(rows, body.expression_names, (first.width, first.height)),
        export_inputs={**body.export_inputs, "poses": file},
        layout=f"IMavatar {FILE}, {how}",
        notes=(f"{poses.fps:g} frames a second are taken; {FILE} does not say",),
    )


def _row(
    file: Path, frame: Mapping[str, Any], t: int, image: Path, matte: str | None, k: F64, clip: Clip
) -> Row:
    view = tracked_cameras.from_world_mat(
        tracked_cameras.numbers(frame.get("world_mat"), (3, 4), file, f"frames[{t}].world_mat")
    )
    mask = image if matte is None else image.parent.with_name(matte) / f"{image.stem}.png"
    pose = PoseArrays(
        clip.expression_weights[t],
        clip.late_weights[t],
        clip.joint_delta[t].astype(np.float64),
        clip.world_from_avatar[t].astype(np.float64),
    )
    return Row(file, f"frames[{t}]", image, mask, k, view[:3, :3], view[:3, 3], pose, None)


def _intrinsics(fractions: F64, first: image_files.Header) -> F64:
    return tracked_cameras.pinhole(
        *np.abs(fractions) * (first.width, first.height, first.width, first.height)
    )


def _image(folder: Path, frame: Mapping[str, Any], t: int) -> Path:
    """The image of a frame: file_path with or without its ending, in image/ or images/."""
    field = f"frames[{t}].file_path"
    text = frame.get("file_path")
    if not isinstance(text, str) or not text:
        raise AvatarError("is not a path", file=folder / FILE, field=field)
    named = inside(folder, text.removeprefix("./"), folder / FILE, field)
    named = named if named.suffix.lower() in ENDINGS else named.with_name(f"{named.name}.png")
    homes = [named.parent, *(named.parent.with_name(name) for name in IMAGES if named.parent.name in IMAGES)]
    found = next((home / named.name for home in homes if (home / named.name).is_file()), None)
    if found is None:
        raise AvatarError("no such image", file=named, field=field)
    return found


def _mattes(image: Path, header: image_files.Header) -> tuple[str | None, str]:
    """(folder of the mattes beside that of the images, None: they are the images' alpha; in words)."""
    home = image.parent
    for name in MASKS:
        if home.with_name(name).is_dir():
            return name, f"images in {home.name}/, mattes in {name}/"
    if header.mode == "RGBA":
        return None, f"images in {home.name}/, their alpha is the matte"
    raise AvatarError(
        f"has no alpha, and there is no folder {' or '.join(MASKS)} beside {home.name}/", file=image
    )
