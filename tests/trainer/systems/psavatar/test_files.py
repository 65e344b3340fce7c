"""PSAvatar's checkpoint: what the exporter reads of it plays as the system in memory does."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import torch

from avatar_export.options import ReadOptions
from avatar_export.readers.table import read
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_trainer.captures.model import Capture
from avatar_trainer.systems.psavatar.system import PSAvatar
from avatar_trainer.tensors import Splats
from tests.measured import Measure
from tests.oracles.joint_turns import rotation_of
from tests.trainer.systems.psavatar import scene
from tests.trainer.systems.splatting_avatar import scene as sheet


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return sheet.blank(tmp_path_factory.mktemp("sheet"))


@pytest.fixture(scope="module")
def system(capture: Capture) -> PSAvatar:
    return scene.as_gaussians(capture)


@pytest.fixture(scope="module")
def saved(system: PSAvatar, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("saved")
    system.save(folder, 40)
    return folder


def exported(system: PSAvatar, folder: Path) -> Avatar:
    body = system.capture.export_inputs["body_model"]
    return read(folder, ReadOptions(body_model=body, shape=Path("zero")))


def apart(system: PSAvatar, avatar: Avatar) -> dict[str, float]:
    """The largest difference of what both make of every frame: metres, entries of matrices, values."""
    player, worst = Player(avatar, "reference"), dict.fromkeys(("mean", "rotation", "seen", "others"), 0.0)
    for frame in system.capture.frames:
        weights = dict(
            zip(system.capture.expression_names, frame.pose.expression_weights.tolist(), strict=True)
        )
        joints = dict(zip(system.capture.rig.joint_names, frame.pose.joint_delta, strict=True))
        ours, theirs = system.splats(frame.pose), player.animate(Pose(weights, joints))
        assert isinstance(ours, Splats) and ours.sh_rotation is not None and theirs.sh_rotation is not None
        pairs = {
            "mean": (ours.mean, theirs.mean),
            "rotation": tuple(
                np.array([rotation_of(q) for q in quats])
                for quats in (ours.quat_wxyz.detach().numpy(), theirs.quat_wxyz)
            ),
            "seen": (ours.sh_rotation, theirs.sh_rotation),
            "others": (
                torch.cat([ours.scale.ravel(), ours.opacity, ours.sh.ravel()]),
                np.concatenate([theirs.scale.ravel(), theirs.opacity, theirs.sh.ravel()]),
            ),
        }
        for what, (mine, other) in pairs.items():
            values = mine.detach().numpy() if isinstance(mine, torch.Tensor) else mine
            worst[what] = max(worst[what], float(np.abs(values - other).max()))
    return worst


def test_what_is_read_plays_as_what_was_trained(system: PSAvatar, saved: Path, measured: Measure) -> None:
    worst = apart(system, exported(system, saved))
    for what, value in worst.items():
        measured(f"PSAvatar in memory against its export, {what}", value)
    assert worst["mean"] < 1e-6
    assert worst["rotation"] < 5e-6 and worst["seen"] < 5e-6 and worst["others"] < 1e-6


def test_the_files_are_the_same_bytes_each_time(system: PSAvatar, saved: Path, tmp_path: Path) -> None:
    system.save(tmp_path, 40)
    names = sorted(p.relative_to(saved) for p in saved.rglob("*") if p.is_file())
    assert [str(name) for name in names] == [
        "point_cloud/iteration_40/point_cloud.ply",
        "point_cloud/iteration_40/psavatar.npz",
        "rules.json",
    ]
    for name in names:
        assert (saved / name).read_bytes() == (tmp_path / name).read_bytes()
    document = json.loads((saved / "rules.json").read_text())
    assert document == {
        "system": "psavatar",
        "training_units_per_metre": system.training_per_bundle,
        "rules": dict(system.settings.rules),
    }


def test_an_enhancer_comes_along(capture: Capture, tmp_path: Path) -> None:
    system = scene.system_of(capture, enhancer=True, enhancing=0.2)
    scene.run(scene.trainer_of(system), 1, 12)
    system.save(tmp_path, 12)
    avatar = exported(system, tmp_path)
    assert avatar.enhancer is not None
    assert (avatar.enhancer.trained_width, avatar.enhancer.trained_height) == (sheet.SIZE, sheet.SIZE)
    assert avatar.enhancer.psnr_raw_db is not None and avatar.enhancer.psnr_enhanced_db is not None
    assert avatar.enhancer.measured_on == "1 frames held out, over black"
