"""Stages joints, morph and skin of a rig: the runtime's numbers, and gradients that agree with differences."""

from __future__ import annotations

import pytest
import torch
from torch.autograd import gradcheck

from avatar_runtime.avatar import Rig
from avatar_runtime.posed import posed_mesh
from avatar_runtime.stages import joints as runtime_joints
from avatar_runtime.stages import morph as runtime_morph
from avatar_trainer.stages.joints import joints
from avatar_trainer.stages.morph import morph
from avatar_trainer.stages.rig import RigTensors
from avatar_trainer.stages.skin import skin
from tests.avatars import full_avatar
from tests.measured import Measure
from tests.trainer.tensors import largest, leaves, poses, tensor

AVATAR = full_avatar()
POSES = poses(AVATAR)


@pytest.fixture
def rig() -> Rig:
    assert AVATAR.rig is not None
    return AVATAR.rig


@pytest.mark.parametrize("frame", range(len(POSES)))
def test_the_runtimes_numbers(rig: Rig, frame: int, measured: Measure) -> None:
    pose, own = POSES[frame], RigTensors.of(rig)
    expected = runtime_joints.joints(rig, pose)
    weights = tensor(pose.expression_weights)
    state = joints(own, weights, tensor(pose.joint_delta, torch.float64))
    worst = max(largest(value, getattr(expected, name)) for name, value in vars(state).items())
    measured("trainer joints: largest difference to the runtime", worst)
    assert worst <= 1e-7  # both are rounded from float64

    vertices = morph(own, weights, state.pose_feature)
    moved = largest(vertices, runtime_morph.morph(rig, pose.expression_weights, expected.pose_feature))
    posed = skin(own, vertices, state.skin_matrix, tensor(pose.late_weights))
    skinned = largest(posed, posed_mesh(rig, pose, expected))
    measured("trainer morph, skin: largest difference to the runtime, m", max(moved, skinned))
    assert max(moved, skinned) <= 1e-7


def test_the_rig_is_copied(rig: Rig) -> None:
    own = RigTensors.of(rig)
    own.vertices.zero_()
    own.morphs.values.zero_()
    assert rig.vertices.any() and rig.morphs.values["position"].any()


def test_gradients_agree_with_differences(rig: Rig) -> None:
    own, pose = RigTensors.of(rig, torch.float64), POSES[0]

    def posed(weights: torch.Tensor, delta: torch.Tensor, late: torch.Tensor) -> tuple[torch.Tensor, ...]:
        state = joints(own, weights, delta)
        vertices = morph(own, weights, state.pose_feature)
        return skin(own, vertices, state.skin_matrix, late), state.rest_position, state.position

    inputs = leaves(map(tensor, (pose.expression_weights, pose.joint_delta, pose.late_weights)))
    assert gradcheck(posed, inputs)
