"""RGBAvatar: the avatar that is read against the formulas of the release, transcribed in tests/oracles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.options import ReadOptions
from avatar_export.readers import table
from avatar_export.readers.rgbavatar import files, frames, measured
from avatar_runtime.avatar import Avatar
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation
from tests.exporter.bodies import body_files
from tests.exporter.readers import rgbavatar_files
from tests.exporter.readers.rgbavatar_files import BASES, DEEP, LINEAR, Run
from tests.exporter.refusals import refused
from tests.oracles import lbs, tangent_frames

Array = npt.NDArray[Any]

ROUNDING = 2.0**-23
METRES = 16 * ROUNDING  # on positions of about a metre
DC = 16 * ROUNDING  # on values up to 4
QUAT = 64 * ROUNDING  # three Newton steps, then products
ROWS = range(0, 400, 7)
EXACT = ReadOptions(exact=True)


@pytest.fixture
def measured_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A deep network needs 33,539 rows: one pose of them is measured, not eight."""
    monkeypatch.setattr(measured, "POSES", 1)


def _read(made: Run, folder: Path, **options: Any) -> Avatar:
    path, body = made.write(folder)
    return table.read(path, replace(EXACT, body_model=body, **options))


def _truth(made: Run, n: int, vertices: Array, weights: Array) -> tuple[Array, Array, Array]:
    face = int(made.face[n])
    corners, uv = vertices[made.body["triangles"][face]], made.uvs.reshape(-1, 3, 2)[face]
    return tangent_frames.gaussian(rgbavatar_files.row(made, n), corners, uv, weights)


def _weights(made: Run, expression: Array, pose: Array, lids: Array, deep: bool = False) -> Array:
    """Weights of the bases for rotation vectors [5, 3]."""
    turns = np.stack([lbs.rodrigues(vector) for vector in pose[1:]])
    values = tangent_frames.driving_values(expression, turns, lids)
    parameters = made.columns["weight_module"].astype(np.float64)
    return tangent_frames.network(parameters, DEEP if deep else LINEAR, values)


def _vertices(made: Run, expression: Array, pose: Array, lids: Array) -> Array:
    both = np.concatenate([made.body["expression"], np.moveaxis(made.lids, 0, 2)], axis=2)
    model = {**made.body, "expression": both}
    return lbs.posed_vertices(model, np.zeros(0), np.r_[expression, lids], pose, np.zeros(3))


def _pose(expression: Array, pose: Array, lids: Array) -> Pose:
    names = [f"exp_{k:03d}" for k in range(len(expression))] + ["eyelid_left", "eyelid_right"]
    joints = {name: joint_rotation(v) for name, v in zip(JOINTS, pose, strict=True)}
    return Pose(dict(zip(names, np.r_[expression, lids].tolist(), strict=True)), joints)


JOINTS = ("root", "neck", "jaw", "leftEye", "rightEye")
STILL = np.zeros((5, 3))
NO_LIDS = np.zeros(2)


def _differences(
    made: Run, avatar: Avatar, expression: Array, pose: Array, lids: Array
) -> tuple[Array, Array, Array]:
    """Largest differences of [means, quaternions up to sign, DC] over ROWS."""
    splats = Player(avatar, "reference").animate(_pose(expression, pose, lids))
    vertices, weights = _vertices(made, expression, pose, lids), _weights(made, expression, pose, lids)
    off = []
    for n in ROWS:
        mean, quat, dc = _truth(made, n, vertices, weights)
        own = splats.quat_wxyz[n] / np.linalg.norm(splats.quat_wxyz[n])
        turned = min(np.abs(own - quat).max(), np.abs(own + quat).max())
        off.append((np.abs(splats.mean[n] - mean).max(), turned, np.abs(splats.sh[n, 0] - dc).max()))
    return np.array(off).max(axis=0)


@pytest.mark.parametrize("driven", ["rest", "bases", "joints"])
def test_what_is_exact(tmp_path: Path, driven: str) -> None:
    """The rest pose; what a linear network drives while the mesh stands still; and what joints do to means.

    Rotations and colours that a joint drives have no place in a bundle.
    """
    made = rgbavatar_files.run(rigid=driven != "rest")
    expression, pose, lids = np.zeros(3), np.zeros((5, 3)), NO_LIDS
    if driven == "bases":
        expression, lids = np.array([0.7, -1.5, 2.0]), np.array([0.5, 1.0])
        still = _weights(made, expression, STILL, NO_LIDS)
        assert np.abs(_weights(made, expression, STILL, lids) - still).max() > 0.01
    elif driven == "joints":
        pose[1:] = (0.1, -0.3, 0.2), (0.3, 0.1, 0.0), (0.2, 0, 0), (0, 0.2, 0)
    mean, quat, dc = _differences(made, _read(made, tmp_path / "run"), expression, pose, lids)
    assert mean < METRES
    assert dc > 1e-3 if driven == "joints" else quat < QUAT and dc < DC


