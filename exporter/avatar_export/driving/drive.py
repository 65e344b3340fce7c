"""Recorded takes through an avatar's driving, and what a user should know about it."""

from __future__ import annotations

from avatar_export.driving.frames import DrivingTake
from avatar_export.notes.note import Note, fact
from avatar_runtime.avatar import Avatar
from avatar_runtime.driving.arkit import ARKIT_NAMES
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.linear_map import linear_map
from avatar_runtime.pose import Pose


def poses(avatar: Avatar, take: DrivingTake) -> list[Pose]:
    """The pose of every frame. Raises AvatarError if ARKit cannot drive this avatar."""
    driver = Driver(avatar)
    return [driver.pose(take.frame(row)) for row in range(len(take))]


def driving_notes(avatar: Avatar) -> list[Note]:
    """What a user should know about ARKit driving of an avatar; [] if there is nothing to say."""
    if not avatar.expressions and not avatar.eyelids:
        return []
    if avatar.driving.mode == "none":
        return [fact("not_driven")]
    joints = {name.lower(): name for name in (avatar.rig.joint_names if avatar.rig else ())}
    outputs = {output.split("/")[1] for output in linear_map(avatar).outputs if output.startswith("joint/")}
    if "jaw" in joints and joints["jaw"] not in outputs:
        return [fact("jaw_not_driven", joint=joints["jaw"])]
    return []


def unreached(avatar: Avatar) -> list[str]:
    """The ARKit names that move nothing of this avatar, except its head and eye joints."""
    linear = linear_map(avatar)
    used = {name for name, column in zip(linear.inputs, linear.matrix.T, strict=True) if column.any()}
    return [name for name in ARKIT_NAMES if name not in used]
