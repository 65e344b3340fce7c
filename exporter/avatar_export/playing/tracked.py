"""Tracked cameras for a sequence of poses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from avatar_export.bodies.tracked_cameras import common_size, read_cameras
from avatar_export.playing.sequences import PoseSequence
from avatar_runtime.camera import Camera
from avatar_runtime.io.errors import AvatarError

UNSTATED = (512, 512)  # of a file that does not say how large its images are
ROUNDING = 1.0  # pixels by which another size may differ from the images' shape


def tracked(path: Path, size: tuple[int, int] | None, frames: slice) -> list[Camera]:
    """The cameras `frames` of a capture, a folder or one of its files, for images of `size`; None: as tracked.

    A single number as `size`, given twice, is the longer side. Raises AvatarError for a file without cameras, for no
    camera in `frames`, and for a size of another shape.
    """
    found = read_cameras(path)
    chosen = found[frames]
    if not chosen:
        raise AvatarError(
            f"holds no camera; the capture has {len(found)}", file=path, field="--camera-frames"
        )
    own = common_size(chosen, path)
    width, height = _size(own, size, path)
    return [camera.of_size(width, height) for camera in chosen]


def seen_by(sequence: PoseSequence, cameras: list[Camera], path: Path) -> PoseSequence:
    """`sequence`, a single pose repeated for each camera. Raises AvatarError unless there is one camera, or one for
    each pose."""
    poses = len(sequence.poses)
    if poses == 1 and sequence.posed_vertices is None:
        return replace(sequence, poses=list(sequence.poses) * len(cameras))
    if len(cameras) not in (1, poses):
        raise AvatarError(
            f"{len(cameras)} cameras for {poses} poses; choose as many with --camera-frames and --frames, or one",
            file=path,
            field="--camera",
        )
    return sequence


def _size(own: tuple[int, int] | None, asked: tuple[int, int] | None, path: Path) -> tuple[int, int]:
    if own is None or asked is None:
        return asked or own or UNSTATED
    if asked[0] == asked[1]:
        longer = max(own)
        return max(1, round(own[0] * asked[0] / longer)), max(1, round(own[1] * asked[0] / longer))
    if abs(asked[0] * own[1] / own[0] - asked[1]) > ROUNDING:
        raise AvatarError(
            f"{asked[0]}x{asked[1]} has another shape than the images, {own[0]}x{own[1]}",
            file=path,
            field="--size",
        )
    return asked
