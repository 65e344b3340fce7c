"""What icons must be: the same avatars, drawn by the runtime in their binding pose from far away."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
from samples.unity import FOLDER

from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import prepare, write
from avatar_runtime.avatar import F32, Avatar, Rules
from avatar_runtime.camera import Camera
from avatar_runtime.codec import safetensors
from avatar_runtime.handedness import mirrored
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.avatars import surface_avatar

SIZE = 96  # pixels
FAR = 200.0  # metres: nearly no perspective
BORDER, OUTLIERS = 1.12, 0.005  # as Icon.cs frames
IN_TRIANGLES = Rules("triangle_frame", position="triangle_frame", scale="triangle_linear")


def write_icons(folder: Path) -> None:
    """Packs, icons.json with their names, and the images as premultiplied RGBA, first row at the bottom."""
    head, body = (
        (FOLDER / path).read_bytes()
        for path in ("Head/Resources/sample_head.avatar", "Body/Resources/sample_body.avatar")
    )
    files = {
        "head": head,
        "body": body,
        "by_normal": packed(mirrored(plain(surface_avatar())), "left"),
        "in_triangles": packed(plain(surface_avatar(rules=IN_TRIANGLES)), "right"),
    }
    for name, file in files.items():
        (folder / f"{name}.avatar").write_bytes(file)
        with (folder / f"{name}.safetensors").open("wb") as out:
            out.writelines(safetensors.encode({"rgba": drawn(file, name)}))
    (folder / "icons.json").write_text(
        json.dumps({"icons": [{"name": name, "size": SIZE} for name in files]})
    )


def plain(avatar: Avatar) -> Avatar:
    """Without colours that depend on the direction of view: icons have none."""
    b = avatar.blendshapes
    appearance = replace(b.appearance, values={**b.appearance.values, "sh": b.appearance.values["sh"][:, :1]})
    return replace(
        avatar,
        sh_degree=0,
        gaussians=replace(avatar.gaussians, sh=avatar.gaussians.sh[:, :1]),
        blendshapes=replace(b, appearance=appearance),
    )


def packed(avatar: Avatar, handedness: str) -> bytes:
    """The pack of an avatar that is in that frame."""
    return write(prepare([avatar], Fineness()), handedness=handedness).file


def drawn(file: bytes, name: str) -> F32:
    """[SIZE, SIZE, 4], framed by the places of the Gaussians."""
    pack = decode_pack(file, name)
    avatar = pack.avatar
    player = Player(avatar, "reference")
    vertices = None if avatar.embedding is None else avatar.embedding.canonical_vertices
    places = np.sort(player.animate(Pose(), posed_vertices=vertices).mean, axis=0)
    outside = int(OUTLIERS * len(places))
    low, high = places[outside], places[-1 - outside]
    fov = 2 * np.arctan(BORDER * (high - low)[:2].max() / 2 / FAR)
    left = pack.document["avatar"]["frame"]["handedness"] == "left"
    target = (low + high) / 2 * ([-1, 1, 1] if left else [1, 1, 1])
    camera = Camera.orbit(target, FAR, 0, 0, fov, SIZE, SIZE)
    camera = camera.mirrored() if left else camera
    image = player.frame(Pose(), camera, (0, 0, 0), posed_vertices=vertices).image
    return np.ascontiguousarray(np.dstack([image.colour, 1 - image.transmittance])[::-1], np.float32)
