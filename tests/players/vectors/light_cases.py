"""What the cores must make of a light: packs of each handedness, and lights with the numbers that kernels take."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.packing.write import driving_facts, prepare, write
from avatar_export.relight import relightable
from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.handedness import HANDEDNESS, SH_IN_X, mirrored
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.light import SHADOW_SIZE, DirectLight, Light, LightArrays, light_of, sh_bases
from avatar_runtime.pose import Pose, joint_rotation, resolve
from avatar_runtime.posed import Poser
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.avatars import full_avatar

PARTS = ("ambient", "place", "colour", "turn", "shadow_row", "shadow_offset")
HEAD = "neck"  # the head's joint of the avatar
SUN = {"direction": [1, 2, 3], "colour": [1, 1, 1]}
NO_LIGHTS: list[Any] = [
    [],
    {"ambience": [1, 1, 1]},
    {"ambient": [1, 1]},
    {"ambient": ["1", 1, 1]},
    {"ambient": [[1, 1, 1]] * 8},
    {"ambient": [[1, 1, 1]] * 8 + [[1, 1]]},
    {"lights": {}},
    {"lights": [SUN] * 5},
    {"lights": [{"direction": [1, 0, 0]}]},
    {"lights": [3]},
    {"lights": [{"position": [1, 0, 0], **SUN}]},
    {"lights": [{**SUN, "direction": [1, 0, None]}]},
    {"lights": [{**SUN, "direction": [0, 0, 0]}]},
    {"lights": [{**SUN, "direction": [1e-200, 0, 0]}]},
    {"lights": [{**SUN, "direction": [1, 0, 2e9]}]},
    {"lights": [{**SUN, "colour": [1, -1, 1]}]},
    {"lights": [SUN, {**SUN, "colour": [1, 1e5, 1]}]},
    {"shadow": 1},
]


def lit_avatar() -> Avatar:
    """Right-handed, with a light of its capture that comes from no side alone."""
    ambient = np.random.default_rng(9).normal(0, 0.2, (9, 3)).astype(np.float32)
    ambient[0] = (4, 3.5, 3)
    return relightable(full_avatar(3), ambient)


def light_packs() -> dict[str, bytes]:
    """{handedness: a pack of lit_avatar}."""
    full = lit_avatar()
    return {hand: packed(mirrored(full) if hand == "left" else full, hand) for hand in HANDEDNESS}


def packed(avatar: Avatar, hand: str = "right") -> bytes:
    """A pack of one level, as exact as it can be."""
    return write(prepare([avatar], None), driving_facts(avatar), None, hand).file


def write_light_cases(folder: Path) -> None:
    """`lights.json`, `light_right.avatar`, `light_left.avatar`; `no_lights.json`: what is none, its field and why."""
    for hand, data in light_packs().items():
        (folder / f"light_{hand}.avatar").write_bytes(data)
    (folder / "lights.json").write_text(json.dumps(light_cases()))
    (folder / "no_lights.json").write_text(json.dumps([[said, *refused(said)] for said in NO_LIGHTS]))


def refused(said: Any) -> tuple[str | None, str]:
    """(field, reason) of what is no light."""
    try:
        light_of(said)
    except AvatarError as error:
        return error.field, str(error).removeprefix(f"{error.field}: ")
    raise AssertionError(f"{said} was accepted")


def light_cases() -> list[dict[str, Any]]:
    """Lights of a scene, where the avatar stands in it, and its numbers in a right-handed pack's own space."""
    rng, full, made = np.random.default_rng(36), lit_avatar(), []
    for index in range(12):
        place, scale = np.eye(4), 1.0
        if index > 3:
            scale = float(rng.uniform(0.3, 3)) if index % 2 else 1.0
            turn = matrix_from_rotvec(rng.normal(0, 1, 3))
            place = homogeneous(scale * turn, rng.normal(0, 1, 3))
        pose = homogeneous(matrix_from_rotvec(rng.normal(0, 0.5, 3)), rng.normal(0, 0.1, 3))
        light, turn = _light(rng, index), rng.normal(0, 0.5, 3)
        posed = resolve(Pose(joints={HEAD: joint_rotation(turn)}, world_from_avatar=pose), full)
        arrays = Poser(full).posed(posed, light=in_pack(light, place, scale)).light
        assert arrays is not None
        made.append(
            {
                "place": place.ravel().tolist(),
                "pose": pose.ravel().tolist(),
                "head": turn.tolist(),
                **said_of(light),
                "rows": {hand: rows_of(arrays, hand).tolist() for hand in HANDEDNESS},
            }
        )
    return made


def said_of(light: Light) -> dict[str, Any]:
    """A light as JSON for the cores."""
    return {
        "ambient": light.ambient.astype(np.float64).tolist(),
        "lights": [[list(one.place), list(one.colour), one.point] for one in light.lights],
        "shadow": light.shadow,
    }


def rows_of(arrays: LightArrays, hand: str) -> F64:
    """[25, 4] all numbers, in the order of the values of a frame, seen from a pack of a handedness."""
    rows: F64 = np.concatenate([np.reshape(getattr(arrays, name), (-1, 4)) for name in PARTS]).astype(
        np.float64
    )
    if hand == "left":
        rows[:9] *= SH_IN_X[:9, None]
        rows[9:13, 0] *= -1
        rows[17, 1:] *= -1
        rows[18:20, 0] *= -1
        rows[20:24, 0] *= -1
        turned = 21 if abs(rows[22, 1]) >= 0.9 else 20  # rows or columns run the other way
        rows[turned] = (SHADOW_SIZE - 1) * rows[23] - rows[turned]
    return rows


def _light(rng: np.random.Generator, index: int) -> Light:
    lights = tuple(
        DirectLight(
            tuple(rng.normal(0, 3 if point else 1, 3)), tuple(rng.uniform(0, 2, 3)), point=bool(point)
        )
        for point in rng.permutation(4)[: index % 5] % 2
    )
    return Light(rng.normal(0, 1, (9, 3)).astype(np.float32), lights, index % 3 != 2)


def in_pack(light: Light, place: F64, scale: float) -> Light:
    """`light` as a pack that `place` [4, 4] puts into the scene sees it, by sampling it from all sides."""
    turn = place[:3, :3] / scale
    sides = np.random.default_rng(1).normal(size=(64, 3))
    sides /= np.linalg.norm(sides, axis=1, keepdims=True)
    seen = sh_bases(sides @ turn.T) @ light.ambient.astype(np.float64)
    rows = np.linalg.lstsq(sh_bases(sides), seen, rcond=None)[0]
    lights = tuple(
        DirectLight(
            tuple((np.asarray(one.place) - (place[:3, 3] if one.point else 0)) @ turn / scale),
            tuple(np.asarray(one.colour) / (scale**2 if one.point else 1)),
            one.point,
        )
        for one in light.lights
    )
    ambient = light.ambient if np.array_equal(place, np.eye(4)) else rows.astype(np.float32)
    return Light(ambient, lights, light.shadow)
