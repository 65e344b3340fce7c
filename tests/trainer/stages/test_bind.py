"""Stages bind and activate: the runtime's numbers, and gradients that agree with differences."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor
from torch.autograd import gradcheck

from avatar_runtime.posed import Posed, Poser
from avatar_runtime.stages.activate import activate as runtime_activate
from avatar_runtime.stages.bind import bind as runtime_bind
from avatar_runtime.stages.sparse import combine
from avatar_trainer.stages.activate import activate
from avatar_trainer.stages.bind import bind_skin, place, skin_matrices
from avatar_trainer.stages.rotation import polar
from avatar_trainer.tensors import Gaussians
from tests.avatars import full_avatar
from tests.measured import Measure
from tests.trainer.tensors import dense, gaussians, largest, leaves, normal, poses, tensor

AVATAR = full_avatar()
POSES = poses(AVATAR)


def embedded(posed: Posed) -> tuple[Tensor, Tensor]:
    """Matrix [N, 3, 4] and rotation [N, 3, 3] of every Gaussian of AVATAR, by its group."""
    by_skin = skin_matrices(tensor(dense(AVATAR.skin, "weight")), tensor(posed.skin_matrix))
    matrix, rotation = by_skin.clone(), polar(by_skin[:, :, :3])
    for index, group in enumerate(AVATAR.groups):
        if group.binding != "skin":
            rows = slice(group.first, group.first + group.count)
            matrix[rows] = tensor(posed.groups.matrix[index])
            rotation[rows] = tensor(posed.groups.rotation[index])
    return matrix, rotation


@pytest.mark.parametrize("frame", range(len(POSES)))
def test_the_runtimes_numbers(frame: int, measured: Measure) -> None:
    posed, shapes = Poser(AVATAR).posed(POSES[frame]), AVATAR.blendshapes
    expected = runtime_bind(
        AVATAR,
        AVATAR.gaussians,
        posed.skin_matrix,
        posed.pose_feature,
        posed.late_weights,
        posed.groups,
        posed.world_from_avatar,
    )
    corrective = tensor(combine(shapes.correctives, posed.pose_feature)["mean"])
    late = tensor(combine(shapes.late_morphs, posed.late_weights)["mean"])
    bound, rotation = bind_skin(gaussians(AVATAR.gaussians), *embedded(posed), corrective, late)
    bound, rotation = place(bound, rotation, torch.from_numpy(posed.world_from_avatar))
    moved = largest(bound.mean, expected.gaussians.mean)
    turned = max(largest(bound.quat_wxyz, expected.gaussians.quat_wxyz), largest(rotation, expected.rotation))
    measured("trainer bind: largest difference to the runtime, m", moved)
    measured("trainer bind: largest difference of rotations to the runtime", turned)
    assert moved <= 2e-7 and turned <= 4e-6

    splats, wanted = activate(bound, rotation), runtime_activate(expected)
    worst = max(largest(value, getattr(wanted, name)) for name, value in vars(splats).items())
    measured("trainer activate: largest difference to the runtime", worst, 4e-6)
    assert worst <= 4e-6


def test_one_matrix_for_all_is_that_matrix_for_each() -> None:
    base, matrix = gaussians(AVATAR.gaussians), tensor(np.eye(4)[:3]) + 0.1 * normal(0, 3, 4).float()
    rotation = polar(matrix[:, :3])
    one, frame = bind_skin(base, matrix, rotation)
    n = len(base.mean)
    each, frames = bind_skin(base, matrix.expand(n, 3, 4), rotation.expand(n, 3, 3))
    assert torch.equal(one.mean, each.mean) and torch.equal(one.quat_wxyz, each.quat_wxyz)
    assert torch.equal(frame, frames)


def test_the_identity_changes_no_bit() -> None:
    base, rotation = gaussians(AVATAR.gaussians), normal(0, 48, 3, 3)
    placed, frame = place(base, rotation, torch.eye(4, dtype=torch.float64))
    assert placed is base and frame is rotation


def test_gradients_agree_with_differences() -> None:
    base, n = gaussians(AVATAR.gaussians, torch.float64), 6
    matrix = torch.eye(3, 4, dtype=torch.float64) + 0.2 * normal(0, n, 3, 4)
    world = torch.eye(4, dtype=torch.float64)
    world[:3] = torch.from_numpy(POSES[1].world_from_avatar[:3])

    def splats(matrix: Tensor, corrective: Tensor, late: Tensor, *values: Tensor) -> tuple[Tensor, ...]:
        bound, rotation = bind_skin(Gaussians(*values), matrix, polar(matrix[..., :3]), corrective, late)
        placed, frame = place(bound, rotation, world)
        s = activate(placed, frame)
        assert s.sh_rotation is not None and not s.sh_rotation.requires_grad
        return s.mean, s.scale, s.quat_wxyz, s.opacity, s.sh

    values = [value[:n] for value in vars(base).values()]
    inputs = leaves([matrix, normal(1, n, 3), normal(2, n, 3), *values])
    assert gradcheck(splats, inputs)


def test_skin_matrices_differentiate() -> None:
    assert gradcheck(skin_matrices, leaves([normal(0, 4, 5), normal(1, 5, 4, 4)]))


def test_a_quaternion_of_no_length_stays_finite() -> None:
    base = gaussians(AVATAR.gaussians)
    (quat,) = leaves([torch.zeros_like(base.quat_wxyz)], torch.float32)
    splats = activate(replace(base, quat_wxyz=quat), None)
    splats.quat_wxyz.sum().backward()
    assert not splats.quat_wxyz.any() and quat.grad is not None and torch.isfinite(quat.grad).all()
