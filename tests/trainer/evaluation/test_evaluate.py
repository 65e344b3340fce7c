"""Targets, evaluation and what identifies a run, on the toy system."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
import torch
from PIL import Image

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.targets import Target, Targets
from avatar_trainer.evaluation.evaluate import evaluate, quick_psnr_db, score, table
from avatar_trainer.losses import ssim_definition
from avatar_trainer.systems.drawing import Drawing, draw
from avatar_trainer.tensors import Rendered
from tests.trainer import toy


def test_evaluation_by_hand(toy_capture: Capture) -> None:
    system = toy.create(toy_capture, toy.Settings(), 1)
    system.table.set("sh", system.table["sh"].detach() * 6)  # brighter than an image can be
    assert draw(system, toy_capture.test[0]).colour.max() > 1.05
    result = evaluate(system, toy_capture, Drawing(threads=1))
    json.dumps(result, allow_nan=False)
    frame = toy_capture.test[0]
    entry = next(e for e in result["frames"] if e["frame"] == frame.name)
    with Image.open(frame.image) as image, Image.open(frame.mask) as mask:
        matte = np.asarray(mask, np.float64)[:, :, None] / 255
        wanted = np.asarray(image, np.float64) / 255 * matte
    off = (np.clip(draw(system, frame).colour.numpy(), 0, 1) - wanted) ** 2
    assert entry["split"] == "test"
    assert entry["psnr_db"] == pytest.approx(-10 * np.log10(off.mean()), abs=1e-4)
    assert entry["psnr_inside_db"] == pytest.approx(
        -10 * np.log10(off[matte[:, :, 0] > 0.5].mean()), abs=1e-4
    )
    assert 0 < entry["ssim"] < 1 and 0 < entry["ssim_inside"] < 1
    tests = [e["psnr_db"] for e in result["frames"] if e["split"] == "test"]
    assert result["splits"]["test"]["psnr_db"] == pytest.approx(np.mean(tests))
    assert len(tests) == result["splits"]["test"]["frames"] == 3


def test_what_is_black_in_both_is_alike(toy_capture: Capture) -> None:
    wanted, drawn = torch.zeros(2, 40, 50, 3)
    wanted[12:20, 15:22], drawn[14:23, 0:20] = 0.7, 0.4
    target = Target(wanted, (wanted[:, :, 0] > 0).float())
    found = score(drawn, toy_capture.test[0], target).ssim
    assert found == pytest.approx(float(ssim_definition(drawn.double(), wanted.double())), abs=1e-12)
    assert score(0 * drawn, toy_capture.test[0], Target(0 * wanted, target.mask)).ssim == 1


def draws(monkeypatch: pytest.MonkeyPatch, colour: torch.Tensor) -> None:
    """Every rendering that is evaluated becomes `colour`."""
    drawn = Rendered(colour, torch.ones(colour.shape[:2]), torch.ones(1, dtype=torch.int32))
    monkeypatch.setattr("avatar_trainer.evaluation.evaluate.draw", lambda *_, **__: drawn)


def test_a_perfect_image_has_no_finite_psnr_and_its_mean_says_so(
    toy_capture: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Targets(1) as targets:
        draws(monkeypatch, targets(toy_capture.test[0]).over(torch.zeros(3)))
    system = toy.create(toy_capture, toy.Settings(), 1)
    means = evaluate(system, dataclasses.replace(toy_capture, frames=toy_capture.test[:1]))["splits"]["test"]
    assert means["psnr_db"] is None and means["over"]["psnr_db"] == 0
    assert means["ssim"] == pytest.approx(1) and means["ssim_inside"] == pytest.approx(1)
    result = evaluate(system, dataclasses.replace(toy_capture, frames=toy_capture.test))
    means, frames = result["splits"]["test"], result["frames"]
    assert means["frames"] == means["over"]["ssim"] == 3 and means["over"]["psnr_db"] == 2
    assert frames[0]["psnr_db"] is None
    assert means["psnr_db"] == pytest.approx((frames[1]["psnr_db"] + frames[2]["psnr_db"]) / 2)
    assert next(iter(table(result).columns[2].cells)) == f"{means['psnr_db']:.2f} (of 2)"


@pytest.mark.parametrize("wrong", [float("nan"), float("inf")])
def test_a_rendering_that_is_not_finite_is_named(
    toy_capture: Capture, monkeypatch: pytest.MonkeyPatch, wrong: float
) -> None:
    colour = torch.zeros(toy.SIZE, toy.SIZE, 3)
    colour[7, 5, 1] = wrong
    draws(monkeypatch, colour)
    system = toy.create(toy_capture, toy.Settings(), 1)
    named = f"frame {toy_capture.test[0].name}: .*not finite"
    with pytest.raises(AvatarError, match=named):
        evaluate(system, toy_capture)
    with Targets(1) as targets, pytest.raises(AvatarError, match=named):
        quick_psnr_db(system, toy_capture, targets, Drawing(threads=1))
