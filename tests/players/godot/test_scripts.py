"""The scripts of the add-on in the engine: import, properties, clips, scenes, Live Link, face trackers, bad files."""

from __future__ import annotations

import json
import shutil
import struct
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.driving.live_link_udp import parse_packet
from avatar_export.packing.steps import CLIP_STEPS
from avatar_export.writers.rig_glb import rig_glb
from avatar_runtime.avatar import Avatar, Clip
from avatar_runtime.driving.arkit import ARKIT_NAMES, CHANNELS
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import frame_of
from avatar_runtime.driving.idle import idle
from avatar_runtime.engine_pose import engine_pose, local_transforms, target_names
from avatar_runtime.handedness import mirrored, mirrored_matrices
from avatar_runtime.packs import decode_pack
from avatar_runtime.pose import Pose, PoseArrays, resolve
from avatar_runtime.posed import Poser
from tests.avatars import full_avatar
from tests.conformance.idle_vectors import FILE as IDLE_FILE
from tests.exporter.live.senders import live_link_packets
from tests.measured import Measure
from tests.players.core_cases import POSES, packed, pose_floats, poses
from tests.players.godot import engine
from tests.players.hostile.packs import write_hostile

pytestmark = pytest.mark.godot

Array = np.ndarray[Any, Any]
MATRICES = ("joint_delta", "world_from_avatar")
HERE = Path(__file__).parent / "project"
LIMIT = (
    8 * 2.0**-24
)  # of skin matrices: a turn becomes a quaternion and back, then meets those of its parents
CLIP_STEP = CLIP_STEPS["joint_delta"]
PACKETS = 40
IDLE: list[dict[str, Any]] = json.loads(IDLE_FILE.read_text("utf-8"))
ACTIVE, JOINTS = 4, 5  # expressions and joints of full_avatar


@pytest.fixture(scope="module")
def packs() -> dict[str, bytes]:
    full = full_avatar(5)
    frames = full.clips[0].frames
    still = [
        np.eye(4, dtype=np.float32) + np.zeros((frames, *many, 1, 1), np.float32) for many in ((JOINTS,), ())
    ]
    weights = np.zeros((frames, ACTIVE), np.float32)
    weights[:, 0] = np.linspace(0, 1, frames)
    quiet = Clip(
        "quiet", 10.0, weights, np.zeros((frames, 2), np.float32), *still
    )  # after clips that move all
    full = replace(full, clips=(*full.clips, quiet))
    return {"right": packed(full), "left": packed(mirrored(full), "left")}


@pytest.fixture(scope="module")
def avatars(packs: dict[str, bytes]) -> dict[str, Avatar]:
    return {name: decode_pack(file, name).avatar for name, file in packs.items()}


@pytest.fixture(scope="module")
def expected(avatars: dict[str, Avatar]) -> dict[str, dict[str, Array]]:
    """Poses of each pack and what comes of them: those of the clips, then random ones."""
    return {name: poses(avatar) for name, avatar in avatars.items()}


@pytest.fixture(scope="module")
def folder(
    tmp_path_factory: pytest.TempPathFactory, packs: dict[str, bytes], expected: dict[str, Any]
) -> Path:
    """An imported project with the packs, and what the script in it is given."""
    made = engine.project(tmp_path_factory.mktemp("scripts"))
    shutil.copy(HERE / "scripts.gd", made)
    for name, file in packs.items():
        (made / f"{name}.avatar").write_bytes(file)
    rig = rig_glb(decode_pack(packs["right"], "right").avatar)
    assert rig is not None
    (made / "rig.glb").write_bytes(b"".join(rig))
    sent = live_link_packets()[:PACKETS]
    (made / "packets.bin").write_bytes(b"".join(struct.pack("<I", len(one)) + one for one in sent))
    given = {
        "packs": [f"res://{name}.avatar" for name in packs],
        "poses": {f"res://{name}.avatar": rows(expected[name], name == "left") for name in packs},
        "packets": "res://packets.bin",
        "idle": [{name: case[name] for name in ("seconds", "seed")} for case in IDLE],
    }
    (made / "given.json").write_text(json.dumps(given))
    engine.imported(made).clean()
    return made


