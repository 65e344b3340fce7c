"""From a sequence of poses to images on disk: the camera, the frames, and the file or folder that holds them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from avatar_export.images import Box, animated_webp, frame_camera, png, robust_box
from avatar_export.playing.sequences import PoseSequence
from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.staging import followed, staged
from avatar_runtime.light import Light
from avatar_runtime.player import Frame, Player

Pixels = npt.NDArray[np.uint8]
FRAMED = 12  # frames of a sequence that the camera must show
SUFFIXES = ("", ".png", ".webp")


@dataclass(frozen=True)
class View:
    """The camera position (angles in degrees), and how images are drawn."""

    width: int = 512
    height: int = 512
    yaw: float = 0.0
    pitch: float = 0.0
    zoom: float = 1.0
    orbit: float = 0.0  # degrees by which the yaw changes over a sequence
    background: tuple[float, float, float] | None = None  # None: that of training
    transparent: bool = False
    profile: str | None = None  # None: the backend's first
    backend: str | None = None  # None: the runtime's default
    enhance: bool = False  # run the avatar's enhancer on each image
    light: Light | None = None  # of the scene; None: as trained
    cameras: Sequence[
        Camera
    ] = ()  # tracked ones, one for each pose or one for all; they replace the position above


def frames(avatar: Avatar, sequence: PoseSequence, view: View) -> Iterator[Pixels]:
    """The image of each pose, [H, W, 3] or transparent [H, W, 4]; one camera position shows them all, or the tracked
    cameras of the view.

    Raises AvatarError for a profile that the backend does not draw, for a backend or enhancer whose library is not
    installed, if an enhancer is asked for that the avatar lacks or that is not sound, and if a light is given and that
    of the capture is not known.
    """
    player, count = Player(avatar, view.backend, enhance=view.enhance, light=view.light), len(sequence.poses)
    drawn = player.backend.profiles
    if view.profile is not None and view.profile not in drawn:
        raise AvatarError(
            f"is not supported by backend {view.backend}; choose {' or '.join(drawn)}",
            field=f"profile {view.profile}",
        )
    box = None if view.cameras else framed(player, sequence)
    for index, pose in enumerate(sequence.poses):
        camera = (
            view.cameras[index % len(view.cameras)] if box is None else _orbiting(box, view, index / count)
        )
        background = (0.0, 0.0, 0.0) if view.transparent else view.background
        mesh = None if sequence.posed_vertices is None else sequence.posed_vertices[index]
        frame: Frame = player.frame(pose, camera, background, view.profile, posed_vertices=mesh)
        yield frame.rgba8() if view.transparent else frame.rgb8()


def _orbiting(box: Box, view: View, share: float) -> Camera:
    """The camera of a view after a `share` of the sequence."""
    turn = view.orbit * share
    return frame_camera(
        box, view.width, view.height, np.radians(view.yaw + turn), np.radians(view.pitch), view.zoom
    )


def framed(player: Player, sequence: PoseSequence) -> Box:
    """The box that the camera must show: the binding pose; for Gaussians on a mesh FRAMED frames of the sequence."""
    if player.avatar.embedding is None:
        return robust_box(player.avatar.gaussians.mean)
    count = len(sequence.poses)
    means = []
    for index in np.unique(np.linspace(0, count - 1, min(count, FRAMED)).astype(int)):
        mesh = None if sequence.posed_vertices is None else sequence.posed_vertices[int(index)]
        means.append(player.animate(sequence.poses[index], posed_vertices=mesh).mean)
    return robust_box(np.concatenate(means))


def save(
    out: Path, images: Iterator[Pixels], count: int, fps: float, force: bool, progress: Callable[[int], None]
) -> None:
    """Write `count` images as one .png, an animated .webp, or a folder of frame_00000.png; all or nothing.

    Raises AvatarError for another kind of file, if `out` exists (without `force`), or if one .png is asked for
    several images.
    """
    if out.suffix.lower() not in SUFFIXES:
        raise AvatarError(f"{out.suffix} files cannot be written; name a .png, a .webp or a folder", file=out)
    if out.suffix.lower() == ".png" and count != 1:
        raise AvatarError(f"{count} images do not fit in one .png; name a folder or a .webp", file=out)
    if followed(out).exists() and (not force or out.is_dir()):
        raise AvatarError(
            "exists; choose another name or pass --force (folders are never replaced)", file=out
        )

    def counted() -> Iterator[Pixels]:
        for index, image in enumerate(images):
            progress(index + 1)
            yield image

    with staged(out, force=force and not out.is_dir()) as partial:
        if out.suffix.lower() == ".webp":
            partial.write_bytes(animated_webp(counted(), fps))
        elif out.suffix.lower() == ".png":
            partial.write_bytes(png(next(counted())))
        else:
            partial.mkdir()
            for index, image in enumerate(counted()):
                (partial / f"frame_{index:05d}.png").write_bytes(png(image))
