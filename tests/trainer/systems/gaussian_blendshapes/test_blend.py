"""Blending in Gaussian Blendshapes: init terms and learned differences against stage `blend`, with gradients."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from avatar_trainer.stages.blend import Deltas, blend
from avatar_trainer.systems.gaussian_blendshapes.blend import init_sum, with_init, with_learned
from avatar_trainer.systems.gaussian_blendshapes.rows import Entries, Rows
from avatar_trainer.tensors import Gaussians
from tests.measured import Measure
from tests.trainer.tensors import relative

N, EXPRESSIONS, COEFFICIENTS = 40, 6, 4
SHAPES = {"mean": (3,), "log_scale": (3,), "quat_wxyz": (4,), "opacity_logit": (), "sh": (COEFFICIENTS, 3)}
WEIGHTS = torch.tensor([0.7, 0.0, -1.2, 0.3, 1.0, 0.05])


def entries(seed: int) -> Entries:
    """A pattern of which some rows are empty."""
    used = torch.rand(N, EXPRESSIONS, generator=torch.Generator().manual_seed(seed)) < 0.4
    used[3] = False
    return Entries(torch.nn.functional.pad(used.sum(1).cumsum(0), (1, 0)), used.nonzero()[:, 1].contiguous())


def values(count: int, seed: int) -> dict[str, Tensor]:
    generator = torch.Generator().manual_seed(seed)
    return {name: torch.randn(count, *shape, generator=generator) for name, shape in SHAPES.items()}


def compared(one: Gaussians, other: Gaussians, leaves: Mapping[str, Tensor]) -> float:
    """The largest relative difference of values, and of gradients with respect to the leaves."""
    worst = max(relative(value, getattr(other, name)) for name, value in vars(one).items())
    weight = {
        name: torch.randn(value.shape, generator=torch.Generator().manual_seed(9))
        for name, value in vars(one).items()
    }
    slopes = []
    for found in (one, other):
        total = torch.stack([(value * weight[name]).sum() for name, value in vars(found).items()]).sum()
        slopes.append(torch.autograd.grad(total, list(leaves.values())))
    return max(worst, *(relative(a, b) for a, b in zip(*slopes, strict=True)))


def test_init_terms_are_blended(measured: Measure) -> None:
    pattern = entries(1)
    init = torch.randn(pattern.count, 7, generator=torch.Generator().manual_seed(2))
    nothing = torch.zeros(0)
    rows = Rows(torch.zeros(N, dtype=torch.int64), nothing, nothing, nothing, pattern, init, pattern, nothing)
    base = {name: value.requires_grad_() for name, value in values(N, 3).items()}
    zeros = {name: torch.zeros(pattern.count, *shape) for name, shape in SHAPES.items()}
    deltas = Deltas(
        pattern.row_ptr, pattern.column, **{**zeros, "mean": init[:, :3], "quat_wxyz": init[:, 3:]}
    )
    worst = compared(
        with_init(Gaussians(**base), rows, WEIGHTS), blend(Gaussians(**base), deltas, WEIGHTS), base
    )
    measured("init terms against stage blend, relative", worst)
    assert worst <= 1e-6
    assert not init_sum(rows, WEIGHTS)[3].any()  # a row without entries


def test_learned_differences_are_blended_under_their_mask(measured: Measure) -> None:
    pattern = entries(4)
    mask = torch.rand(pattern.count, generator=torch.Generator().manual_seed(5))
    leaves = {name: value.requires_grad_() for name, value in values(N, 6).items()}
    learned = {f"delta_{name}": value.requires_grad_() for name, value in values(pattern.count, 7).items()}
    plain = {name.removeprefix("delta_"): value for name, value in learned.items()}
    masked = {name: value * mask.reshape(-1, *[1] * (value.dim() - 1)) for name, value in plain.items()}
    base = Gaussians(**leaves)
    wanted = blend(base, Deltas(pattern.row_ptr, pattern.column, **masked), WEIGHTS)
    worst = compared(with_learned(base, pattern, plain, mask, WEIGHTS), wanted, {**leaves, **learned})
    measured("learned differences against stage blend, relative", worst)
    assert worst <= 1e-6