@pytest.fixture(scope="module")
def told(folder: Path) -> dict[str, Any]:
    """What scripts.gd found."""
    return result(engine.run(folder, "--script", "res://scripts.gd", headless=True))


def result(said: engine.Said, complaints: bool = False) -> dict[str, Any]:
    (line,) = (one for one in said.text.splitlines() if one.startswith("RESULT "))
    found: dict[str, Any] = json.loads(line.removeprefix("RESULT "))
    if not complaints:
        said.clean()
    return found


def rows(held: Mapping[str, Any], left: bool) -> list[dict[str, Any]]:
    """Poses as scripts set them: in the person's frame."""
    turned = mirrored_matrices if left else np.asarray
    return [
        {
            "expressions": held["expression_weights"][i].tolist(),
            "eyelids": held["late_weights"][i].tolist(),
            "joints": turned(held["joint_delta"][i]).reshape(-1, 16).tolist(),
            "root": turned(held["world_from_avatar"][i]).ravel().tolist(),
        }
        for i in range(len(held["pose_floats"]))
    ]


def posed_floats(avatar: Avatar, arrays: PoseArrays) -> Array:
    """What the GPU gets of a pose."""
    assert avatar.packed is not None
    return pose_floats(avatar.packed.program, Poser(avatar).posed(arrays))


def as_keys(matrices: Array) -> Array:
    """Matrices [..., 4, 4] of a clip as the keys have them: turns, as no file with rounded entries holds them.

    Columns are made orthogonal one after the other. Sizes within a step of the file are 1.
    """
    made = matrices.astype(np.float64)
    linear = made[..., :3, :3]
    size = np.linalg.norm(linear, axis=-2, keepdims=True)
    size[(np.abs(size - 1) <= CLIP_STEP).all(axis=-1, keepdims=True).repeat(3, -1)] = 1
    x = linear[..., 0] / np.linalg.norm(linear[..., 0], axis=-1, keepdims=True)
    y = linear[..., 1] - x * (x * linear[..., 1]).sum(-1, keepdims=True)
    y /= np.linalg.norm(y, axis=-1, keepdims=True)
    made[..., :3, :3] = size * np.stack([x, y, np.cross(x, y)], axis=-1)
    return made


def same(found: Any, wanted: Any) -> float:
    """How much of the tolerance is used."""
    found, wanted = np.array(found), np.array(wanted, np.float64)
    assert found.shape == wanted.shape
    used = float((np.abs(found - wanted) / (LIMIT * np.maximum(1, np.abs(wanted)))).max())
    assert used <= 1, used
    return used


def test_clips_give_the_pose_of_the_runtime_at_each_key(
    told: dict[str, Any], avatars: dict[str, Avatar], expected: dict[str, Any]
) -> None:
    for name, found in zip(avatars, told["clips"], strict=True):
        avatar = avatars[name]
        assert sorted(found) == sorted(clip.name for clip in avatar.clips)
        deltas = [
            np.concatenate([as_keys(getattr(clip, part)) for clip in avatar.clips]) for part in MATRICES
        ]
        rigid = replace(avatar, clips=())
        got = np.concatenate([found[clip.name] for clip in avatar.clips])
        wanted = expected[name]
        made = [
            posed_floats(rigid, PoseArrays(weights, late, joints, whole))
            for weights, late, joints, whole in zip(
                wanted["expression_weights"], wanted["late_weights"], *deltas, strict=False
            )
        ]
        print(name, same(got, made), np.abs(got - wanted["pose_floats"][: len(got)]).max())
        np.testing.assert_allclose(got, wanted["pose_floats"][: len(got)], rtol=0, atol=4 * CLIP_STEP)


def test_properties_give_the_pose_of_the_runtime(
    told: dict[str, Any], avatars: dict[str, Avatar], expected: dict[str, Any]
) -> None:
    for name, found in zip(avatars, told["poses"], strict=True):
        print(name, same(found[-POSES:], expected[name]["pose_floats"][-POSES:]))


