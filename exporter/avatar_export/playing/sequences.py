"""Poses in time: from weights, from a recording, from a clip, from posed meshes, or one pose for a turntable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from avatar_export.clips import gltf_files
from avatar_export.clips.doubts import take_notes
from avatar_export.clips.other_avatar import parts_of
from avatar_export.clips.poses import clip_poses
from avatar_export.clips.sources import read_clips
from avatar_export.driving import drive, takes
from avatar_export.images import arkit_pose
from avatar_export.notes.note import Note, fact
from avatar_export.playing.meshes import read_meshes
from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.driving.arkit import ARKIT_NAMES, canonical
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.idle import idle as idle_frame
from avatar_runtime.io.errors import AvatarError, no_such
from avatar_runtime.pose import Pose, joint_rotation

TURNTABLE_SECONDS = 2.0


@dataclass(frozen=True)
class PoseSequence:
    """Poses at `fps` frames per second."""

    poses: Sequence[Pose]
    fps: float
    notes: tuple[Note, ...] = ()
    posed_vertices: Sequence[F32] | None = None  # [V, 3] metres, a mesh for each pose; replaces the rig's

    def part(self, rows: slice) -> PoseSequence:
        """The frames `rows` of the sequence; a step of n divides its rate by n."""
        meshes = None if self.posed_vertices is None else self.posed_vertices[rows]
        return replace(self, poses=self.poses[rows], fps=self.fps / (rows.step or 1), posed_vertices=meshes)


def pose_of(
    avatar: Avatar,
    expressions: Mapping[str, float],
    arkit: Mapping[str, float],
    joints_degrees: Mapping[str, Sequence[float]],
    eyelids: Mapping[str, float],
) -> Pose:
    """One pose of `avatar` from weights by name, and from rotation vectors [3] of joints in degrees.

    ARKit weights go through the avatar's driving; all other names are the avatar's own and replace what ARKit gave.
    Raises AvatarError for an unknown ARKit name, and for an avatar that ARKit cannot drive.
    """
    pose = Pose()
    if arkit:
        weights = {}
        for name, weight in arkit.items():
            known = canonical(name)
            if known is None:
                raise no_such("ARKit name", name, ARKIT_NAMES)
            weights[known] = weight
        pose = arkit_pose(avatar, weights)
    turned = {name: joint_rotation(np.radians(vector)) for name, vector in joints_degrees.items()}
    return replace(
        pose,
        expressions={**pose.expressions, **expressions},
        joints={**pose.joints, **turned},
        eyelids={**pose.eyelids, **eyelids},
    )


def recorded(avatar: Avatar, path: Path) -> PoseSequence:
    """The poses of a recording of ARKit channels (see `takes`).

    Raises AvatarError for a damaged recording, and for an avatar that ARKit cannot drive.
    """
    if gltf_files.holds_gltf(path) and gltf_files.expressions_of(path) is None:
        raise AvatarError(
            f"holds no {gltf_files.EXPRESSIONS}, so no recording; --clip plays its animation", file=path
        )
    take = takes.read_take(path)
    return PoseSequence(drive.poses(avatar, take), take.fps, tuple(take_notes(avatar, take)))


def idle(avatar: Avatar, seconds: float, seed: int, fps: float) -> PoseSequence:
    """Idle life of some seconds. Raises AvatarError for an avatar that ARKit cannot drive."""
    driver = Driver(avatar)
    count = max(1, round(seconds * fps))
    return PoseSequence([driver.pose(idle_frame(i / fps, seed)) for i in range(count)], fps)


def own_clip(avatar: Avatar, name: str) -> PoseSequence:
    """A clip of the avatar by its name. Raises AvatarError for a name it lacks."""
    found = {clip.name: clip for clip in avatar.clips}
    if name not in found:
        raise no_such("clip of this avatar", name, tuple(found))
    return PoseSequence(clip_poses(avatar, found[name]), found[name].fps)


def clip(avatar: Avatar, named: str, name: str | None) -> PoseSequence:
    """The avatar's clip `named`; else OTHER_BUNDLE:NAME; else of the clip `name` in the file `named`, or its first.

    Raises AvatarError if there is no such clip.
    """
    file = Path(named)
    if any(clip.name == named for clip in avatar.clips) or not (file.exists() or parts_of(file)):
        return own_clip(avatar, named)
    return _clip_of_file(avatar, Path(named), name)


def _clip_of_file(avatar: Avatar, path: Path, name: str | None) -> PoseSequence:
    bare = replace(avatar, clips=())  # so that clips of the same name are not renamed
    read = read_clips(bare, path)
    found = {clip.name: clip for clip in read.clips}
    if name is not None and name not in found:
        raise no_such("clip of this file", name, tuple(found), file=path.name)
    chosen = found[name] if name is not None else next(iter(found.values()))
    notes = [fact("clip_chosen", name=chosen.name, clips=list(found)), *read.notes]
    if strangers := gltf_files.unmatched(avatar, path, chosen.name):
        notes.append(fact("no_counterpart", part="nodes", names=strangers))
    return PoseSequence(clip_poses(avatar, chosen), chosen.fps, tuple(notes))


def meshes(avatar: Avatar, paths: Sequence[Path], units: float | None, fps: float) -> PoseSequence:
    """Posed meshes from files (see `read_meshes`); `fps` is that of the files."""
    vertices = read_meshes(avatar, paths, units)
    return PoseSequence([Pose()] * len(vertices), fps, posed_vertices=vertices)


def turntable(pose: Pose, fps: float) -> PoseSequence:
    """One pose for TURNTABLE_SECONDS, while the camera orbits."""
    return PoseSequence([pose] * max(2, round(fps * TURNTABLE_SECONDS)), fps)
