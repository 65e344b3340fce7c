"""Played positions against LAM's rule, transcribed literally in tests/oracles."""

from __future__ import annotations

import zipfile
from pathlib import Path

import numpy as np
import pytest

from avatar_export.readers.lam import read_lam
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation
from avatar_runtime.stages.project import sh_colour
from tests.exporter.readers import lam_files
from tests.golden import ON
from tests.measured import Measure
from tests.oracles.lam_trainer import LamTrainer
from tests.shared_data import shared

METRES = 1e-6
POSES = 4


@pytest.fixture(params=["made", "sample", "real"])
def lam_zip(request: pytest.FixtureRequest, tmp_path: Path) -> Path:
    """The small one, the conformance sample, and a trained one where it is present."""
    if request.param == "made":
        return lam_files.write_zip(tmp_path / "made.zip", lam_files.files())
    if request.param == "sample":
        sample: Path = request.getfixturevalue("sample_lam")
        return sample
    return shared("lam/p2-1.zip")


def _member(path: Path, name: str) -> bytes:
    with zipfile.ZipFile(path) as archive:
        inner = next(n for n in archive.namelist() if n.endswith(f"/{name}") and "__MACOSX" not in n)
        return archive.read(inner)


def _pose(avatar: Avatar, seed: int) -> Pose:
    """Seed 0: neutral; else every third expression, and turns of joints with weight (or of the first few)."""
    if seed == 0:
        return Pose()
    rng = np.random.default_rng(seed)
    names = avatar.expression_names[seed % 3 :: 3]
    joints = [avatar.rig.joint_names[j] for j in np.unique(avatar.skin.column)] if avatar.rig else []
    return Pose(
        {name: float(np.float32(rng.uniform(0, 1))) for name in names},
        {joint: joint_rotation(rng.normal(0, 0.2, 3)) for joint in joints},
    )


@pytest.mark.parametrize("seed", range(POSES))
def test_positions_are_the_trainers(lam_zip: Path, seed: int, backend: str, measured: Measure) -> None:
    avatar = read_lam(lam_zip)
    oracle = LamTrainer(_member(lam_zip, "offset.ply"), _member(lam_zip, "skin.glb"))
    pose = _pose(avatar, seed)
    # A large avatar's rows are shared out among the poses: the oracle walks them one by one.
    step = POSES if avatar.gaussians.count > 1000 else 1
    rows = range(seed % step, avatar.gaussians.count, step)
    want = oracle.positions(pose.expressions, pose.joints, rows)
    got = Player(avatar, backend).animate(pose).mean[rows.start :: step]
    away = float(np.linalg.norm(got - want, axis=1).max())
    measured(f"LAM{ON[backend]}, positions, m", away, METRES)
    assert away <= METRES
    if seed:
        moved = np.linalg.norm(want - avatar.gaussians.mean[rows.start :: step], axis=1)
        assert np.median(moved) > 1e-3, "a pose that moves nothing tests nothing"


def test_everything_else_is_static(lam_zip: Path) -> None:
    avatar = read_lam(lam_zip)
    stored = LamTrainer(_member(lam_zip, "offset.ply"), _member(lam_zip, "skin.glb")).splats
    played = Player(avatar).animate(_pose(avatar, 1))

    def columns(*names: str) -> np.ndarray:
        return np.array([stored[name] for name in names]).T

    assert np.abs(played.quat_wxyz - columns("rot_0", "rot_1", "rot_2", "rot_3")).max() <= 3e-7
    np.testing.assert_allclose(played.scale, np.exp(columns("scale_0", "scale_1", "scale_2")), rtol=1e-6)
    np.testing.assert_allclose(played.opacity, 1 / (1 + np.exp(-columns("opacity")[:, 0])), rtol=1e-6)
    towards = np.tile(np.float32([0, 0, 1]), (avatar.gaussians.count, 1))
    rgb = sh_colour(played.sh, towards, avatar.sh_degree)
    assert np.abs(rgb - columns("f_dc_0", "f_dc_1", "f_dc_2")).max() <= 2e-7
