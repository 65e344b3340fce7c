"""What SplattingAvatar saves, read by the exporter and played by the runtime: the same splats and image."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from avatar_export.options import ReadOptions
from avatar_export.readers.splatting_avatar import reader
from avatar_runtime.avatar import Avatar
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, PoseArrays
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_trainer.captures.model import Capture
from avatar_trainer.evaluation.compare import FLIP
from avatar_trainer.systems.drawing import draw
from avatar_trainer.systems.splatting_avatar.system import SplattingAvatar, create
from tests.measured import Measure
from tests.trainer.systems.splatting_avatar import scene

ITERATION = 42
PAPER = {"position": "interpolated_normal", "rotation": "vertex_quaternion_mean", "scale": "linear_area"}
RULES = {
    "released head": {},
    "body": {"scale": "none"},
    "paper": PAPER,
    "released embedding": {"embedding": "released", "sh_direction": "world"},
}
TURNED = homogeneous(matrix_from_rotvec(np.array([0.1, 0.4, -0.2])), np.array([0.02, -0.01, 0.03]))


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return scene.blank(tmp_path_factory.mktemp("sheet") / "blank", world_from_avatar=TURNED)


def trained(capture: Capture, **values: Any) -> SplattingAvatar:
    """A system with a value of its own in every number."""
    system = create(capture, scene.settings(**values), 0)
    scene.scatter(system, 5)
    return system


def read_back(system: SplattingAvatar, folder: Path) -> Avatar:
    system.save(folder, ITERATION)
    given = system.capture.export_inputs
    options = ReadOptions(body_model=given["body_model"], shape=given["shape"])
    return check_avatar(reader.read(folder, options))


@pytest.mark.parametrize("rules", RULES.values(), ids=RULES)
@pytest.mark.parametrize("degree", [0, 2])
def test_the_runtime_plays_what_was_trained(
    capture: Capture, rules: dict[str, str], degree: int, tmp_path: Path, measured: Measure
) -> None:
    system = trained(capture, sh_degree=degree, **rules)
    system.sh_degree = degree
    avatar = read_back(system, tmp_path)
    assert avatar.rules == system.rules
    assert avatar.training_per_bundle == 4.0
    assert avatar.sh_degree == degree
    reference, fast = Player(avatar, "reference"), Player(avatar, "cpu")
    for frame in capture.frames:
        pose = named(avatar, frame.pose)
        splats, played = system.splats(frame.pose), reference.animate(pose)
        for name in ("mean", "scale", "quat_wxyz", "opacity", "sh"):
            apart = np.abs(getattr(splats, name).detach().numpy() - getattr(played, name)).max()
            measured(f"SplattingAvatar {name}, trainer against runtime", float(apart))
            assert apart < 1e-6
        theirs = fast.frame(pose, frame.camera, (0.0, 0.0, 0.0), "trainer").image
        apart = np.abs(draw(system, frame).colour.numpy() - theirs.colour).max(axis=-1)
        flipped = apart >= FLIP  # rounding decided whether a splat's alpha reaches 1/255 there
        measured("SplattingAvatar image, trainer against cpu, except for flips", float(apart[~flipped].max()))
        assert flipped.sum() <= 2 and apart.max() <= np.ptp(theirs.colour) / 255


def named(avatar: Avatar, pose: PoseArrays) -> Pose:
    """A capture's pose by names; the avatar has all its expressions and joints, in its order."""
    assert avatar.rig is not None
    return Pose(
        dict(zip(avatar.expression_names, pose.expression_weights.tolist(), strict=True)),
        dict(zip(avatar.rig.joint_names, pose.joint_delta, strict=True)),
        {},
        pose.world_from_avatar,
    )


def test_the_files_are_those_of_the_released_code(capture: Capture, tmp_path: Path) -> None:
    system = trained(capture, **PAPER)
    system.save(tmp_path, ITERATION)
    folder = tmp_path / "point_cloud" / f"iteration_{ITERATION}"
    cloud = ply.gaussians(ply.decode((folder / "point_cloud.ply").read_bytes()))
    stored = json.loads((folder / "embedding.json").read_text())
    assert (cloud.quat_wxyz[:, 0] >= 0).all()
    np.testing.assert_allclose(np.linalg.norm(cloud.quat_wxyz, axis=1), 1, atol=1e-6)
    raw = np.array(stored["_rotation"])
    assert (raw[:, 0] < 0).any()
    assert (np.abs(np.linalg.norm(raw, axis=1) - 1) > 0.1).any()
    assert all(u == v == 0 for u, v, _ in stored["_xyz"])
    config = yaml.safe_load((tmp_path / "config.yaml").read_text())
    assert config["model"] == {
        "sh_degree": 0, "num_init_samples": 150, "xyz_as_uvd": True, "with_mesh_scaling": True
    }  # fmt: skip
    rules = json.loads((tmp_path / "rules.json").read_text())
    assert (rules["system"], rules["training_units_per_metre"]) == ("splatting_avatar", 4.0)
    assert rules["rules"] == {"embedding": "walking", "sh_direction": "inverse_rotation", **PAPER}


def test_a_shift_in_space_is_not_written(capture: Capture, tmp_path: Path) -> None:
    system = trained(capture, embedding="fixed")
    assert float(system.splats(capture.frames[1].pose).mean.detach().abs().max()) > 0
    with pytest.raises(AvatarError, match="embedding fixed"):
        system.save(tmp_path, ITERATION)
    assert not list(tmp_path.iterdir())


def test_a_body_is_trained_in_metres_without_mesh_scaling(capture: Capture, tmp_path: Path) -> None:
    system = trained(capture, subject="body")
    assert (system.training_per_bundle, system.rules.scale) == (1.0, "none")
    system.save(tmp_path, ITERATION)
    avatar = reader.read(tmp_path, reader.WITHOUT_RIG)
    assert avatar.training_per_bundle == 1.0
    config = yaml.safe_load((tmp_path / "config.yaml").read_text())
    assert config["dataset"]["frameset_type"] == "instant_avatar"
    assert config["model"]["with_mesh_scaling"] is False
