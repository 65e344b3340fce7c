"""SplattingAvatar while it is trained: its start, its gradients, what follows a step, density control, its state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.model import Capture
from avatar_trainer.evaluation.evaluate import evaluate
from avatar_trainer.parameters.densify import DensitySettings
from avatar_trainer.systems.splatting_avatar.settings import PAPER_ITERATIONS, scheduled
from avatar_trainer.systems.splatting_avatar.system import Settings, create
from tests.trainer.systems.runs import expect_to_go_on, run, trainer_of
from tests.trainer.systems.splatting_avatar import scene
from tests.trainer.systems.splatting_avatar.scene import system_of

STEEP = 1.5e-3  # a gradient that half of the Gaussians reach


def test_opacities_are_reset_and_sh_degrees_rise_when_due(capture: Capture) -> None:
    density = DensitySettings(densify_from=10**6, densify_until=10**7, opacity_reset_every=3000)
    system = system_of(
        capture, sh_degree=2, sh_degree_every=500, iterations=PAPER_ITERATIONS, density=density
    )
    generator = torch.Generator()
    run(trainer_of(system), 1, 1)
    system.table["opacity_logit"].data.fill_(3.0)
    system.after_step(2999, generator)
    assert (system.table["opacity_logit"] == 3.0).all()
    assert system.sh_degree == 2
    system.after_step(3000, generator)
    assert torch.allclose(system.table["opacity_logit"].sigmoid(), torch.tensor(0.01))
    for moment in ("exp_avg", "exp_avg_sq"):
        assert not system.table.state()["opacity_logit"][moment].any()
        assert system.table.state()["sh_dc"][moment].any()
    system.after_step(999, generator)
    assert system.sh_degree == 1


def test_the_schedule_shrinks_with_the_run() -> None:
    paper = scheduled(Settings(iterations=PAPER_ITERATIONS))
    assert (paper.densify_from, paper.densify_until, paper.opacity_reset_every) == (600, 15_000, 3000)
    short = scheduled(Settings(iterations=3000))
    assert (short.densify_from, short.densify_until, short.densify_every) == (60, 1500, 100)
    assert short.opacity_reset_every == 1000  # never closer
    for wrong in ({"subject": "cat"}, {"sampling": "even"}):
        with pytest.raises(ValueError, match=next(iter(wrong))):
            Settings(**wrong)


def test_it_learns_the_images(capture: Capture) -> None:
    density = DensitySettings(densify_from=600, densify_every=20, gradient_threshold=1e-4)
    system = system_of(capture, iterations=120, density=density)
    before, trainer = evaluate(system, capture)["splits"]["train"]["psnr_db"], trainer_of(system, 120)
    run(trainer, 1, 120)
    after = evaluate(system, capture)["splits"]["train"]["psnr_db"]
    assert after > before + 6 and after > 24
    assert system.crossings > 0
    assert len(system.density.seen) > 150


@pytest.mark.parametrize("rule", ["walking", "fixed"])
def test_it_goes_on_bit_by_bit(capture: Capture, rule: str) -> None:
    density = DensitySettings(densify_from=0, densify_every=4, gradient_threshold=STEEP)
    ended = expect_to_go_on(
        lambda: system_of(capture, embedding=rule, density=density, iterations=30), stop=10, last=13
    )
    assert len(ended.state()["density"]["seen"]) != 150


def test_captures_that_it_cannot_train_on_are_refused(capture: Capture) -> None:
    tests = tuple(replace(frame, split="test") for frame in capture.frames)
    with pytest.raises(AvatarError, match="no training frame"):
        create(replace(capture, frames=tests), scene.settings(), 0)
    pose = replace(capture.frames[0].pose, late_weights=np.ones(1, np.float32))
    lids = replace(
        capture, frames=(replace(capture.frames[0], pose=pose), *capture.frames[1:]), eyelids=("left",)
    )
    with pytest.raises(AvatarError, match="eyelid"):
        create(lids, scene.settings(), 0)