def test_a_scene_keeps_what_differs(told: dict[str, Any]) -> None:
    scene = told["scene"]
    turn = "joints/jaw/rotation = Quaternion(0, 0.24740396, 0, 0.9689124)"
    assert scene["stored"] == ["expressions/mouth/mouthSmileLeft = 0.25", turn]
    assert scene["heir"] == ["expressions/mouth/mouthSmileLeft = 0.0"]  # the scene that it inherits has 0.25
    assert scene["loaded"] == [0.25, True] and scene["back"] and scene["can_revert"]
    assert scene["aliases"] == [True, 0.75]


def test_live_link_over_udp_gives_the_weights_of_python(
    told: dict[str, Any], avatars: dict[str, Avatar]
) -> None:
    avatar = avatars["right"]
    driver = Driver(avatar)
    assert len(told["live"]) == PACKETS
    for found, sent in zip(told["live"], live_link_packets(), strict=False):
        channels = parse_packet(sent).channels
        assert channels is not None
        wanted = posed_floats(avatar, resolve(driver.pose(frame_of(0.0, channels)), avatar))
        np.testing.assert_array_equal(np.float32(found[:ACTIVE]), wanted[:ACTIVE])
        same(found, wanted)


def test_idle_life_has_the_numbers_of_every_player(told: dict[str, Any], avatars: dict[str, Avatar]) -> None:
    said = told["idle"]
    wanted = [[case["channels"].get(name, 0.0) for name in CHANNELS] for case in IDLE]
    np.testing.assert_allclose(said["faces"], wanted, rtol=0, atol=1e-7)
    pose = Driver(avatars["right"]).pose(idle(said["seconds"], 5))
    wanted_floats = posed_floats(avatars["right"], resolve(pose, avatars["right"]))
    np.testing.assert_allclose(said["pose"], wanted_floats, rtol=0, atol=1e-6)
    assert 0 < said["seconds"] < 10


def test_unified_expressions_move_arkits(told: dict[str, Any]) -> None:
    tracker = told["tracker"]
    assert tracker.pop("without") == 0
    assert tracker.pop("channels") == list(ARKIT_NAMES)
    moved = {name.removeprefix("FT_"): channels for name, channels in tracker.items()}
    assert set(ARKIT_NAMES) == {channel for channels in moved.values() for channel in channels}
    for name, channels in moved.items():
        for side, other in (("Left", "Right"), ("Right", "Left")):
            if name.endswith(f"_{side.upper()}"):
                assert not any(channel.endswith(other) for channel in channels), name
                mirror = moved[f"{name.removesuffix(side.upper())}{other.upper()}"]
                assert [one.replace(side, other) for one in channels] == mirror, name
    for name, channels in KNOWN.items():
        assert moved[name] == channels, name


KNOWN = {  # what the two standards say of themselves
    "EYE_CLOSED_LEFT": ["eyeBlinkLeft"], "EYE_LOOK_OUT_RIGHT": ["eyeLookOutRight"],
    "JAW_OPEN": ["jawOpen"], "MOUTH_CLOSED": ["mouthClose"],
    "MOUTH_CORNER_PULL_LEFT": ["mouthSmileLeft"], "MOUTH_RAISER_UPPER": ["mouthShrugUpper"],
    "LIP_FUNNEL_LOWER_LEFT": ["mouthFunnel"], "LIP_PUCKER_UPPER_RIGHT": ["mouthPucker"],
    "TONGUE_OUT": ["tongueOut"], "LIP_SUCK_UPPER_LEFT": ["mouthRollUpper"],
    "BROW_LOWERER_RIGHT": ["browDownRight"], "MOUTH_LOWER_LEFT": ["mouthLeft"],
    "MOUTH_LOWER_DOWN_LEFT": ["mouthLowerDownLeft"], "BROW_INNER_UP_LEFT": ["browInnerUp"],
    "CHEEK_SUCK_LEFT": [],
}  # fmt: skip


