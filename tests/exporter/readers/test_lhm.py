"""LHM: what is read against plain skinning by the nearest vertex, written out here."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.options import ReadOptions
from avatar_export.readers import table
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation
from tests.exporter.bodies import body_files
from tests.exporter.readers.lhm_files import COUNT, IDENTITY, Person
from tests.exporter.refusals import refused
from tests.oracles import lbs

Array = npt.NDArray[Any]

ROUNDING = 2.0**-23
METRES = 32 * ROUNDING  # twelve joints in a row, positions of about a metre


class Made(Person):
    """What a person that was written should look like."""

    def read(self) -> Avatar:
        return table.read(self.file, self.options, "lhm")

    def nearest(self) -> list[int]:
        return [int(np.argmin(np.linalg.norm(self.body["v_template"] - p, axis=1))) for p in self.points]

    def skinned(self, pose: Array, expression: Array) -> Array:
        """Means [N, 3] for rotation vectors [55, 3]: joints of the shape, weights and offsets of the nearest vertex."""
        shaped = self.body["v_template"] + self.dirs[:, :, :IDENTITY] @ self.betas
        joints = self.body["regressor"].astype(np.float64) @ shaped
        world: list[Array] = []
        for j, parent in enumerate(self.body["parents"]):
            local = np.eye(4)
            local[:3, :3] = lbs.rodrigues(pose[j])
            local[:3, 3] = joints[j] - (joints[parent] if parent >= 0 else 0)
            world.append(local if parent < 0 else world[parent] @ local)
        result = np.zeros((COUNT, 3))
        for n, row in enumerate(self.nearest()):
            point = self.mean[n] + self.dirs[row, :, IDENTITY:] @ expression
            for j, matrix in enumerate(world):
                weight = float(self.body["weights"][row, j])
                result[n] += weight * (matrix[:3, :3] @ (point - joints[j]) + matrix[:3, 3])
        return result


@pytest.fixture
def made(tmp_path: Path) -> Made:
    return Made(tmp_path)


def test_posed_means_are_those_of_plain_skinning(made: Made) -> None:
    avatar = made.read()
    assert avatar.rig is not None
    rng = np.random.default_rng(2)
    pose, expression = rng.normal(0, 0.3, (55, 3)), rng.normal(0, 1, IDENTITY)
    joints = {name: joint_rotation(v) for name, v in zip(avatar.rig.joint_names, pose, strict=True)}
    weights = dict(zip(avatar.expression_names, expression.tolist(), strict=True))
    splats = Player(avatar, "reference").animate(Pose(weights, joints))
    assert np.abs(splats.mean - made.skinned(pose, expression)).max() < METRES
    names = avatar.rig.joint_names
    assert (names[0], names[15], names[22], names[25], names[54]) == (
        "pelvis", "head", "jaw", "left_index1", "right_thumb3",
    )  # fmt: skip


def test_a_gaussian_of_one_joint_turns_with_it(made: Made) -> None:
    avatar = made.read()
    turn = np.array([0.4, -0.2, 0.3])
    splats = Player(avatar, "reference").animate(Pose(joints={"pelvis": joint_rotation(turn)}))
    row = next(n for n, vertex in enumerate(made.nearest()) if made.body["weights"][vertex].max() == 1)
    axes = _axes(splats.quat_wxyz[row])
    assert np.abs(axes - lbs.rodrigues(turn) @ _axes(made.quat[row])).max() < 64 * ROUNDING


def _axes(quat: Array) -> Array:
    """The rotation of a quaternion wxyz as a rotation vector's, by its axis and angle."""
    quat = quat.astype(np.float64) / np.linalg.norm(quat)
    size = np.linalg.norm(quat[1:])
    return lbs.rodrigues(2 * np.arctan2(size, quat[0]) * quat[1:] / size)


def test_without_sampled_points_it_is_doubtful(made: Made) -> None:
    for file in (made.models / "dense_sample_points").iterdir():
        file.unlink()
    notes = made.read().provenance["notes"]
    assert notes[0].startswith("unchecked: ")
    assert any(note.startswith("doubtful: ") and "dense_sample_points" in note for note in notes)


def test_bad_input_is_refused(made: Made, tmp_path: Path) -> None:
    refused("is not recognised as any of", table.read, made.file, made.options)  # by its option alone
    refused(r"lhm: .*needs --body-model SMPLX_NEUTRAL\.npz", table.read, made.file, ReadOptions(), "lhm")
    refused("no such folder", table.read, made.file, ReadOptions(dataset=tmp_path / "none"), "lhm")
    refused(r"is not a \.ply that LHM saved", table.read, made.models, made.options, "lhm")
    refused("--units cannot be used here", table.read, made.file, ReadOptions(units=2.0), "lhm")
    made.store(made.points[:-1])
    refused(rf"1_{COUNT}.ply: has {COUNT - 1} points", made.read)
    (tmp_path / "smpl").mkdir()
    refused("has 24 joints; SMPL-X has 55", Made(tmp_path / "smpl", body_files.SMPL_PARENTS).read)
