"""A trained model's own renderer against the bundle made of it, on poses and views that were never trained on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from rich.table import Table

from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_trainer.capture import Capture, Frame
from avatar_trainer.drawing import draw
from avatar_trainer.system import System
from avatar_trainer.tensors import Rendered

# Rounding decides at thresholds: whether alpha reaches 1/255, whether a splat ends a pixel, which tiles a radius
# reaches, and which of two splats of nearly equal depth comes first. A pixel where it decided otherwise is counted.
FLIP = 1e-4
TRAINED = "trainer"  # the raster profile that training draws with
BACKENDS = (("reference", TRAINED), ("cpu", TRAINED), ("gl", "engine"))


@dataclass(frozen=True)
class Row:
    """One backend against the trainer's renderer over all compared frames."""

    backend: str
    profile: str
    frames: int
    largest: float  # difference of a colour, 0..1, over all pixels but the flipped
    flipped: int  # pixels that lie further off than FLIP
    furthest: float  # the largest difference of those
    psnr_db: float  # inside the mask (where the trainer draws anything), the worst frame; infinite: equal


def compare(
    system: System, avatar: Avatar, every: int = 1, backends: Iterable[tuple[str, str]] = BACKENDS
) -> list[Row]:
    """Every `every`-th held-out frame of the system's capture, in its own view; one row a (backend, profile).

    `avatar` is the one that was read back from the bundle. Raises AvatarError where a backend's library is missing.
    """
    frames = [frame for frame in system.capture.frames if frame.split == "test"][::every]
    wanted = [draw(system, frame) for frame in frames]
    return [_row(system.capture, avatar, frames, wanted, *pair) for pair in backends]


def table(rows: Iterable[Row]) -> Table:
    """The rows as they are shown."""
    shown = Table(box=None, pad_edge=False)
    for title in ("backend", "profile"):
        shown.add_column(title)
    for title in ("frames", "largest difference", "flipped pixels", "largest of those", "worst PSNR dB"):
        shown.add_column(title, justify="right")
    for row in rows:
        numbers = (f"{row.largest:.2g}", str(row.flipped), f"{row.furthest:.2g}")
        if row.profile != TRAINED:  # other pixels altogether: only the PSNR says something
            numbers = ("-", "-", "-")
        shown.add_row(row.backend, row.profile, str(row.frames), *numbers, f"{row.psnr_db:.1f}")
    return shown


def pose_of(capture: Capture, avatar: Avatar, frame: Frame) -> Pose:
    """A tracked pose by names, those that `avatar` has."""
    pose, joints = frame.pose, capture.rig.joint_names
    expressions = dict(zip(capture.expression_names, pose.expression_weights.tolist(), strict=True))
    eyelids = dict(zip(capture.late_morph_names, pose.late_weights.tolist(), strict=True))
    return Pose(
        {name: weight for name, weight in expressions.items() if name in avatar.expression_names},
        dict(zip(joints, pose.joint_delta, strict=True)) if avatar.rig is not None else {},
        {name: weight for name, weight in eyelids.items() if name in avatar.late_morph_names},
        pose.world_from_avatar,
    )


def _row(
    capture: Capture,
    avatar: Avatar,
    frames: list[Frame],
    wanted: list[Rendered],
    backend: str,
    profile: str,
) -> Row:
    player = Player(avatar, backend)
    largest, flipped, furthest, psnr = 0.0, 0, 0.0, np.inf
    for frame, rendered in zip(frames, wanted, strict=True):
        colour, alpha = rendered.colour.numpy(), rendered.alpha.numpy()
        drawn = player.frame(pose_of(capture, avatar, frame), frame.camera, (0.0, 0.0, 0.0), profile).picture
        off = np.abs(drawn.colour.astype(np.float64) - colour).max(axis=-1)
        flips = off > FLIP
        largest = max(largest, float(off[~flips].max(initial=0.0)))
        flipped += int(flips.sum())
        furthest = max(furthest, float(off[flips].max(initial=0.0)))
        noise = float(np.mean(np.square(drawn.colour.astype(np.float64) - colour)[alpha > 0]))
        psnr = min(psnr, -10 * np.log10(noise) if noise > 0 else np.inf)
    return Row(backend, profile, len(frames), largest, flipped, furthest, psnr)
