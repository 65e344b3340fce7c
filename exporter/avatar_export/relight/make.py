"""What an avatar must know before the light of a scene can replace that of its capture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.formats.json_text import parse_json
from avatar_export.measure.framing import head_joint
from avatar_export.relight.capture_light import estimated
from avatar_export.relight.normals import own_normals
from avatar_export.relight.seen import seen
from avatar_runtime.avatar import F32, Avatar, Relight
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes
from avatar_runtime.light import ambient_of, light_of
from avatar_runtime.rules import LIGHT_FRAMES

LARGEST_FILE = 1 << 20  # bytes; a light has a few hundred
MARGIN = 1.2  # of the sphere, for poses
SHARE = 0.5  # percent of the Gaussians at either end that may lie outside of it
# The colours of Gaussians turn with the head, or with the whole avatar where no joint is the head's, and so does the
# light that is in them, whatever the lamps did.
FRAME = "head"


def relightable(avatar: Avatar, ambient: F32 | None = None, frame: str = FRAME) -> Avatar:
    """`avatar` with normals and the light of its capture: `ambient` [9, 3], which moves with `frame`, or estimated."""
    mean = avatar.gaussians.mean.astype(np.float64)
    low, high = np.percentile(mean, (SHARE, 100 - SHARE), axis=0)
    centre = (low + high) / 2
    x, y, z = map(float, centre)
    reach = float(np.percentile(np.linalg.norm(mean - centre, axis=1), 100 - SHARE))
    none = np.zeros((9, 3), np.float32)
    shown = seen(avatar)
    normal = own_normals(avatar, shown.towards).astype(np.float32)
    relight = Relight(normal, none, frame, (x, y, z), max(MARGIN * reach, 1e-6), head_joint(avatar))
    avatar = replace(avatar, relight=relight, packed=None)
    light = estimated(avatar, shown.weight) if ambient is None else ambient
    return replace(avatar, relight=replace(relight, ambient=light))


def light_json(path: Path) -> Any:
    """What a file with a light says. Raises AvatarError for one that is no JSON or too large."""
    return parse_json(read_bytes(path, LARGEST_FILE), path.name)


def captured(path: Path) -> tuple[F32, str]:
    """(ambient light [9, 3], what it moves with) of a file with the light of a capture: a Light, and its frame.

    Raises AvatarError for a file that holds none.
    """
    said = light_json(path)
    light = light_of(said, path.name)
    frame = said.get("frame", FRAME)
    if frame not in LIGHT_FRAMES:
        raise AvatarError(f"is not one of {', '.join(LIGHT_FRAMES)}", file=path.name, field="frame")
    try:
        return ambient_of(light), frame
    except ValueError as error:
        raise AvatarError(str(error), file=path.name, field="lights") from None
