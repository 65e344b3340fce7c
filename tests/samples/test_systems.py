"""Samples in the layouts of their trainers: what a file holds, and that their readers take it."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from plyfile import PlyData
from samples.make import make_lhm, make_rgbavatar
from samples.systems.lhm import PARENTS
from samples.systems.rgbavatar import OFF

from avatar_export.options import ReadOptions
from avatar_export.readers import lam, table
from avatar_runtime.avatar import Avatar
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose

UNITS = {"sample_splatting_head": 4.0, "sample_splatting_head_sh3": 4.0, "sample_body": 1.0}
BASE = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"]
TAIL = ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"]


class Run:
    """The files of a run, parsed by other code than wrote them."""

    def __init__(self, folder: Path) -> None:
        self.config: dict[str, Any] = yaml.safe_load((folder / "run" / "config.yaml").read_text())
        files = folder / "run" / "point_cloud" / "iteration_30000"
        self.ply = PlyData.read(files / "point_cloud.ply")
        self.rows = self.ply["vertex"].data
        self.embedding = json.loads((files / "embedding.json").read_text())
        self.obj = (files / "embedding.obj").read_text()
        self.vertices = np.array(re.findall(r"^v (\S+) (\S+) (\S+)$", self.obj, re.M), float)
        corners = re.findall(r"^f (\d+)//\1 (\d+)//\2 (\d+)//\3$", self.obj, re.M)
        self.triangles = np.array(corners, int) - 1

    def listed(self, name: str) -> np.ndarray:
        return np.array(self.embedding[name])


@pytest.fixture(params=UNITS)
def run(request: pytest.FixtureRequest) -> Run:
    return Run(request.getfixturevalue(request.param))


def test_layout(run: Run) -> None:
    degree = run.config["model"]["sh_degree"]
    rest = [f"f_rest_{i}" for i in range(3 * ((degree + 1) ** 2 - 1))]
    assert run.ply.byte_order == "<" and not run.ply.text
    assert list(run.rows.dtype.names) == BASE + rest + TAIL
    assert {run.rows.dtype[n].str for n in run.rows.dtype.names} == {"<f4"}
    assert run.config["pipe"]["convert_SHs_python"] is (degree > 0)
    assert list(run.embedding) == ["cano_mesh", "sample_fidxs", "sample_bary", "_xyz", "_rotation"]
    n, v, f = len(run.rows), len(run.vertices), len(run.triangles)
    assert [run.listed(k).shape for k in list(run.embedding)[1:]] == [(n,), (n, 3), (n, 3), (n, 4)]
    head = [f"# {v} vertices", f"# {v} normals", "# 0 texture coordinates", f"# {f} triangles"]
    assert run.obj.splitlines()[:4] == head
    number = r"-?\d+\.\d{6}"
    assert len(re.findall(rf"^vn? {number} {number} {number}$", run.obj, re.M)) == 2 * v


@pytest.mark.parametrize("name", ["splatting_head", "body"])
def test_the_canonical_mesh_is_a_posed_first_frame(name: str, request: pytest.FixtureRequest) -> None:
    run = Run(request.getfixturevalue(f"sample_{name}"))
    avatar: Avatar = request.getfixturevalue(f"{name}_avatar")
    posed = Player(avatar).mesh(frame_pose(avatar, avatar.clips[0], 0))
    np.testing.assert_allclose(posed * UNITS[f"sample_{name}"], run.vertices, atol=2e-6)


def test_lam(lam_zip: Path) -> None:
    avatar = lam.read(lam_zip, ReadOptions())
    assert avatar.provenance["notes"] == []  # no node stands elsewhere than in the binding pose
    assert [clip.name for clip in avatar.clips] == ["idle", "nod"]
    moved = np.abs(avatar.clips[1].joint_delta - np.eye(4)).max(axis=(0, 2, 3)) > 1e-3
    assert {avatar.rig.joint_names[j] for j in np.flatnonzero(moved)} == {"head", "neckLower"}


METRES = 1e-6


def test_rgbavatar(tmp_path: Path) -> None:
    """A linear network: every expression of the body drives the bases, and the head stands off its mesh by OFF."""
    base = make_rgbavatar(tmp_path, 3000, deep=False, full=True)
    avatar = table.read(base / "run", ReadOptions(dataset=base, poses=base / "flame_params.json"))
    assert avatar.rig is not None and avatar.gaussians.count == 3000
    assert [clip.name for clip in avatar.clips] == ["flame_params"]
    assert avatar.expression_names[-2:] == ("eyelid_left", "eyelid_right")
    rows = PlyData.read(base / "run" / "model.ply")["vertex"]
    corner = avatar.rig.vertices[avatar.rig.triangles[np.asarray(rows["face_id"])]]
    bary = np.stack([rows[f"face_bary_{k}"] for k in range(3)], axis=1)
    off = Player(avatar, "reference").animate(Pose()).mean - np.einsum("nc,nci->ni", bary, corner)
    assert OFF / 2 < np.median(np.linalg.norm(off, axis=1)) < 2 * OFF + 1e-3, "and the bases' biases move it"
    assert any("linear" in note for note in avatar.provenance["notes"])


def test_lhm(tmp_path: Path) -> None:
    base = make_lhm(tmp_path, 800)
    options = ReadOptions(dataset=base / "pretrained_models", shape=base / "betas.npy")
    avatar = table.read(base / "man.ply", options, "lhm")
    assert avatar.rig is not None and avatar.rig.parents.tolist() == list(PARENTS)
    rows = PlyData.read(base / "man.ply")["vertex"]
    stored = np.stack([rows[axis] for axis in "xyz"], axis=1)
    assert np.abs(Player(avatar, "reference").animate(Pose()).mean - stored).max() < METRES
    assert not [note for note in avatar.provenance["notes"] if note.startswith("doubtful")]