def test_other_poses_are_nearer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = rgbavatar_files.run()
    made.uvs = rgbavatar_files.charts(made.body)
    expression = np.array([0.4, -0.4, 0.4])
    avatar = _read(made, tmp_path / "run")
    found = _differences(made, avatar, expression, STILL, NO_LIDS)
    still = frames._slopes

    def none(*given: Any) -> Any:
        return tuple(0 * part for part in still(*given))

    monkeypatch.setattr(frames, "_slopes", none)
    without = _differences(made, _read(made, tmp_path / "none"), expression, STILL, NO_LIDS)
    assert found[0] < without[0] / 2 and found[1] < without[1] / 2
    assert "no tangent frames" in str(avatar.provenance["notes"])


def test_a_deep_network_gives_its_bases_to_the_clip(tmp_path: Path, measured_once: None) -> None:
    made = rgbavatar_files.run(deep=True, rigid=True)
    poses = body_files.poses(5)
    poses["rotation"][:, 0] = poses["translation"][:] = poses["shape"][:] = 0
    still = np.zeros((len(made.body["v_template"]), 3))
    file = body_files.flame_param(tmp_path / "flame_param.npz", poses, still)
    lids = np.random.default_rng(2).random((len(poses["rotation"]), 2))
    np.savez(file, **dict(np.load(file)), eyelids=lids)
    avatar = _read(made, tmp_path / "run", poses=file)
    (clip,) = avatar.clips
    rest = _weights(made, np.zeros(3), STILL, NO_LIDS, deep=True)
    for t in (0, 3):
        turned = poses["rotation"][t].astype("f4").astype(np.float64)
        wanted = _weights(made, poses["expression"][t], turned, lids[t], deep=True) - rest
        assert np.abs(clip.expression_weights[t, -BASES:] - wanted).max() < 1e-5
    assert avatar.expression_names[-BASES:] == ("basis_00", "basis_01", "basis_02")
    seen = clip.expression_weights[:, -1]
    assert avatar.expressions[-1].range == (min(0, float(seen.min())), max(0, float(seen.max())))
    splats = Player(avatar, "reference").animate(frame_pose(avatar, clip, 3))
    vertices = _vertices(made, np.zeros(3), turned, NO_LIDS)
    weights = _weights(made, poses["expression"][3], turned, lids[3], deep=True)
    for n in ROWS:
        mean, _, dc = _truth(made, n, vertices, weights)
        assert np.abs(splats.mean[n] - mean).max() < METRES and np.abs(splats.sh[n, 0] - dc).max() < DC
    assert "distill" in str(avatar.provenance["notes"])


def _without(prefix: str) -> Callable[[Run], None]:
    return lambda made: [made.columns.pop(name) for name in [*made.columns] if name.startswith(prefix)]


def _teeth(made: Run) -> None:
    made.face[3] = len(made.body["triangles"])


def _set(**fields: Any) -> Callable[[Run], None]:
    return lambda made: vars(made).update(fields)


def _long(made: Run) -> None:
    made.config = "model:\n  use_mlp_proj: False\n"
    made.columns["weight_module"][-1] = 1


REFUSALS: tuple[tuple[Callable[[Run], None], str], ...] = (
    (_without("face_bary"), "model.ply: property face_id: is missing"),
    (_set(left_out={"uvs"}), "body.npz: uvs: is missing"),
    (lambda made: _set(uvs=made.uvs[3:])(made), "body.npz: uv_faces: has"),
    (_teeth, "60 vertices and 56 triangles of teeth"),
    (_set(config="model:\n  use_blend: False\n"), "config.yaml: use_blend: is False"),
    (_set(config="template_type: FuHead\n"), "config.yaml: template_type: is 'FuHead'"),
    (_set(config="model:\n  use_mlp_proj: True\n"), "model.ply: weight_module: holds"),
    (_long, "need 390 with use_mlp_proj false"),
    (lambda made: _set(lids=made.lids[:, 1:])(made), "l_eyelid and r_eyelid: are not two arrays"),
    (lambda made: made.columns["rot_b_5"].__setitem__(7, np.inf), r"model.ply: rot_b_5\[7\]: is not finite"),
    (_without("xyz_b_8"), r"model.ply: xyz_b_\*: has 8 properties"),
)  # fmt: skip


@pytest.mark.parametrize(("spoil", "said"), REFUSALS, ids=[said for _, said in REFUSALS])
def test_bad_input_is_refused(spoil: Callable[[Run], None], said: str, tmp_path: Path) -> None:
    made = rgbavatar_files.run()
    spoil(made)
    refused(f"^rgbavatar: .*{said}", _read, made, tmp_path / "run")


def test_a_body_model_is_needed_and_has_five_joints(tmp_path: Path) -> None:
    path, _ = rgbavatar_files.run().write(tmp_path / "run")
    refused("needs --body-model", table.read, path)
    smpl = body_files.write_body(tmp_path / "smpl.npz", body_files.body(body_files.SMPL_PARENTS))
    refused("has 24 joints; FLAME has 5", table.read, path, ReadOptions(body_model=smpl))
    assert not files.read_eyelid_weights(
        path / "flame_params.json", 2
    ).any()  # without eyelids they stay open
    assert table.find(path).system == "rgbavatar" == table.find(path / "model.ply").system
