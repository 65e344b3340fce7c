"""From what a user asks to pictures on disk: poses from flags, a recording or a clip, then frames."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from avatar_export.clips.sources import clips_from, unmatched
from avatar_export.commands.mesh_sequence import read_meshes
from avatar_export.driving import drive, takes
from avatar_export.driving.arkit import ARKIT_NAMES, canonical
from avatar_export.images import Box, animated_webp, arkit_pose, frame_camera, png, robust_box
from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.io.errors import AvatarError, no_such
from avatar_runtime.player import Frame, Player
from avatar_runtime.pose import Pose, clip_pose, joint_rotation

Pixels = npt.NDArray[np.uint8]
TURNTABLE_SECONDS = 2.0
FRAMED = 12  # frames of a sequence that the camera is set by
SUFFIXES = ("", ".png", ".webp")


@dataclass(frozen=True)
class View:
    """Where the camera stands (degrees), and what is drawn."""

    width: int = 512
    height: int = 512
    yaw: float = 0.0
    pitch: float = 0.0
    zoom: float = 1.0
    orbit: float = 0.0  # degrees that the yaw moves over a sequence
    background: tuple[float, float, float] | None = None  # None: the trainer's
    transparent: bool = False
    profile: str | None = None  # None: the first that the backend draws
    backend: str | None = None  # None: the runtime's default
    enhance: bool = False  # put through the avatar's enhancer


@dataclass(frozen=True)
class PoseSequence:
    """Poses in time."""

    poses: Sequence[Pose]
    fps: float
    notes: tuple[str, ...] = ()
    posed_vertices: Sequence[F32] | None = None  # one mesh a pose, in place of what a rig makes of it

    def part(self, rows: slice) -> PoseSequence:
        """Some of its frames."""
        meshes = None if self.posed_vertices is None else self.posed_vertices[rows]
        return replace(self, poses=self.poses[rows], posed_vertices=meshes)


def pose_from_flags(
    avatar: Avatar,
    expressions: dict[str, float],
    arkit: dict[str, float],
    joints: Mapping[str, Sequence[float]],  # rotation vectors, degrees
    eyelids: dict[str, float],
) -> Pose:
    """One pose; ARKit names go through the avatar's driving, the rest is the avatar's own."""
    pose = Pose()
    if arkit:
        weights = {}
        for name, weight in arkit.items():
            known = canonical(name)
            if known is None:
                raise no_such("ARKit name", name, ARKIT_NAMES)
            weights[known] = weight
        pose = arkit_pose(avatar, weights)
    turned = {name: joint_rotation(np.radians(vector)) for name, vector in joints.items()}
    return replace(
        pose,
        expressions={**pose.expressions, **expressions},
        joints={**pose.joints, **turned},
        eyelids={**pose.eyelids, **eyelids},
    )


def recorded(avatar: Avatar, path: Path, every: int) -> PoseSequence:
    """The poses of a Live Link Face recording (CSV or packets), each `every`-th frame."""
    take = takes.read_take(path)
    notes = []
    missing = drive.unreached(avatar)
    if missing:
        notes.append(
            f"{len(missing)} of the {len(ARKIT_NAMES)} ARKit names move nothing here: {', '.join(missing)}"
        )
    return PoseSequence(drive.poses(avatar, take)[::every], take.fps / every, tuple(notes))


def own_clip(avatar: Avatar, name: str, every: int) -> PoseSequence:
    """A clip of the avatar by its name, each `every`-th frame. Raises AvatarError for a name it lacks."""
    found = {clip.name: clip for clip in avatar.clips}
    if name not in found:
        raise no_such("clip of this avatar", name, tuple(found))
    poses = [clip_pose(avatar, found[name], frame) for frame in range(0, found[name].frames, every)]
    return PoseSequence(poses, found[name].fps / every)


def clip(avatar: Avatar, named: str, name: str | None, every: int) -> PoseSequence:
    """A clip of the avatar by its name; else `named` is a file, of which the clip `name` or the first is played."""
    if any(clip.name == named for clip in avatar.clips) or not Path(named).exists():
        return own_clip(avatar, named, every)
    return _clip_of_file(avatar, Path(named), name, every)


def _clip_of_file(avatar: Avatar, path: Path, name: str | None, every: int) -> PoseSequence:
    bare = replace(avatar, clips=())  # else clips of the same name would be renamed
    found = {clip.name: clip for clip in clips_from(bare, path)}
    if name is not None and name not in found:
        raise no_such("clip of this file", name, tuple(found), file=path.name)
    chosen = found[name] if name is not None else next(iter(found.values()))
    poses = [clip_pose(avatar, chosen, frame) for frame in range(0, chosen.frames, every)]
    notes = [f"clip {chosen.name!r} of {', '.join(found)}"]
    strangers = unmatched(avatar, path, chosen.name)
    if strangers:
        notes.append(f"{len(strangers)} nodes of the clip have no joint here: {', '.join(strangers[:5])}")
    return PoseSequence(poses, chosen.fps / every, tuple(notes))


def meshes(
    avatar: Avatar, paths: Sequence[Path], units: float | None, fps: float, every: int
) -> PoseSequence:
    """Posed meshes from files, each `every`-th."""
    vertices = read_meshes(avatar, paths, units)[::every]
    return PoseSequence([Pose()] * len(vertices), fps / every, posed_vertices=vertices)


def turntable(pose: Pose, fps: float) -> PoseSequence:
    """One pose for as long as the camera takes to travel."""
    return PoseSequence([pose] * max(2, round(fps * TURNTABLE_SECONDS)), fps)


def frames(avatar: Avatar, sequence: PoseSequence, view: View) -> Iterator[Pixels]:
    """Pictures, one a pose; the camera stands where it sees all of them.

    Raises AvatarError for a profile that the backend does not draw, where what the backend or the enhancer needs is
    missing, and for an enhancer that is asked for and is not there or not sound.
    """
    player, count = Player(avatar, view.backend, enhance=view.enhance), len(sequence.poses)
    drawn = player.backend.profiles
    if view.profile is not None and view.profile not in drawn:
        raise AvatarError(
            f"is not drawn by backend {view.backend}: take {' or '.join(drawn)}",
            field=f"profile {view.profile}",
        )
    box = framed(player, sequence)
    for index, pose in enumerate(sequence.poses):
        turn = view.orbit * index / max(count, 1)
        camera = frame_camera(
            box, view.width, view.height, np.radians(view.yaw + turn), np.radians(view.pitch), view.zoom
        )
        background = (0.0, 0.0, 0.0) if view.transparent else view.background
        mesh = None if sequence.posed_vertices is None else sequence.posed_vertices[index]
        frame: Frame = player.frame(pose, camera, background, view.profile, posed_vertices=mesh)
        yield frame.rgba8() if view.transparent else frame.rgb8()


def framed(player: Player, sequence: PoseSequence) -> Box:
    """What the camera must see: the binding pose, or for Gaussians on a mesh some frames of the sequence."""
    if player.avatar.embedding is None:
        return robust_box(player.avatar.gaussians.mean)
    count = len(sequence.poses)
    means = []
    for index in np.unique(np.linspace(0, count - 1, min(count, FRAMED)).astype(int)):
        mesh = None if sequence.posed_vertices is None else sequence.posed_vertices[int(index)]
        means.append(player.animate(sequence.poses[index], posed_vertices=mesh).mean)
    return robust_box(np.concatenate(means))


def save(
    out: Path,
    pictures: Iterator[Pixels],
    count: int,
    fps: float,
    force: bool,
    progress: Callable[[int], None],
) -> None:
    """Write one .png, an animated .webp, or a folder of frame_00000.png; all or nothing.

    Raises AvatarError for another kind of file, if `out` exists (without `force`), or if one .png is asked for
    several pictures.
    """
    if out.suffix.lower() not in SUFFIXES:
        raise AvatarError(f"{out.suffix} cannot be written; name a .png, a .webp or a folder", file=out)
    if out.suffix.lower() == ".png" and count != 1:
        raise AvatarError(f"{count} pictures do not fit one .png; name a folder or a .webp", file=out)
    if out.exists() and (not force or out.is_dir()):
        raise AvatarError("exists; name another or pass --force (a folder is never replaced)", file=out)
    partial = out.with_name(f".{out.name}.{os.getpid()}.partial")

    def counted() -> Iterator[Pixels]:
        for index, picture in enumerate(pictures):
            progress(index + 1)
            yield picture

    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        if out.suffix.lower() == ".webp":
            partial.write_bytes(animated_webp(counted(), fps))
        elif out.suffix.lower() == ".png":
            partial.write_bytes(png(next(counted())))
        else:
            partial.mkdir()
            for index, picture in enumerate(counted()):
                (partial / f"frame_{index:05d}.png").write_bytes(png(picture))
        partial.replace(out)
    except OSError as error:
        raise AvatarError(f"cannot be written ({error.strerror or error})", file=out) from None
    finally:
        if partial.is_dir():
            shutil.rmtree(partial)
        else:
            partial.unlink(missing_ok=True)
