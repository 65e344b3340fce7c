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
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation
from tests.exporter.bodies import body_files
from tests.exporter.readers.rgbavatar import run_files
from tests.exporter.readers.rgbavatar.run_files import BASES, HIDDEN, INPUTS, Run
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
    uv = made.uvs.reshape(-1, 3, 2)[face]
    return tangent_frames.gaussian(
        run_files.row(made, n), vertices[made.body["triangles"][face]], uv, weights
    )


def _weights(made: Run, expression: Array, pose: Array, lids: Array, deep: bool = False) -> Array:
    """Weights of the bases for rotation vectors [5, 3]."""
    turns = np.stack([lbs.rodrigues(vector) for vector in pose[1:]])
    widths = (INPUTS, HIDDEN, HIDDEN, BASES) if deep else (INPUTS, BASES)
    values = tangent_frames.driving_values(expression, turns, lids)
    return tangent_frames.network(made.columns["weight_module"].astype(np.float64), widths, values)


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


def test_the_rest_pose_is_exact(tmp_path: Path) -> None:
    made = run_files.run()
    mean, quat, dc = _differences(made, _read(made, tmp_path / "run"), np.zeros(3), STILL, NO_LIDS)
    assert mean < METRES and quat < QUAT and dc < DC


def test_bases_of_a_linear_network_are_exact_where_no_triangle_moves(tmp_path: Path) -> None:
    """Expressions and eyelids drive means, rotations and colours; the mesh stands still."""
    made = run_files.run(rigid=True)
    expression, lids = np.array([0.7, -1.5, 2.0]), np.array([0.5, 1.0])
    mean, quat, dc = _differences(made, _read(made, tmp_path / "run"), expression, STILL, lids)
    assert mean < METRES and quat < QUAT and dc < DC
    assert (
        np.abs(_weights(made, expression, STILL, lids) - _weights(made, expression, STILL, NO_LIDS)).max()
        > 0.01
    )


def test_joints_drive_means_exactly_where_a_triangle_follows_one_joint(tmp_path: Path) -> None:
    """Rotations and colours that a joint drives have no place in a bundle; means have."""
    made = run_files.run(rigid=True)
    pose = np.zeros((5, 3))
    pose[1:] = (0.1, -0.3, 0.2), (0.3, 0.1, 0.0), (0.2, 0, 0), (0, 0.2, 0)
    mean, _, dc = _differences(made, _read(made, tmp_path / "run"), np.zeros(3), pose, NO_LIDS)
    assert mean < METRES
    assert dc > 1e-3


def test_the_formulas_that_other_poses_are_measured_with_are_those_of_the_release(tmp_path: Path) -> None:
    made = run_files.run()
    avatar = _read(made, tmp_path / "run")
    assert avatar.rig is not None
    rng = np.random.default_rng(1)
    vertices = _vertices(made, rng.normal(0, 1, 3), rng.normal(0, 0.3, (5, 3)), rng.random(2))
    weights = rng.normal(0, 1, BASES)
    cloud = files.located(tmp_path / "run")
    assert cloud is not None
    model = files.read_model(cloud)
    uv = made.uvs.reshape(-1, 3, 2)
    binding = frames.Binding(model, avatar.rig.triangles, uv, made.face.astype(np.uint32))
    posed = binding.posed(vertices, weights)
    for n in ROWS:
        mean, quat, dc = _truth(made, n, vertices, weights)
        assert np.abs(posed.mean[n] - mean).max() < 1e-12
        assert min(np.abs(posed.quat_wxyz[n] - quat).max(), np.abs(posed.quat_wxyz[n] + quat).max()) < 1e-12
        assert np.abs(posed.dc[n] - dc).max() < 1e-12


