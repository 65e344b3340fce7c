"""Rotations as tensors: the runtime's numbers, and gradients that agree with differences."""

from __future__ import annotations

import numpy as np
import pytest
import torch
from torch.autograd import gradcheck

from avatar_runtime import rotation as runtime
from avatar_trainer.stages import rotation
from tests.measured import Measure
from tests.trainer.tensors import largest, normal

TURNS = ((0, 0, 0), (3.1, 0, 0), (0, -3.1, 0.02), (0.01, 0, 3.1), (0.3, -0.4, 1.2), (-1.7, 0.6, 0.2))


def matrices() -> torch.Tensor:
    return torch.from_numpy(runtime.matrix_from_rotvec(np.array(TURNS)))


@pytest.mark.parametrize("name", ["quat_from_matrix", "inverse_transpose", "polar"])
def test_matrices_give_the_runtimes_numbers(name: str, measured: Measure) -> None:
    sheared = matrices() + (0 if name == "quat_from_matrix" else 0.1 * normal(0, len(TURNS), 3, 3))
    given = sheared.float()
    difference = largest(getattr(rotation, name)(given), getattr(runtime, name)(given.numpy()))
    measured("trainer rotation: largest difference to the runtime", difference, 1e-6)
    assert difference <= 1e-6


def test_quaternions_give_the_runtimes_numbers(measured: Measure) -> None:
    a, b = normal(1, 20, 4, dtype=torch.float32), normal(2, 20, 4, dtype=torch.float32)
    product = largest(rotation.quat_multiply(a, b), runtime.quat_multiply(a.numpy(), b.numpy()))
    matrix = largest(rotation.matrix_from_quat(a), runtime.matrix_from_quat(a.numpy()))
    measured("trainer rotation: largest difference to the runtime", max(product, matrix))
    assert product <= 2e-6 and matrix <= 4e-6


def test_quat_of_a_matrix_turns_as_the_matrix_does() -> None:
    quat = rotation.quat_from_matrix(matrices())
    assert torch.allclose(rotation.matrix_from_quat(quat), matrices(), atol=1e-12)
    assert torch.all(quat.gather(1, quat.abs().argmax(1, keepdim=True)) > 0)


def test_gradients_agree_with_differences() -> None:
    m, a, b = matrices().requires_grad_(), normal(3, 5, 4).requires_grad_(), normal(4, 5, 4).requires_grad_()
    assert gradcheck(rotation.quat_from_matrix, (m,))
    assert gradcheck(rotation.polar, (m,))
    assert gradcheck(rotation.matrix_from_quat, (a,))
    assert gradcheck(rotation.quat_multiply, (a, b))
