"""Density control of SplattingAvatar: walking, splitting, pruning."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import torch

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.model import Capture
from avatar_trainer.parameters.densify import DensitySettings, Plan
from avatar_trainer.systems.splatting_avatar.settings import PAPER_ITERATIONS
from tests.trainer.systems.splatting_avatar import scene
from tests.trainer.systems.splatting_avatar.scene import step, system_of

Array = npt.NDArray[Any]
GENERATOR = 3
STEEP = 1.5e-3  # a gradient that half of the Gaussians reach


def test_crossing_forgets_the_moments_of_the_embedding_alone(capture: Capture) -> None:
    system = system_of(capture)
    generator = torch.Generator().manual_seed(GENERATOR)
    step(system, 1, generator)
    before = {name: entry["exp_avg_sq"].clone() for name, entry in system.table.state().items()}
    triangle = system.embedding.triangle.clone()
    with torch.no_grad():
        system.table["shift_uv"][:10] = 0.5  # far: over several edges
    system.crossings += system.embedding.after_step(system.table)
    after = {name: entry["exp_avg_sq"] for name, entry in system.table.state().items()}
    crossed = system.embedding.triangle != triangle
    assert crossed[:10].any()
    assert not crossed[10:].any()
    assert system.crossings >= 10
    for name in before:
        kept = after[name] == before[name]
        if name in ("shift_uv", "displacement"):
            assert (after[name][crossed] == 0).all()
            assert kept[~crossed].all()
        else:
            assert kept.all()
    assert (system.table["shift_uv"] == 0).all()


def test_clamped_stays_in_its_triangle(capture: Capture) -> None:
    system = system_of(capture, embedding="clamped")
    triangle = system.embedding.triangle.clone()
    with torch.no_grad():
        system.table["shift_uv"].normal_()
    assert system.embedding.after_step(system.table) == 0
    assert torch.equal(system.embedding.triangle, triangle)
    assert system.embedding.barycentric.min() > -1e-6
    assert torch.allclose(system.embedding.barycentric.sum(1), torch.ones(150))


@pytest.mark.parametrize("rule", ["walking", "clamped", "released", "fixed"])
def test_split_copies_lie_where_they_were_drawn(capture: Capture, rule: str) -> None:
    """Rows follow their Gaussians; a split Gaussian's copies are near it, and smaller."""
    system = system_of(capture, embedding=rule)
    scene.scatter(system, 2)
    system.table["log_scale"].data.sub_(2.0)
    frame = capture.frames[0]
    before = system.splats(frame.pose)
    old = {name: system.table[name].detach().clone() for name in system.table}
    prune = torch.zeros(150, dtype=torch.bool)
    prune[[4, 5]] = True
    for statistic in system.density.state().values():
        statistic += 1
    plan = Plan(clone=torch.tensor([7, 9]), split=torch.tensor([20, 30, 40]), prune=prune)
    system.lay_out(plan, torch.Generator().manual_seed(GENERATOR))
    after = system.splats(frame.pose)
    stays = np.setdiff1d(np.arange(150), [4, 5, 20, 30, 40])
    index = np.concatenate([stays, [7, 9], [20, 30, 40] * 2])
    assert len(after.mean) == len(index) == len(system.density.seen)
    whole = slice(0, len(stays) + 2)
    for name in ("mean", "scale", "quat_wxyz", "opacity", "sh"):
        assert torch.equal(getattr(after, name)[whole], getattr(before, name)[index[whole]])
    parts = slice(len(stays) + 2, None)
    for name in ("rotation", "opacity_logit", "sh_dc"):
        assert torch.equal(system.table[name][parts], old[name][index[parts]])
    assert torch.allclose(system.table["log_scale"][parts], old["log_scale"][index[parts]] - math.log(1.6))
    largest = before.scale[index[parts]].amax(1)
    apart = (after.mean[parts] - before.mean[index[parts]]).norm(dim=1)
    assert (apart > 0).all()
    if rule != "released":  # its copies keep the parent's displacement
        assert (apart < 4 * largest).all()
        generator = torch.Generator().manual_seed(GENERATOR)
        drawn = torch.randn(6, 3, generator=generator)
        assert torch.allclose(apart, (drawn * before.scale[index[parts]]).norm(dim=1), rtol=1e-3, atol=1e-6)
    for entry in system.table.state().values():
        assert (entry["exp_avg"][parts] == 0).all()
    for statistic in system.density.state().values():
        assert len(statistic) == len(index) and not statistic.any()


def test_large_gaussians_go_after_the_first_opacity_reset(capture: Capture) -> None:
    density = DensitySettings(densify_from=0, densify_every=500, opacity_reset_every=1000)
    density = replace(density, gradient_threshold=1e9, max_screen_radius=6)
    system = system_of(capture, iterations=PAPER_ITERATIONS, density=density)
    with torch.no_grad():
        system.table["log_scale"][:] = math.log(0.099 * system.extent)
        system.table["log_scale"][3, 0] = math.log(0.101 * system.extent)
    left = []
    for iteration in (500, 1500):
        system.density.largest_radius[:] = 6
        system.density.largest_radius[9] = 7
        system.after_step(iteration, torch.Generator())
        left.append(len(system.density.seen))
    assert left == [150, 148]
    largest = float(system.table["log_scale"].detach().exp().max())
    assert largest == pytest.approx(0.099 * system.extent)


def test_a_plan_that_leaves_none_is_refused(capture: Capture) -> None:
    none = torch.zeros(0, dtype=torch.int64)
    with pytest.raises(AvatarError, match=r"no Gaussian is left: .*lower density\.min_opacity"):
        system_of(capture).lay_out(Plan(none, none, torch.ones(150, dtype=torch.bool)), torch.Generator())