def test_other_poses_are_nearer_than_without_the_frames_of_the_triangles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At least half as far off, with expressions of half a deviation, on charts that are not mirrored."""
    made = run_files.run()
    made.uvs = run_files.charts(made.body)
    expression = np.array([0.4, -0.4, 0.4])
    avatar = _read(made, tmp_path / "run")
    found = _differences(made, avatar, expression, STILL, NO_LIDS)
    still = frames._slopes

    def none(*given: Any) -> Any:
        return tuple(0 * part for part in still(*given))

    monkeypatch.setattr(frames, "_slopes", none)
    without = _differences(made, _read(made, tmp_path / "none"), expression, STILL, NO_LIDS)
    assert found[0] < without[0] / 2 and found[1] < without[1] / 2
    (note,) = [n for n in avatar.provenance["notes"] if "no tangent frames" in n]
    assert "mm (rms" in note


def test_a_deep_network_gives_its_bases_to_the_clip(tmp_path: Path, measured_once: None) -> None:
    made = run_files.run(deep=True, rigid=True)
    poses = body_files.poses(5)
    poses["rotation"][:, 0] = 0
    poses["translation"] *= 0
    poses["shape"] *= 0
    file = body_files.flame_param(
        tmp_path / "flame_param.npz", poses, np.zeros((len(made.body["v_template"]), 3))
    )
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
    assert any("hidden layers" in note and "distill" in note for note in avatar.provenance["notes"])


def test_without_poses_a_deep_network_rests(tmp_path: Path, measured_once: None) -> None:
    made = run_files.run(deep=True, rigid=True)
    avatar = _read(made, tmp_path / "run")
    rest = _weights(made, np.zeros(3), STILL, NO_LIDS, deep=True)
    splats = Player(avatar, "reference").animate(Pose())
    mean, _, dc = _truth(made, 5, made.body["v_template"].astype(np.float64), rest)
    assert np.abs(splats.mean[5] - mean).max() < METRES and np.abs(splats.sh[5, 0] - dc).max() < DC
    assert not avatar.clips and avatar.expressions[-1].range == (-1.0, 1.0)


def _no_face(made: Run) -> None:
    made.columns = {name: c for name, c in made.columns.items() if not name.startswith("face_bary")}


def _no_uvs(made: Run) -> None:
    made.left_out = {"uvs"}


def _few_uv_faces(made: Run) -> None:
    made.uvs = made.uvs[3:]


def _teeth(made: Run) -> None:
    made.face[3] = len(made.body["triangles"])


def _blend(made: Run) -> None:
    made.config = "model:\n  use_blend: False\n"


def _template(made: Run) -> None:
    made.config = "template_type: FuHead\n"


def _size(made: Run) -> None:
    made.config = "model:\n  use_mlp_proj: True  # but the file is small\n"


def _long(made: Run) -> None:
    made.config = "model:\n  use_mlp_proj: False\n"
    made.columns["weight_module"][-1] = 1


def _lids(made: Run) -> None:
    made.lids = made.lids[:, 1:]


def _infinite(made: Run) -> None:
    made.columns["rot_b_5"][7] = np.inf


def _bases(made: Run) -> None:
    del made.columns["xyz_b_8"]


REFUSALS: tuple[tuple[Callable[[Run], None], str], ...] = (
    (_no_face, "model.ply: property face_id: is missing; it says which triangle"),
    (_no_uvs, "body.npz: uvs: is missing; the frames of the triangles need"),
    (_few_uv_faces, "body.npz: uv_faces: has"),
    (_teeth, "60 vertices and 56 triangles of teeth"),
    (_blend, "config.yaml: use_blend: is False"),
    (_template, "config.yaml: template_type: is 'FuHead'; only FLAME is read"),
    (_size, "model.ply: weight_module: holds"),
    (_long, "need 390 with use_mlp_proj false"),
    (_lids, "l_eyelid and r_eyelid: are not two arrays"),
    (_infinite, "model.ply: rot_b_5[7]: is not finite"),
    (_bases, "model.ply: xyz_b_*: has 8 properties, expected 3 for each basis"),
)


@pytest.mark.parametrize(("spoil", "said"), REFUSALS, ids=[spoil.__name__ for spoil, _ in REFUSALS])
def test_bad_input_is_refused(spoil: Callable[[Run], None], said: str, tmp_path: Path) -> None:
    made = run_files.run()
    spoil(made)
    with pytest.raises(AvatarError) as error:
        _read(made, tmp_path / "run")
    assert said in str(error.value) and str(error.value).startswith("rgbavatar: ")


def test_a_body_model_is_needed_and_has_five_joints(tmp_path: Path) -> None:
    path, body = run_files.run().write(tmp_path / "run")
    with pytest.raises(AvatarError, match="needs --body-model"):
        table.read(path)
    smpl = body_files.write_body(tmp_path / "smpl.npz", body_files.body(body_files.SMPL_PARENTS))
    with pytest.raises(AvatarError, match="has 24 joints; FLAME has 5"):
        table.read(path, ReadOptions(body_model=smpl))
    assert table.find(path).system == "rgbavatar" == table.find(path / "model.ply").system
    assert body.exists()
