"""Tracked poses: what the rig then does against FLAME's and SMPL's own sums; damaged files by name."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.bodies.body_model import read_body_model
from avatar_export.bodies.body_rig import bake_rig
from avatar_export.bodies.pose_files import body_clip, is_pose_file, read_poses
from avatar_export.clips.poses import clip_poses, rig_avatar
from avatar_export.rigs.rig_driving import expressions_named
from avatar_runtime.avatar import Clip, Rig
from avatar_runtime.player import Player
from tests.exporter.bodies import body_files
from tests.exporter.bodies.body_files import FLAME_PARENTS, SMPL_PARENTS
from tests.exporter.refusals import put, refused
from tests.measured import Measure
from tests.oracles.lbs import posed_vertices

METRES = 1e-6  # float32 of vertices, joints and deltas within a metre or two


def _rig(folder: Path, model: dict[str, Any], shape: Any) -> Rig:
    return bake_rig(read_body_model(body_files.write_body(folder / "body.npz", model)), shape)


def _played(rig: Rig, clip: Clip) -> list[np.ndarray]:
    avatar = rig_avatar(rig, expressions_named(tuple(f"exp_{i}" for i in range(rig.morphs.columns))))
    player = Player(avatar)
    return [player.mesh(pose) for pose in clip_poses(avatar, clip)]


def _expect(
    played: list[np.ndarray], model: dict[str, Any], p: dict[str, Any], measured: Measure, offset: Any = None
) -> None:
    assert len(played) == body_files.FRAMES
    for t, vertices in enumerate(played):
        want = posed_vertices(
            model, p["shape"], p["expression"][t], p["rotation"][t], p["translation"][t], offset
        )
        off = np.abs(vertices - want).max()
        measured("body clip against plain LBS m", off, METRES)
        assert off < METRES


def test_flame_params_json(tmp_path: Path, measured: Measure) -> None:
    model, p = body_files.body(FLAME_PARENTS), body_files.poses(5)
    p["translation"][:] = 0  # the file has none
    path = body_files.flame_json(tmp_path / "flame_params.json", p)
    poses = read_poses(path)
    assert is_pose_file(path) and poses.fps == 25
    assert poses.joint_names == ("root", "neck", "jaw", "leftEye", "rightEye")
    rig = _rig(tmp_path, model, poses.shape)
    clip = body_clip(rig, poses, "take")
    assert clip.name == "take" and clip.frames == body_files.FRAMES
    _expect(_played(rig, clip), model, p, measured)


@pytest.mark.parametrize("split", [False, True])
def test_smpl_poses(tmp_path: Path, measured: Measure, split: bool) -> None:
    model, p = body_files.body(SMPL_PARENTS), body_files.poses(24)
    p["expression"][:] = 0
    poses = read_poses(body_files.smpl_npz(tmp_path / "poses.npz", p, split))
    assert poses.fps == 30 and poses.joint_names[15] == "head"
    rig = _rig(tmp_path, model, poses.shape)
    _expect(_played(rig, body_clip(rig, poses, "take")), model, p, measured)


def test_gaussian_avatars_poses(tmp_path: Path, measured: Measure) -> None:
    model, p = body_files.body(FLAME_PARENTS), body_files.poses(5)
    offset = np.random.default_rng(3).normal(0, 0.01, model["v_template"].shape).astype("f4")
    poses = read_poses(body_files.flame_param(tmp_path / "flame_param.npz", p, offset))
    assert poses.static_offset is not None
    np.testing.assert_array_equal(poses.static_offset, offset)
    moved = {**model, "v_template": model["v_template"] + poses.static_offset}
    rig = _rig(tmp_path, moved, poses.shape)
    _expect(_played(rig, body_clip(rig, poses, "take")), model, p, measured, offset)


def test_joints_of_a_turned_rest_frame_turn_in_mesh_axes(tmp_path: Path, measured: Measure) -> None:
    model, p = body_files.body(FLAME_PARENTS), body_files.poses(5)
    poses = read_poses(body_files.flame_param(tmp_path / "flame_param.npz", p, np.zeros((63, 3))))
    model["posedirs"][:] = 0  # of the deltas, which differ
    rig = _rig(tmp_path, model, poses.shape)
    world = np.linalg.inv(rig.inverse_bind_matrix.astype(np.float64))
    turn = np.array([[0, -1, 0, 0], [0, 0, -1, 0], [1, 0, 0, 0], [0, 0, 0, 1.0]])
    world = world @ turn
    local = [w if q < 0 else np.linalg.inv(world[q]) @ w for w, q in zip(world, rig.parents, strict=True)]
    object.__setattr__(rig, "rest_local", np.array(local, "f4"))
    object.__setattr__(rig, "inverse_bind_matrix", np.linalg.inv(world).astype("f4"))
    _expect(_played(rig, body_clip(rig, poses, "take")), model, p, measured)


def test_a_clip_of_another_body_model_is_refused(tmp_path: Path) -> None:
    model, p = body_files.body(FLAME_PARENTS), body_files.poses(5)
    rig = _rig(tmp_path, model, None)
    smpl = read_poses(body_files.smpl_npz(tmp_path / "poses.npz", body_files.poses(24), False))
    refused("rotates joint pelvis, which the rig lacks", body_clip, rig, smpl, "take")
    p["expression"] = np.ones((body_files.FRAMES, 9))
    wide = read_poses(body_files.flame_json(tmp_path / "flame_params.json", p))
    refused("has 9 expressions, but the rig has 3", body_clip, rig, wide, "take")


def _json(change: Callable[[Any], object], folder: Path) -> Path:
    path = body_files.flame_json(folder / "flame_params.json", body_files.poses(5))
    document = json.loads(path.read_text())
    change(document)
    path.write_text(json.dumps(document))
    return path


def _npz(arrays: dict[str, Any], folder: Path) -> Path:
    np.savez(folder / "poses.npz", **arrays)
    return folder / "poses.npz"


T72, NECK = np.zeros((2, 72)), np.zeros((2, 3))
BAD: list[tuple[Any, str]] = [
    *((put("frames", frames), "frames: is not a non-empty list") for frames in ([], [1])),
    (lambda d: d.pop("shape_params"), "shape_params: is not a list of 1 to 1000 numbers"),
    (lambda d: d["frames"][3]["pose"].pop(), r"frames\[3\].pose: is not a list of 15"),
    (lambda d: d["frames"][2]["expression"].append(0), r"frames\[2\].expression: is not a list of 3 numbers"),
    *((put("frames", 1, "pose", pose), r"frames\[1\].pose: holds a value") for pose in (["0"] * 15, [True] * 15)),
    *((put("frames", 0, "pose", 0, value), "holds a value that is not") for value in (float("nan"), 10**400)),
    ({"betas": np.zeros(10)}, "has no poses of a body model"),
    ({"thetas": np.zeros((3, 72)), "transl": np.zeros((2, 3))}, "transl: has 2 frames"),
    ({"thetas": T72, "transl": np.full((2, 3), 1e7)}, r"transl: value at \[0, 0\] is not finite, or too large"),
    ({"thetas": np.array([{}], object)}, "thetas: holds pickled objects"),
    ({"thetas": T72, "betas": np.zeros(1001)}, "betas: has 1001 coefficients"),
    ({"neck_pose": NECK}, "expr: is missing"),
    ({"neck_pose": NECK, "expr": np.zeros((3, 5))}, r"expr: has shape \[3, 5\]"),
    ({"neck_pose": NECK, "expr": np.zeros((2, 5)), "static_offset": np.zeros((2, 9, 3))},
     r"static_offset: is float64\[2, 9, 3\]"),
]  # fmt: skip


@pytest.mark.parametrize(("bad", "message"), BAD, ids=[message for _, message in BAD])
def test_damaged_files(tmp_path: Path, bad: Any, message: str) -> None:
    refused(message, read_poses, (_npz if isinstance(bad, dict) else _json)(bad, tmp_path))
