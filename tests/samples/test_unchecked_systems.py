"""The samples of RGBAvatar and LHM are what their readers take: avatars at rest are the samples' own surfaces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from plyfile import PlyData
from samples.make import make_lhm, make_rgbavatar
from samples.systems.lhm import PARENTS
from samples.systems.rgbavatar import OFF

from avatar_export.options import ReadOptions
from avatar_export.readers import table
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose

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
    """Each Gaussian rests where the file has it; no joint lies far from the man."""
    base = make_lhm(tmp_path, 800)
    options = ReadOptions(dataset=base / "pretrained_models", shape=base / "betas.npy")
    avatar = table.read(base / "man.ply", options, "lhm")
    assert avatar.rig is not None and avatar.rig.parents.tolist() == list(PARENTS)
    rows = PlyData.read(base / "man.ply")["vertex"]
    stored = np.stack([rows[axis] for axis in "xyz"], axis=1)
    assert np.abs(Player(avatar, "reference").animate(Pose()).mean - stored).max() < METRES
    assert not [note for note in avatar.provenance["notes"] if note.startswith("doubtful")]
