"""Density control of SplattingAvatar: walking, splitting, pruning."""

from __future__ import annotations

import math

import numpy as np
import pytest
import torch

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.model import Capture
from avatar_trainer.parameters.densify import Plan
from tests.trainer.systems.splatting_avatar import scene
from tests.trainer.systems.splatting_avatar.scene import system_of

GENERATOR = 3


@pytest.mark.parametrize("rule", ["walking", "clamped", "released", "fixed"])
def test_split_copies_lie_where_they_were_drawn(capture: Capture, rule: str) -> None:
    system = system_of(capture, embedding=rule)
    scene.scatter(system, 2)
    system.table["log_scale"].data.sub_(2.0)
    frame = capture.frames[0]
    before = system.splats(frame.pose)
    old = {name: system.table[name].detach().clone() for name in system.table}
    prune = torch.zeros(150, dtype=torch.bool)
    prune[[4, 5]] = True
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
    if rule != "released":  # its copies keep the parent's displacement
        apart = (after.mean[parts] - before.mean[index[parts]]).norm(dim=1)
        generator = torch.Generator().manual_seed(GENERATOR)
        drawn = torch.randn(6, 3, generator=generator)
        assert torch.allclose(apart, (drawn * before.scale[index[parts]]).norm(dim=1), rtol=1e-3, atol=1e-6)
    for entry in system.table.state().values():
        assert (entry["exp_avg"][parts] == 0).all()


def test_a_plan_that_leaves_none_is_refused(capture: Capture) -> None:
    none = torch.zeros(0, dtype=torch.int64)
    with pytest.raises(AvatarError, match=r"no Gaussian is left: .*lower density\.min_opacity"):
        system_of(capture).lay_out(Plan(none, none, torch.ones(150, dtype=torch.bool)), torch.Generator())
