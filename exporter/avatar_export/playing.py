"""From what a user asks to pictures on disk: poses from flags, a recording or a clip, then frames."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from avatar_export.driving import drive, gltf_clip, takes
from avatar_export.driving.arkit import ARKIT_NAMES, canonical
from avatar_export.pictures import animated_webp, arkit_pose, frame_camera, png
from avatar_export.readers import lam
from avatar_runtime.avatar import Avatar
from avatar_runtime.codec import glb
from avatar_runtime.errors import AvatarError, no_such
from avatar_runtime.player import Frame, Player
from avatar_runtime.pose import Pose, joint_rotation

Pixels = npt.NDArray[np.uint8]
TURNTABLE_SECONDS = 2.0
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
    profile: str = "trainer"


@dataclass(frozen=True)
class PoseSequence:
    """Poses in time."""

    poses: Sequence[Pose]
    fps: float
    notes: tuple[str, ...] = field(default=())


def pose_from_flags(
    avatar: Avatar,
    expressions: dict[str, float],
    arkit: dict[str, float],
    joints: dict[str, tuple[float, float, float]],  # rotation vectors, degrees
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


def clip(avatar: Avatar, path: Path, name: str | None, fps: float) -> PoseSequence:
    """The poses of a clip of a .glb, or of the one in a LAM zip; the first clip without a name."""
    data = lam.clip_source(path) if lam.detect(path) else None
    source = path if data is None else glb.decode(data, lam.CLIPS)
    known = gltf_clip.clips(source)
    if not known:
        raise AvatarError("holds no animation", file=path)
    chosen = name or known[0]
    strangers = gltf_clip.unmatched(avatar, source, chosen) if chosen in known else []
    notes = [f"clip {chosen!r} of {', '.join(known)}"]
    if strangers:
        notes.append(f"{len(strangers)} nodes of the clip have no joint here: {', '.join(strangers[:5])}")
    return PoseSequence(gltf_clip.clip_poses(avatar, source, chosen, fps), fps, tuple(notes))


def turntable(pose: Pose, fps: float) -> PoseSequence:
    """One pose for as long as the camera takes to travel."""
    return PoseSequence([pose] * max(2, round(fps * TURNTABLE_SECONDS)), fps)


def frames(avatar: Avatar, poses: Sequence[Pose], view: View) -> Iterator[Pixels]:
    """Pictures, one a pose."""
    player = Player(avatar)
    for index, pose in enumerate(poses):
        turn = view.orbit * index / max(len(poses), 1)
        camera = frame_camera(
            avatar, view.width, view.height, np.radians(view.yaw + turn), np.radians(view.pitch), view.zoom
        )
        background = (0.0, 0.0, 0.0) if view.transparent else view.background
        frame: Frame = player.frame(pose, camera, background, view.profile)
        yield frame.rgba8() if view.transparent else frame.rgb8()


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
