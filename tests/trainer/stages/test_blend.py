"""Stage blend: the runtime's numbers, and gradients that agree with differences."""

from __future__ import annotations

from dataclasses import replace

import pytest
import torch
from torch import Tensor
from torch.autograd import gradcheck

from avatar_runtime.stages.blend import blend as runtime_blend
from avatar_trainer.stages.blend import Deltas, blend
from avatar_trainer.tensors import Gaussians
from tests.avatars import full_avatar
from tests.measured import Measure
from tests.trainer.tensors import ATTRIBUTES, deltas, gaussians, largest, leaves, normal, poses, tensor

AVATAR = full_avatar()
POSES = poses(AVATAR)


@pytest.mark.parametrize("frame", range(len(POSES)))
def test_the_runtimes_numbers(frame: int, measured: Measure) -> None:
    weights = POSES[frame].expression_weights
    expected = runtime_blend(AVATAR.gaussians, AVATAR.blendshapes, weights)
    blended = blend(gaussians(AVATAR.gaussians), deltas(AVATAR.blendshapes), tensor(weights))
    worst = max(largest(getattr(blended, name), getattr(expected, name)) for name in ATTRIBUTES)
    measured("trainer blend: largest difference to the runtime", worst, 1e-6)
    assert worst <= 1e-6


def test_gradients_agree_with_differences() -> None:
    ptr, column = torch.tensor([0, 2, 2, 5]), torch.tensor([0, 3, 0, 1, 2])
    shapes = ((3,), (3,), (4,), (), (4, 3))
    base = [normal(at, 3, *shape) for at, shape in enumerate(shapes)]
    delta = [normal(9 + at, 5, *shape) for at, shape in enumerate(shapes)]
    weights = torch.tensor([0.3, 0.0, -0.7, 1.1], dtype=torch.float64)

    def blended(weights: Tensor, *values: Tensor) -> tuple[Tensor, ...]:
        base = Gaussians(**dict(zip(ATTRIBUTES, values[:5], strict=True)))
        delta = Deltas(ptr, column, **dict(zip(ATTRIBUTES, values[5:], strict=True)))
        return tuple(vars(blend(base, delta, weights)).values())

    assert gradcheck(blended, leaves([weights, *base, *delta]))


def test_rows_without_entries_stay_what_they_are() -> None:
    base, delta = gaussians(AVATAR.gaussians), deltas(AVATAR.blendshapes)
    none = torch.zeros(0, dtype=torch.int64)
    empty = replace(
        delta,
        row_ptr=torch.zeros_like(delta.row_ptr),
        column=none,
        **{name: getattr(delta, name)[none] for name in ATTRIBUTES},
    )
    blended = blend(base, empty, torch.ones(4))
    assert all(torch.equal(getattr(blended, name), getattr(base, name)) for name in ATTRIBUTES)
