"""Density control: the rules of Kerbl et al. 2023 section 5.2, one Gaussian at a time in plain Python."""

from __future__ import annotations

import pytest
import torch

from avatar_trainer.parameters.densify import Density, DensitySettings, Plan

SETTINGS = DensitySettings(max_screen_radius=20)
EXTENT = 2.0
# gradient, scale, opacity, radius -> what becomes of it, with and without a judgement of sizes
CASES = [
    ((1e-4, 0.01, 0.9, 3), "keep", "keep"),
    ((3e-4, 0.01, 0.9, 3), "clone", "clone"),
    ((3e-4, 0.0201, 0.9, 3), "split", "split"),
    ((3e-4, 0.0199, 0.9, 3), "clone", "clone"),
    ((0.0, 0.05, 0.9, 3), "keep", "keep"),
    ((3e-4, 0.01, 0.004, 3), "prune", "prune"),
    ((3e-4, 0.05, 0.004, 3), "prune", "prune"),
    ((0.0, 0.01, 0.006, 3), "keep", "keep"),
    ((0.0, 0.01, 0.9, 21), "keep", "prune"),
    ((3e-4, 0.01, 0.9, 21), "clone", "prune"),
    ((3e-4, 0.05, 0.9, 21), "split", "split"),
    ((0.0, 0.21, 0.9, 3), "keep", "prune"),
    ((3e-4, 0.21, 0.9, 3), "split", "split"),  # its copies are small enough
    ((3e-4, 0.33, 0.9, 3), "split", "prune"),  # its copies are not
]


def observed(cases: list[tuple[float, float, float, int]]) -> tuple[Density, torch.Tensor, torch.Tensor]:
    gradient, scale, opacity, radius = (torch.tensor(column) for column in zip(*cases, strict=True))
    density = Density(len(cases))
    turned = torch.stack([gradient * 0.6, gradient * 0.8], dim=1)
    density.observe(radius, turned)
    log_scale = torch.stack([scale.log(), scale.log() - 1, scale.log() - 3], dim=1)
    return density, log_scale, torch.logit(opacity)


def fates(plan: Plan) -> list[str]:
    fate = ["prune" if gone else "keep" for gone in plan.prune.tolist()]
    for name, index in (("clone", plan.clone), ("split", plan.split)):
        for i in index.tolist():
            assert fate[i] == "keep"
            fate[i] = name
    return fate


@pytest.mark.parametrize("judge_size", [False, True])
def test_each_gaussian_meets_its_rule(judge_size: bool) -> None:
    density, log_scale, opacity = observed([case for case, *_ in CASES])
    plan = density.plan(SETTINGS, log_scale, opacity, EXTENT, judge_size=judge_size)
    assert fates(plan) == [case[1 + judge_size] for case in CASES]


def test_gradients_are_the_mean_over_the_images_that_show_it() -> None:
    density = Density(3)
    gradients = [[(3e-4, 4e-4), (5e-4, 0.0)], [(0.0, 1e-4), (0.0, 0.0)], [(9.0, 9.0), (0.0, 1e-3)]]
    radii = [[2, 7], [1, 1], [0, 5]]
    for t in (0, 1):
        density.observe(
            torch.tensor([r[t] for r in radii], dtype=torch.int32), torch.tensor([g[t] for g in gradients])
        )
    log_scale, opacity = torch.full((3, 3), -9.0), torch.zeros(3)
    for threshold, expected in [(4.9e-5, [0, 1, 2]), (5.1e-5, [0, 2]), (5.1e-4, [2]), (1.01e-3, [])]:
        settings = DensitySettings(gradient_threshold=threshold)
        assert density.plan(settings, log_scale, opacity, EXTENT).clone.tolist() == expected
    assert density.seen.tolist() == [2, 2, 1] and density.largest_radius.tolist() == [7, 1, 5]


def test_the_bound_lets_the_steepest_grow() -> None:
    cases = [(g * 1e-3, 0.01 if i % 2 else 0.05, 0.9, 3) for i, g in enumerate([5, 9, 1, 7, 9, 3])]
    cases.append((1.0, 0.01, 0.001, 3))  # goes, and makes room
    density, log_scale, opacity = observed(cases)
    for most, expected in [(2, []), (7, [1]), (8, [1, 4]), (9, [1, 3, 4]), (100, [0, 1, 2, 3, 4, 5])]:
        plan = density.plan(DensitySettings(max_gaussians=most), log_scale, opacity, EXTENT)
        assert sorted([*plan.clone.tolist(), *plan.split.tolist()]) == expected
        index, _ = plan.rows()
        assert len(index) == 6 + len(expected)
        assert plan.prune.tolist() == [False] * 6 + [True]
