"""Images of an avatar: camera, contact sheet, PNG and animated WebP."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFont

from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.driving.arkit import canonical
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import DrivingFrame
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.stages.activate import Splats
from avatar_runtime.subset import subset

Pixels = npt.NDArray[np.uint8]
Box = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]
FOV_Y = np.radians(20.0)
MARGIN = 1.08
FARTHEST = 1e12  # metres; positions beyond do not enlarge the view
FRAMED = 2048  # Gaussians of a pose that set a camera
SHEET_SIZE = 288
SHEET_COLUMNS = 5
# The most recognisable shapes of a face, shown on a contact sheet if the avatar has them.
SHEET_EXPRESSIONS: dict[str, dict[str, float]] = {
    "jawOpen": {"jawOpen": 1.0},
    "mouthSmile": {"mouthSmileLeft": 1.0, "mouthSmileRight": 1.0},
    "eyeBlink": {"eyeBlinkLeft": 1.0, "eyeBlinkRight": 1.0},
    "mouthPucker": {"mouthPucker": 1.0},
    "brows up": {"browInnerUp": 1.0, "browOuterUpLeft": 1.0, "browOuterUpRight": 1.0},
    "browDown": {"browDownLeft": 1.0, "browDownRight": 1.0},
    "mouthFrown": {"mouthFrownLeft": 1.0, "mouthFrownRight": 1.0},
    "cheekPuff": {"cheekPuff": 1.0},
    "eyes to the left": {"eyeLookOutLeft": 0.6, "eyeLookInRight": 0.6},
    "noseSneer": {"noseSneerLeft": 1.0, "noseSneerRight": 1.0},
}
SHEET_MOMENTS = 6
SHEET_VIEWS = (("three-quarter left", 40.0), ("three-quarter right", -40.0), ("side", 85.0))


def frame_camera(
    box: Box, width: int, height: int, yaw: float = 0.0, pitch: float = 0.0, zoom: float = 1.0
) -> Camera:
    """A camera that shows the whole box; yaw and pitch in radians, 0 in front of the face."""
    low, high = box
    half = (high - low) / 2 * MARGIN
    across = float(np.hypot(half[0], half[2]))  # the largest width at any yaw
    fit = np.tan(FOV_Y / 2)
    distance = max(half[1] / fit, max(half[0], half[2]) / (fit * width / height)) / zoom + across
    return Camera.orbit((low + high) / 2, distance, yaw, pitch, float(FOV_Y), width, height)


def robust_box(mean: npt.NDArray[np.floating[Any]]) -> Box:
    """The box (low, high) of positions [N, 3] without the outermost thousandth, which ignores stray Gaussians."""
    mean = np.clip(np.nan_to_num(mean.astype(np.float64)), -FARTHEST, FARTHEST)
    return np.percentile(mean, 0.1, axis=0), np.percentile(mean, 99.9, axis=0)


def seen(avatar: Avatar, *poses: Pose) -> Box:
    """The box of an evenly spaced selection of Gaussians in all `poses` together, which sets a camera."""
    count = avatar.gaussians.count
    rows = np.unique(np.linspace(0, count - 1, min(count, FRAMED)).astype(np.int64))
    return robust_box(np.concatenate([splats.mean for splats in animated_rows(avatar, rows, *poses)]))


def animated_rows(avatar: Avatar, rows: npt.NDArray[np.int64], *poses: Pose) -> list[Splats]:
    """The Gaussians `rows` in each of `poses`, by backend `reference`."""
    vertices = np.arange(0) if avatar.rig is None else avatar.rig.anchor_vertices
    player = Player(subset(avatar, rows, vertices).avatar, "reference")
    return [player.animate(pose) for pose in poses]


def contact_sheet(avatar: Avatar, size: int = SHEET_SIZE) -> Pixels:
    """The contact sheet [H, W, 3]: neutral, ten expressions or moments of a clip, and more views, with labels."""
    player, poses = Player(avatar, "reference"), sheet_poses(avatar)
    box = robust_box(_means(player, [pose for _, pose, _ in poses]))
    cells = [
        (label, player.frame(pose, frame_camera(box, size, size, yaw)).rgb8()) for label, pose, yaw in poses
    ]
    rows = -(-len(cells) // SHEET_COLUMNS)
    sheet = Image.new("RGB", (SHEET_COLUMNS * size, rows * size))
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(size=max(10, size // 18))
    for index, (label, pixels) in enumerate(cells):
        at = (index % SHEET_COLUMNS * size, index // SHEET_COLUMNS * size)
        sheet.paste(Image.fromarray(pixels), at)
        draw.text(
            (at[0] + 6, at[1] + 4),
            label,
            fill=(255, 255, 255),
            font=font,
            stroke_width=1,
            stroke_fill=(0, 0, 0),
        )
    result: Pixels = np.asarray(sheet)
    return result


def sheet_poses(avatar: Avatar) -> list[tuple[str, Pose, float]]:
    """(label, pose, yaw in radians) of every cell: ARKit shapes, else its first expressions, else its first clip."""
    cells: list[tuple[str, Pose, float]] = [("neutral", Pose(), 0.0)]
    if avatar.driving.mode != "none":
        reached = {canonical(name) for name in (*avatar.driving.inputs, *avatar.expression_names)}
        for label, weights in SHEET_EXPRESSIONS.items():
            if set(weights) <= reached:
                cells.append((label, arkit_pose(avatar, weights), 0.0))
    else:
        for expression in avatar.expressions[: len(SHEET_EXPRESSIONS)]:
            cells.append((expression.name, Pose({expression.name: expression.range[1]}), 0.0))
    if len(cells) == 1 and avatar.clips:
        clip = avatar.clips[0]
        for frame in np.linspace(0, clip.frames, SHEET_MOMENTS, endpoint=False).astype(int):
            label = f"{clip.name}, {frame / clip.fps:.2f} s"
            cells.append((label, frame_pose(avatar, clip, int(frame)), float(np.radians(SHEET_VIEWS[0][1]))))
    return cells + [(label, Pose(), float(np.radians(yaw))) for label, yaw in SHEET_VIEWS]


def _means(player: Player, poses: list[Pose]) -> npt.NDArray[np.float32]:
    """Positions that the camera must show; a skinned head stays near its binding pose."""
    if player.avatar.embedding is None:
        return player.avatar.gaussians.mean
    return np.concatenate([player.animate(pose).mean for pose in poses])


def arkit_pose(avatar: Avatar, weights: dict[str, float]) -> Pose:
    """The pose for ARKit weights, through the avatar's driving. Raises AvatarError if ARKit cannot drive it."""
    return Driver(avatar).pose(DrivingFrame(0.0, weights))


def png(pixels: Pixels) -> bytes:
    """A PNG of [H, W, 3 | 4]; same pixels, same bytes."""
    out = io.BytesIO()
    Image.fromarray(pixels).save(out, "PNG", compress_level=6)
    return out.getvalue()


def animated_webp(frames: Iterable[Pixels], fps: float) -> bytes:
    """An endless animation of [H, W, 3 | 4] frames."""
    images = [Image.fromarray(frame) for frame in frames]
    if not images:
        raise ValueError("an animation needs a frame")
    out = io.BytesIO()
    images[0].save(
        out,
        "WEBP",
        save_all=True,
        append_images=images[1:],
        duration=round(1000 / fps),
        loop=0,
        quality=85,
        method=2,
    )
    return out.getvalue()
