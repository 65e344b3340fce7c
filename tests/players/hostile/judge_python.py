"""What Python makes of packs, for `python -m tools.fuzz.readers`, which compares all readers.

Reads packs from stdin, each behind its length (32 bits, little-endian); writes a line of JSON a pack.
"""

from __future__ import annotations

import base64
import contextlib
import json
import sys
import traceback
import warnings
import zlib
from dataclasses import replace
from typing import Any

import numpy as np

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.clips import clip_pose
from avatar_runtime.codec.clips import ARRAYS
from avatar_runtime.driving.arkit import ARKIT_NAMES
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import DrivingFrame
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.packs import Pack, decode_pack, spelled_driving
from avatar_runtime.pose import Pose, joint_rotation, resolve
from avatar_runtime.stages.joints import joints

AXIS = np.array([1.0, 2.0, 3.0]) / np.sqrt(14)
OF_RIG = (
    ("parents", "<i4"), ("rest_local", "<f4"), ("inverse_bind_matrix", "<f4"), ("joint_basis", "<f4"),
    ("corrective_joints", "<i4"), ("anchor_vertices", "<u4"), ("triangles", "<u4"),
)  # fmt: skip


def judged(data: bytes) -> dict[str, Any]:
    """The verdict on a pack, and of one that is taken what a player makes of it."""
    try:
        pack = decode_pack(data, "a.avatar")
    except AvatarError as error:
        return {"ok": False, "why": str(error)}
    avatar = pack.avatar
    assert avatar.packed is not None
    buffers = 0
    for buffer in avatar.packed.program.buffers.values():
        if buffer.sections:
            buffers = zlib.crc32(buffer.content(), zlib.crc32(buffer.name.encode(), buffers))
    arrays = 0
    for name, kind in OF_RIG if avatar.rig else ():
        arrays = zlib.crc32(np.ascontiguousarray(getattr(avatar.rig, name), kind), arrays)
    arrays = zlib.crc32(pack.preview or b"", arrays)
    clips = 0
    for clip in avatar.clips:
        head = clip.name.encode() + np.float64(clip.fps).tobytes() + np.uint32(clip.frames).tobytes()
        clips = zlib.crc32(head, clips)
        for name in ARRAYS:
            clips = zlib.crc32(np.ascontiguousarray(getattr(clip, name), "<f4"), clips)
    sums = {"buffers": f"{buffers:08x}", "arrays": f"{arrays:08x}", "clips": f"{clips:08x}"}
    set_ = {name: floats(pack, pose) for name, pose in poses(pack).items()}
    return {"ok": True, **sums, "poses": set_, "largest": largest(pack)}


def largest(pack: Pack) -> float:
    """Of the numbers in the matrix that drives the pack, or 1: angles have the rounding of their size."""
    driving = spelled_driving(pack.document)
    return (
        1.0 if driving is None or driving.matrix is None else float(np.abs(driving.matrix).max(initial=1.0))
    )


def poses(pack: Pack) -> dict[str, Pose]:
    """The poses that all judges set."""
    avatar, said = pack.avatar, pack.document["avatar"]
    left = said["frame"]["handedness"] == "left"
    names = avatar.rig.joint_names if avatar.rig else ()
    person = np.array([1.0, -1.0, -1.0]) if left else np.ones(3)
    named = Pose(
        {name: 0.1 * (k % 7) for k, name in enumerate(avatar.expression_names)},
        {name: joint_rotation(0.05 * (j % 5) * AXIS * person) for j, name in enumerate(names)},
        {name: 0.1 * (k % 7) for k, name in enumerate(avatar.eyelids)},
    )
    driven, clip = Pose(), Pose()
    driving = spelled_driving(pack.document)
    if driving is not None:
        weights = {n: 0.1 * (i % 9 + 1) for i, n in enumerate(driving.inputs) if n in ARKIT_NAMES}
        with contextlib.suppress(AvatarError):  # a joint that cannot turn: then nothing drives
            driver = Driver(replace(avatar, driving=driving), handedness="left" if left else "right")
            driven = driver.pose(DrivingFrame(0.0, weights))
    if avatar.clips:
        first = avatar.clips[0]
        clip = clip_pose(avatar, first, 0.37 * first.seconds)
    return {"rest": Pose(), "named": named, "driven": driven, "clip": clip}


def floats(pack: Pack, pose: Pose) -> str:
    """The floats of buffer Pose in base64."""
    avatar: Avatar = pack.avatar
    assert avatar.packed is not None
    program, posed = avatar.packed.program, resolve(pose, avatar)
    values: F32 = np.zeros(program.pose_floats, np.float32)
    given = {"weights": posed.expression_weights, "late": posed.late_weights}
    if avatar.rig is not None:
        made = joints(avatar.rig, posed)
        given |= {"features": made.pose_feature, "joints": made.skin_matrix[:, :3].reshape(-1)}
    for name, part in given.items():
        values[program.pose[name] : program.pose[name] + len(part)] = part
    return base64.b64encode(values.tobytes()).decode()


def main() -> None:
    warnings.simplefilter("ignore")
    read, write = sys.stdin.buffer.read, sys.stdout.write
    while head := read(4):
        data = read(int.from_bytes(head, "little"))
        try:
            said = judged(data)
        except Exception as error:  # only an AvatarError is a verdict
            at = traceback.extract_tb(error.__traceback__)[-1]
            said = {"ok": "crash", "why": f"crash: {error!r:.200} at {at.filename}:{at.lineno}"}
        write(json.dumps(said) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
