"""Avatars in light: what their packs are made of, lights, and the images by backend `gl` that players must show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from avatar_export.packing.write import driving_facts, prepare, write
from avatar_export.relight import relightable
from avatar_runtime.avatar import F32, F64, Avatar
from avatar_runtime.handedness import mirrored
from avatar_runtime.light import DirectLight, Light
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.exporter.packing.cases import COARSE
from tests.players.vectors.light_cases import in_pack, lit_avatar
from tests.runtime.backends import gl_cases

BYTE = 1 / 255
NEAR, SHARE = 2 / 255, 0.995  # with a shadow so many pixels are so near: texels have edges
STILL = np.eye(4)
SUN = DirectLight((0.5, 0.6, 0.7), (1.2, 1.0, 0.7))
LAMP = DirectLight((-0.3, 0.1, 0.3), (0.05, 0.08, 0.2), point=True)
SKY = np.random.default_rng(3).normal(0, 0.15, (9, 3)).astype(np.float32) + np.eye(9, 1, dtype=np.float32)
LIGHTS = {
    "all": Light(SKY, (SUN, LAMP)),
    "sun": Light(np.zeros((9, 3), np.float32), (SUN,), shadow=True),
    "lamp": Light(SKY, (LAMP,), shadow=True),
}
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
PLACE = homogeneous(matrix_from_rotvec(np.array([0.1, -0.7, 0.2])), np.array([0.03, 0.02, -0.05]))


def avatars() -> dict[str, tuple[Avatar, str]]:
    """{name: (what the pack is made of, its handedness)}."""
    full = lit_avatar()
    assert full.relight is not None
    surface = relightable(gl_cases.avatars()["surface world"], full.relight.ambient, "world")
    return {"full": (full, "right"), "left": (mirrored(full), "left"), "surface": (surface, "right")}


def packed_avatars() -> dict[str, tuple[bytes, str]]:
    """{name: (a pack, its handedness)} of each of `avatars`."""
    return {
        name: (write(prepare([source], COARSE), driving_facts(source), None, hand).file, hand)
        for name, (source, hand) in avatars().items()
    }


def wanted(pack: bytes, hand: str, light: Light, place: F64 = STILL) -> F32:
    """[H, W, 4] by backend `gl`; with a place, the camera and the light are moved instead of the avatar.

    A left-handed avatar is mirrored back; where a shadow falls, the camera and the light are mirrored instead: of a
    triangle that is too large for its thread, other texels are left out than of its mirror image.
    """
    avatar = decode_pack(pack, hand).avatar
    if hand == "left" and light.shadow:
        place = place @ MIRROR
    elif hand == "left":
        avatar = mirrored(avatar)
    light = in_pack(light, place, 1.0)
    seen = gl_cases.camera()
    seen = replace(
        seen,
        camera_from_world=(seen.camera_from_world @ place).astype(np.float32),
        clip_from_world=(seen.clip_from_world @ place).astype(np.float32),
        centre=(np.linalg.inv(place) @ (*seen.centre, 1))[:3].astype(np.float32),
    )
    player = Player(avatar, "gl", target="rgba32f", light=light)
    image = player.frame(gl_cases.pose_of(avatar), seen, (0.0, 0.0, 0.0)).image
    return np.dstack([image.colour, 1 - image.transmittance])


def apart(found: F32, want: F32, shadow: bool) -> float:
    """How far an image is from another, as a share of what it may be."""
    off = np.abs(found - want).max(axis=2)
    assert want[..., 3].max() > 0.5
    return float((off > NEAR).mean() / (1 - SHARE) if shadow else off.max() / BYTE)
