"""The still image that stands in a published page until the avatar is drawn: its first picture, framed alike."""

from __future__ import annotations

import io
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from PIL import Image, ImageOps

from avatar_export.images import Box
from avatar_export.measure.framing import webp
from avatar_export.serving.session import Shown
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends import default_backend
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.packs import decode_pack, placed
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose

# As in players/web/src/stage/orbit.ts, which frames the first picture.
TANGENT = np.tan(np.radians(15.0))
MARGIN = 1.12
BOUNDS_MARGIN = 1.08  # where a pack states no frame
HEAD_ALONE = 2.5  # a head is framed without the rest if the whole is lower than so many heads
PIXELS = 800  # along the longer side of what is framed
MOST_SCALE = 3.0
CARD = (1200, 630)  # pixels: the size that link previews are made for
CARD_SHARE = 0.88  # of its height, which the avatar takes
QUALITY = 88  # of JPEG
DARKEST = 0.12  # of white: a card's ground is a little lighter than what the avatar was trained over
GROUND = (0.9, 0.9, 0.9)


@dataclass(frozen=True)
class Poster:
    """An image of the avatar as the page first shows it. It may reach beyond what is framed."""

    webp: bytes  # with a transparent background
    aspect: float  # of what is framed: its width by its height
    scale: float  # of the image: its height by that of what is framed
    background: tuple[float, float, float] | None  # display-referred, as trained; None: any


def poster(shown: Shown) -> Poster:
    """Draws the avatar as its page first shows it. Raises AvatarError if it cannot be drawn."""
    held = decode_pack(shown.pack, shown.id)
    avatar, left = placed(held.avatar), held.document["avatar"]["frame"]["handedness"] == "left"
    camera, aspect, scale = _camera(*_frames(held.document, left))
    image = Player(avatar, default_backend()).frame(
        _first_pose(avatar), camera.mirrored() if left else camera, (0.0, 0.0, 0.0)
    )
    background = avatar.raster.background
    return Poster(webp(image.rgba8()), aspect, scale, None if isinstance(background, str) else background)


def _first_pose(avatar: Avatar) -> Pose:
    """A face begins at rest, and moves on from there; what has no expressions begins with its first clip."""
    return Pose() if avatar.expressions or not avatar.clips else frame_pose(avatar, avatar.clips[0], 0)


def _frames(document: Mapping[str, Any], left: bool) -> tuple[Box, Box]:
    """What the page frames, and the whole avatar: each (target, size), right-handed."""
    said = document.get("framing", {})
    whole, head = said.get("whole"), said.get("head")
    if whole is None:
        low, high = (np.asarray(document["avatar"]["bounds"]["rest"][end]) for end in ("min", "max"))
        whole = {"target": (low + high) / 2, "size": (high - low) * BOUNDS_MARGIN}
    part = head if head is not None and whole["size"][1] < HEAD_ALONE * head["size"][1] else whole
    signs = (-1 if left else 1, 1, 1)
    framed, around = (
        (np.multiply(box["target"], signs), np.maximum(box["size"], 1e-6)) for box in (part, whole)
    )
    return framed, around


def _camera(framed: Box, around: Box) -> tuple[Camera, float, float]:
    """The camera of the page's first picture, and aspect and scale of its poster, which shows all of the avatar."""
    target, (across, tall, deep) = framed
    longer = max(across, tall)
    reach = np.abs(around[0] - target) + around[1] / 2
    scale = float(np.clip(2 * np.max(reach[:2] / (across, tall)) / MARGIN, 1, MOST_SCALE))
    width, height = (max(2, round(PIXELS * scale * side / longer)) for side in (across, tall))
    fov_y = float(2 * np.arctan(height * TANGENT / PIXELS))
    distance = float(MARGIN * longer / 2 / TANGENT + deep / 2)
    return Camera.orbit(target, distance, 0.0, 0.0, fov_y, width, height), float(across / tall), scale


def card(of: Poster) -> bytes:
    """The picture of link previews: a JPEG of CARD pixels with the avatar in its middle."""
    with Image.open(io.BytesIO(of.webp)) as image:
        picture = image.convert("RGBA")
    picture = picture.crop(picture.getchannel("A").getbbox())
    picture = ImageOps.contain(picture, (CARD[0], round(CARD[1] * CARD_SHARE)), Image.Resampling.LANCZOS)
    colour = tuple(round(255 * (DARKEST + (1 - DARKEST) * c)) for c in of.background or GROUND)
    ground = Image.new("RGB", CARD, colour)
    ground.paste(picture, ((CARD[0] - picture.width) // 2, (CARD[1] - picture.height) // 2), picture)
    out = io.BytesIO()
    ground.save(out, "JPEG", quality=QUALITY, optimize=True)
    return out.getvalue()
