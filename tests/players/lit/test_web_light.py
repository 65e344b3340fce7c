"""Light in the web player: stages by the vectors, heads as Python draws them, pages that move it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.pack_avatars import AVATARS

from avatar_export.measure.views import views
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import driving_facts, pack, prepare, write
from avatar_export.relight import relightable
from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.backends.reference import ReferenceBackend
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.handedness import mirrored, mirrored_pose
from avatar_runtime.light import ambient_of, light_of
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation, resolve
from avatar_runtime.posed import Clock, Poser
from tests.avatars import full_avatar
from tests.conformance.avatars import AVATARS as KIT_AVATARS
from tests.conformance.cases import cases_of
from tests.measured import Measure
from tests.players.core_cases import packed
from tests.players.played_cases import vectors_of
from tests.players.test_web_played import named, wrong_stages
from tests.players.web import (
    BACKENDS,
    CHROMIUM,
    OTHERS,
    Job,
    ask,
    environment_of,
    in_browsers,
    run_node_test,
    shot,
)

KIT = ("lit_head", "lit_world", "lit_joints")
SIZE = 160
LIMIT, WITH_SHADOW = 1 / 255, 2 / 255
SHARE = 0.995  # of the pixels of an image with a shadow: a texel may fall on the other side of an edge
BLACK = (0.0, 0.0, 0.0)
CAPTURE = {
    "ambient": [0.5, 0.52, 0.55],
    "lights": [{"direction": [0.3, 0.8, 1], "colour": [0.5, 0.45, 0.4]}],
}
SKY = [[0.9, 0.8, 0.7], [-0.2, 0.1, 0.4], [0.3, 0.2, 0.1], [0.5, 0.2, -0.3], *[[0.1, -0.05, 0.08]] * 5]
LIGHTS: Mapping[str, Any] = {
    "directional": {
        "ambient": [0.1, 0.1, 0.12],
        "lights": [{"direction": [-2, 0.4, 0.9], "colour": [1.2, 1.0, 0.8]}],
    },
    "points": {
        "ambient": [0.05, 0.05, 0.05],
        "lights": [
            {"position": [0.5, 0.5, 0.6], "colour": [0.5, 0.3, 0.2]},
            {"position": [-0.6, 0.1, 0.3], "colour": [0.1, 0.2, 0.5]},
        ],
    },
    "sky": {"ambient": SKY},
    "shadow": {
        "ambient": [0.2, 0.2, 0.2],
        "lights": [{"direction": [-0.8, 0.9, 0.7], "colour": [1, 0.9, 0.8]}],
        "shadow": True,
    },
    "point_shadow": {
        "ambient": [0.2, 0.2, 0.2],
        "lights": [{"position": [0.7, 0.6, 0.9], "colour": [1, 0.9, 0.8]}],
        "shadow": True,
    },
}


TURNED = Pose(
    joints={"neck": joint_rotation((0.1, 0.5, -0.15))},
    world_from_avatar=np.array([[0.8, 0, -0.6, 0.05], [0, 1, 0, 0.02], [0.6, 0, 0.8, -0.1], [0, 0, 0, 1]]),
)


@in_browsers
def test_stages_of_light_and_a_lit_head(browser: str, tmp_path: Path, measured: Measure) -> None:
    heads = {
        name: relightable(with_active_sh(AVATARS[name].load(tmp_path)), ambient_of(light_of(CAPTURE)))
        for name in ("head_splatting", "head_blendshapes")
    }
    files = {name: write(prepare([head], Fineness())).file for name, head in heads.items()}
    files["left"] = write(prepare([mirrored(heads["head_splatting"])], Fineness()), handedness="left").file
    job, expected = Job(BACKENDS[browser]), dict[str, F32]()
    for name, file in files.items():
        (tmp_path / name).write_bytes(file)
        job.files[f"/{name}.avatar"] = str(tmp_path / name)
    surface, skinned, left = (decode_pack(file, name).avatar for name, file in files.items())
    front, side, _ = (view.camera for view in views(surface, SIZE))
    posed = frame_pose(surface, surface.clips[0], 30)
    turned = replace(
        posed, joints={**posed.joints, **TURNED.joints}, world_from_avatar=TURNED.world_from_avatar
    )
    for name, light in LIGHTS.items():
        expected[name] = drawn(surface, turned, side, light)
        job.shots.append(shot(name, [("/head_splatting.avatar", surface, turned)], side, light=light))
    expected["shadow_skinned"] = drawn(skinned, TURNED, side, LIGHTS["shadow"])
    job.shots.append(
        shot("shadow_skinned", [("/head_blendshapes.avatar", skinned, TURNED)], side, light=LIGHTS["shadow"])
    )
    mirror = {**LIGHTS["shadow"], "ambient": SKY}
    expected["left_shadow"] = drawn(mirrored(left), turned, side, mirror)
    job.shots.append(shot("left_shadow", [("/left.avatar", left, mirrored_pose(turned))], side, light=mirror))
    expected["dark"] = drawn(surface, Pose(), front, None)
    job.shots.append(shot("dark", [("/head_splatting.avatar", surface, Pose())], front))
    for name in KIT:
        source = KIT_AVATARS[name]()
        avatar = decode_pack(pack([source], Fineness(), driving_facts(source)).file, name).avatar
        job.references.append(f"/{name}")
        for part, data in vectors_of(avatar, cases_of(name, avatar)).items():
            (tmp_path / f"{name}.{part}").write_bytes(data)
            job.files[f"/{name}/{part}"] = str(tmp_path / f"{name}.{part}")
    answer = ask(job, tmp_path, browser)
    for backend in job.backends:
        assert {row["stage"] for row in answer.reports[backend, "/lit_head"]["rows"]} >= {"shadow", "light"}
        assert not wrong_stages(answer, backend, measured, browser)
        off = {
            name: np.abs(answer.images[backend, name] - want).max(axis=2) for name, want in expected.items()
        }
        shadowed = {
            name: float((off.pop(name) <= WITH_SHADOW).mean()) for name in list(off) if "shadow" in name
        }
        measured(
            f"{named(browser, backend)}, lit image", max(float(image.max()) for image in off.values()), LIMIT
        )
        assert {name: image.max() for name, image in off.items() if image.max() > LIMIT} == {}
        assert {name: share for name, share in shadowed.items() if share < SHARE} == {}


def drawn(avatar: Avatar, pose: Pose, camera: Camera, said: Mapping[str, Any] | None) -> F32:
    """[H, W, 4] premultiplied colour over black and alpha, by backend `gl`."""
    light = None if said is None else light_of(said)
    image = Player(avatar, "gl", target="rgba32f", light=light).frame(pose, camera, BLACK).image
    return np.dstack([image.colour, 1 - image.transmittance])


@in_browsers
@pytest.mark.parametrize(
    "name", ["lit/viewer", "lit/element", pytest.param("memory", marks=pytest.mark.more)]
)
def test_a_page_moves_the_light(browser: str, name: str, tmp_path: Path) -> None:
    """And allocates nothing for another light in each frame."""
    lit = tmp_path / "lit.avatar"
    lit.write_bytes(packed(relightable(full_avatar(5))))
    run_node_test(f"{name}.test.mjs", environment_of(browser), LIT=str(lit))


ENGINES = [
    pytest.param(CHROMIUM, {}),
    *(pytest.param(name, {"ADAPTERS": "all"}, marks=pytest.mark.players) for name in (CHROMIUM, *OTHERS)),
]


@pytest.mark.parametrize(("browser", "more"), ENGINES)
def test_lights_of_engines_reach_a_head(browser: str, more: dict[str, str], tmp_path: Path) -> None:
    """A white ball of the engine beside it gets the same light."""
    lit = tmp_path / "lit.avatar"
    head = relightable(
        with_active_sh(AVATARS["head_splatting"].load(tmp_path)), ambient_of(light_of(CAPTURE))
    )
    lit.write_bytes(write(prepare([head], Fineness())).file)
    run_node_test("lit/adapters.test.mjs", environment_of(browser), LIT=str(lit), **more)


@pytest.mark.parametrize(("browser", "more"), ENGINES)
def test_avatars_cast_shadows_in_engines(browser: str, more: dict[str, str], tmp_path: Path) -> None:
    """Heads bound to a mesh and skinned ones, in the dark and for a left-handed host."""
    surface, skinned = (AVATARS[name].load(tmp_path) for name in ("head_splatting", "head_blendshapes"))
    files = {
        "surface": write(prepare([surface], Fineness())).file,
        "left": write(prepare([mirrored(skinned)], Fineness()), handedness="left").file,
    }
    told = tmp_path / "casts.json"
    told.write_text(json.dumps([cast(name, file, tmp_path) for name, file in files.items()]))
    run_node_test("lit/shadows.test.mjs", environment_of(browser), CASTS=str(told), **more)


def cast(name: str, file: bytes, folder: Path) -> dict[str, Any]:
    """A pack, a pose, and its mesh in both frames of the pose, right-handed."""
    path = folder / f"{name}.avatar"
    path.write_bytes(file)
    avatar = decode_pack(file, name).avatar
    person = mirrored(avatar) if name == "left" else avatar
    mesh = person.embedding or person.rig
    assert mesh is not None
    turn = {"neck": (0.3, 0.8, -0.4)}
    pose = Pose(
        {"jawOpen": 1.0},
        {joint: joint_rotation(vector) for joint, vector in turn.items()},
        world_from_avatar=TURNED.world_from_avatar,
    )
    said = {"joints": turn, "expressions": pose.expressions, "world": pose.world_from_avatar.ravel().tolist()}
    return {
        "file": f"/casts/{name}.avatar",
        "path": str(path),
        "pose": said,
        "triangles": mesh.triangles.tolist(),
        "rest": posed_mesh(person, Pose()),
        "posed": posed_mesh(person, pose),
    }


def posed_mesh(avatar: Avatar, pose: Pose) -> list[list[float]]:
    """[V, 3] in the world, by the NumPy stages."""
    posed = Poser(avatar).posed(resolve(pose, avatar))
    world = posed.world_from_avatar
    vertices: list[list[float]] = (
        ReferenceBackend(avatar).mesh(posed, Clock()) @ world[:3, :3].T + world[:3, 3]
    ).tolist()
    return vertices