def test_properties_are_listed_as_sliders_in_groups(told: dict[str, Any], avatars: dict[str, Avatar]) -> None:
    listed = {row["name"]: row for row in told["scene"]["listed"]}
    editor, stored, read_only = 4, 2, 268435456
    assert (
        listed["licence"]["usage"] == editor | read_only and listed["levels"]["usage"] == editor | read_only
    )
    assert listed["level"]["hint_string"].startswith("By height:-1,48 splats:0")
    for one in avatars["right"].expressions:
        group = next((part for part in ("jaw", "mouth") if one.name.startswith(part)), "other")
        row = listed[f"expressions/{group}/{one.name}"]
        low, high, *hints = row["hint_string"].split(",")
        assert [float(low), float(high)] == list(one.range) and hints == ["0.001", "or_greater", "or_less"]
        assert row["usage"] & ~stored == editor
    assert {f"joints/jaw/{part}" for part in ("position", "rotation", "scale")} < set(listed)
    assert {"eyelids/left", "pose/position", "pose/rotation"} < set(listed)


def test_what_is_not_understood_is_said_in_a_line(told: dict[str, Any]) -> None:
    refused = told["refused"]
    assert refused["unknown"].endswith('ARKit has no "jawWide"') and "52 or 61" in refused["few"]
    assert refused["kind"] == refused["few"] and "no avatar is loaded" in refused["empty"]
    assert refused["warnings"] == [[], ['Nothing is shown: set "avatar".']] and refused["aabb"] == [
        True,
        False,
    ]
    assert refused["driven"][0] == "" and refused["driven"] == refused["as_floats"]
    same(refused["touched"], refused["driven"][1])


def test_hostile_packs_give_a_line_each(folder: Path, packs: dict[str, bytes]) -> None:
    """One import of the whole corpus."""
    golden = Path(__file__).parents[2] / "data" / "packs" / "1.0"
    files = {**packs, **{path.stem: path.read_bytes() for path in golden.glob("*.avatar")}}
    corpus = folder / "hostile"
    corpus.mkdir()
    write_hostile(files, corpus)
    refused = json.loads((corpus / "hostile.json").read_text())
    sound = json.loads((corpus / "sound.json").read_text())
    said = engine.imported(folder)
    assert said.code == 0 and len(refused) > 100, said.text[-2000:]
    lines = [line for line in said.complaints if not line.startswith("ERROR: Error importing")]
    by_file = {line.removeprefix("ERROR: ").split(":")[0]: line for line in lines}
    assert len(lines) == len(refused), set(by_file) ^ {one["file"] for one in refused}
    for one in refused:
        message = one["message"].removeprefix("a.avatar: ").replace("com.avatar-export.player", "the player")
        assert message in by_file[one["file"]], one
    assert not any(name in by_file for name in sound) and not said.leaked


def test_the_mesh_of_a_shadow_takes_the_pose(
    told: dict[str, Any], avatars: dict[str, Avatar], expected: dict[str, Any], measured: Measure
) -> None:
    """As engine_pose poses it, whichever hand the pack has; what expressions move of joints is left out."""
    avatar, names = avatars["right"], target_names(avatars["right"])
    assert avatar.rig is not None
    bones = [name.replace(":", "_").replace("/", "_") for name in avatar.rig.joint_names]
    for hand, answers in zip(avatars, told["shadows"], strict=True):
        for one, found in zip(rows(expected[hand], hand == "left"), answers, strict=True):
            pose = pose_of(avatar, one)
            weights = engine_pose(avatar, pose).weights
            want = engine_pose(avatar, replace(pose, expressions={}))
            local = local_transforms(want.translation, want.rotation_xyzw, want.scale)
            off = np.abs([found["shapes"][name] for name in names] - weights).max()
            off = max(off, np.abs([found["bones"][name] for name in bones] - local[:, :3]).max())
            off = max(off, np.abs(found["root"] - np.reshape(one["root"], (4, 4))[:3]).max())
            measured("godot, the pose of a shadow", float(off), CLIP_STEP)
            assert off <= CLIP_STEP


def pose_of(avatar: Avatar, one: dict[str, Any]) -> Pose:
    """Of what a script set."""
    assert avatar.rig is not None
    matrices = {
        name: np.reshape(m, (4, 4)) for name, m in zip(avatar.rig.joint_names, one["joints"], strict=True)
    }
    expressions = dict(zip(avatar.expression_names, one["expressions"], strict=True))
    eyelids = dict(zip(avatar.eyelids, one["eyelids"], strict=True))
    return Pose(expressions, matrices, eyelids, np.reshape(one["root"], (4, 4)))
