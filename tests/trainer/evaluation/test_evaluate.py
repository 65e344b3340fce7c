"""Targets, evaluation and what identifies a run, on the toy system."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
import torch
from PIL import Image

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.targets import Targets, evenly, resized
from avatar_trainer.evaluation.evaluate import evaluate, quick_psnr_db, table
from avatar_trainer.loop import run
from avatar_trainer.parameters.densify import DensitySettings
from avatar_trainer.systems.drawing import Drawing, draw
from avatar_trainer.tensors import Rendered
from tests.trainer import toy


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return load(toy.capture_folder(tmp_path_factory.mktemp("capture") / "toy"))


def test_images_are_those_of_the_files(capture: Capture) -> None:
    with Targets(10) as targets, Targets(0) as uncached:
        targets.expect(capture.frames)
        for frame in [*capture.frames, *capture.frames]:
            target = targets(frame)
            with Image.open(frame.image) as image, Image.open(frame.mask) as mask:
                expected = np.asarray(image, np.float32) / 255, np.asarray(mask, np.float32) / 255
            assert np.array_equal(target.image.numpy(), expected[0])
            assert np.array_equal(target.mask.numpy(), expected[1])
            assert torch.equal(uncached(frame).image, target.image)
            over = target.over(torch.tensor([0.2, 0.4, 1.0])).numpy()
            matte = expected[1][:, :, None]
            assert np.allclose(over, expected[0] * matte + (1 - matte) * [0.2, 0.4, 1.0], atol=1e-6)


def test_smaller_images_are_averages_and_cameras_keep_their_view(capture: Capture) -> None:
    half = resized(capture, 20)
    assert (half.width, half.height) == (20, 20)
    assert resized(capture, 0) is capture and resized(capture, 100) is capture
    frame = half.frames[2]
    with Targets(1) as targets:
        small, whole = targets(frame), targets(dataclasses.replace(capture.frames[2], name="whole"))
    over = [target.over(torch.zeros(3)) for target in (small, whole)]
    mean = over[1].reshape(20, 2, 20, 2, 3).mean((1, 3))
    assert (over[0] - mean).abs().max() < 1.5 / 255  # what rounding image and mask to bytes makes
    system = toy.create(capture, toy.Settings(), 1)
    drawn = [draw(system, f).colour for f in (frame, capture.frames[2])]
    assert (drawn[0] - drawn[1].reshape(20, 2, 20, 2, 3).mean((1, 3))).abs().mean() < 0.02


def test_evenly() -> None:
    assert evenly(range(7), 3) == [0, 3, 6]
    assert evenly(range(2), 3) == [0, 1]


def test_evaluation_by_hand(capture: Capture) -> None:
    system = toy.create(capture, toy.Settings(), 1)
    system.table.set("sh", system.table["sh"].detach() * 6)  # brighter than an image can be
    assert draw(system, capture.test[0]).colour.max() > 1.05
    result = evaluate(system, capture, Drawing(threads=1))
    json.dumps(result, allow_nan=False)
    frame = capture.test[0]
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


def draws(monkeypatch: pytest.MonkeyPatch, colour: torch.Tensor) -> None:
    """Every rendering that is evaluated becomes `colour`."""
    drawn = Rendered(colour, torch.ones(colour.shape[:2]), torch.ones(1, dtype=torch.int32))
    monkeypatch.setattr("avatar_trainer.evaluation.evaluate.draw", lambda *_, **__: drawn)


def test_a_perfect_image_has_no_finite_psnr_and_its_mean_says_so(
    capture: Capture, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Targets(1) as targets:
        draws(monkeypatch, targets(capture.test[0]).over(torch.zeros(3)))
    system = toy.create(capture, toy.Settings(), 1)
    means = evaluate(system, dataclasses.replace(capture, frames=capture.test[:1]))["splits"]["test"]
    assert means["psnr_db"] is None and means["over"]["psnr_db"] == 0
    assert means["ssim"] == pytest.approx(1) and means["ssim_inside"] == pytest.approx(1)
    result = evaluate(system, dataclasses.replace(capture, frames=capture.test))
    means, frames = result["splits"]["test"], result["frames"]
    assert means["frames"] == means["over"]["ssim"] == 3 and means["over"]["psnr_db"] == 2
    assert frames[0]["psnr_db"] is None
    assert means["psnr_db"] == pytest.approx((frames[1]["psnr_db"] + frames[2]["psnr_db"]) / 2)
    cells = [list(column.cells) for column in table(result).columns]
    assert cells[1] == ["3"] and cells[2] == [f"{means['psnr_db']:.2f} (of 2)"]
    assert cells[3] == [f"{means['ssim']:.4f}"]


@pytest.mark.parametrize("wrong", [float("nan"), float("inf")])
def test_a_rendering_that_is_not_finite_is_named(
    capture: Capture, monkeypatch: pytest.MonkeyPatch, wrong: float
) -> None:
    colour = torch.zeros(toy.SIZE, toy.SIZE, 3)
    colour[7, 5, 1] = wrong
    draws(monkeypatch, colour)
    system = toy.create(capture, toy.Settings(), 1)
    named = f"frame {capture.test[0].name}: .*not finite"
    with pytest.raises(AvatarError, match=named):
        evaluate(system, capture)
    with Targets(1) as targets, pytest.raises(AvatarError, match=named):
        quick_psnr_db(system, capture, targets, Drawing(threads=1))


def test_the_fingerprint_follows_what_was_tracked(capture: Capture) -> None:
    same = load(capture.folder)
    assert run.fingerprint(same) == run.fingerprint(capture)
    pose = dataclasses.replace(
        capture.frames[3].pose,
        expression_weights=capture.frames[3].pose.expression_weights + np.float32(1e-6),
    )
    frames = list(capture.frames)
    frames[3] = dataclasses.replace(frames[3], pose=pose)
    assert run.fingerprint(dataclasses.replace(capture, frames=tuple(frames))) != run.fingerprint(capture)


def test_density_settings_are_the_papers() -> None:
    assert DensitySettings().due(600) and not DensitySettings().due(500)
