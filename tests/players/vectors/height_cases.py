"""The vectors of `height_px` with packs: of each handedness with their framing, and of each table of levels."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from avatar_export.packing.write import prepare, write
from avatar_runtime.handedness import HANDEDNESS, mirrored
from tests.avatars import full_avatar
from tests.conformance.height_vectors import FILE

VECTORS: dict[str, Any] = json.loads(FILE.read_text("utf-8"))


def write_height_cases(folder: Path) -> None:
    """`height_px.json`, `height_right.avatar`, `height_left.avatar`, and `levels_I.avatar` of sequence I."""
    (folder / FILE.name).write_bytes(FILE.read_bytes())
    for name, data in height_packs().items():
        (folder / f"{name}.avatar").write_bytes(data)


def height_packs() -> dict[str, bytes]:
    """By name, without the ending."""
    full, whole, made = full_avatar(3), VECTORS["framing_whole"], {}
    for hand in HANDEDNESS:
        x, y, z = whole["target"]
        target = [-x if hand == "left" else x, y, z]
        framing = {"up": [0.0, 1.0, 0.0], "front": [0.0, 0.0, 1.0], "whole": {**whole, "target": target}}
        own = mirrored(full) if hand == "left" else full
        made[f"height_{hand}"] = write(prepare([own], None), {"framing": framing}, None, hand).file
    for index, one in enumerate(VECTORS["sequences"]):
        levels = [{"height_px": height} for height in one["levels"]]
        made[f"levels_{index}"] = write(prepare([full] * len(levels), None), {"levels": levels}).file
    return made
