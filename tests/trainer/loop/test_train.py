"""The training loop on the toy system: it learns, is reproducible, resumes bit by bit, and stops where it must."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import torch
from PIL import Image

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.model import Capture
from avatar_trainer.evaluation.evaluate import evaluate
from avatar_trainer.loop import checkpoint
from avatar_trainer.loop.iterate import Trainer
from avatar_trainer.loop.machine import memory_advice
from avatar_trainer.loop.train import train
from avatar_trainer.settings import TrainSettings
from avatar_trainer.tensors import Rendered
from tests.measured import Measure
from tests.trainer import toy
from tests.trainer.tensors import same

QUIET = {"log_every": 1000, "evaluate_every": 0, "checkpoint_every": 1000, "threads": 1}


def made(
    capture: Capture, out: Path, iterations: int = 40, own: toy.Settings | None = None, **settings: Any
) -> toy.Toy:
    """The toy after a run in `out`, or after what is left of it."""
    own = dataclasses.replace(own or toy.Settings(), iterations=iterations)
    system = toy.create(capture, own, 1)
    train(
        system,
        capture,
        TrainSettings(iterations=iterations, **{**QUIET, **settings}),
        out,
        system_settings=own,
    )
    return system


class Stop(Exception):
    pass


@contextmanager
def stopped_at(monkeypatch: pytest.MonkeyPatch, iteration: int) -> Iterator[None]:
    """Training inside ends in the middle of an iteration."""
    with monkeypatch.context() as patched, pytest.raises(Stop):

        def observe(self: toy.Toy, rendered: Rendered, gradient: torch.Tensor) -> None:
            if self.at == iteration:
                raise Stop
            self.density.observe(rendered.radius, gradient)

        def before_step(self: toy.Toy, at: int) -> None:
            self.at = at
            self.table.learning_rate("mean", self.settings.learning_rate * 0.99**at)

        patched.setattr(toy.Toy, "observe", observe)
        patched.setattr(toy.Toy, "before_step", before_step)
        yield


def test_it_learns_and_writes_its_files(toy_capture: Capture, tmp_path: Path, measured: Measure) -> None:
    own = toy.Settings(gaussians=60)
    before = evaluate(toy.create(toy_capture, own, 1), toy_capture)["splits"]["test"]["psnr_db"]
    system = made(toy_capture, tmp_path, 80, own, log_every=20, preview_every=40, evaluate_every=40)
    result = evaluate(system, toy_capture)
    after = result["splits"]["test"]["psnr_db"]
    measured("trainer toy, held out, dB", after)
    assert after > before + 5 and after > 22
    assert result["gaussians"] > 60 and result["splits"]["train"]["frames"] == 9
    assert [p.name for p in checkpoint.paths(tmp_path / "checkpoints")] == ["iteration_000080.ckpt"]
    assert [p.name for p in (tmp_path / "upstream").iterdir()] == ["toy80.npz"]
    with Image.open(tmp_path / "preview" / "iteration_000080.png") as sheet:
        assert sheet.size == (3 * toy.SIZE, 3 * toy.SIZE)
    facts = json.loads((tmp_path / "run.json").read_text())
    assert facts["system"] == "toy" and facts["settings"]["iterations"] == 80
    assert facts["system_settings"]["gaussians"] == 60
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize("stop", [1, 7, 22, 31])
def test_an_interrupted_run_ends_in_the_same_bits(
    toy_capture: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stop: int
) -> None:
    own = toy.Settings(
        rules={"sky": "random"}, density=dataclasses.replace(toy.Settings().density, densify_every=3)
    )
    whole = made(toy_capture, tmp_path / "whole", 35, own)
    with stopped_at(monkeypatch, stop):
        made(toy_capture, tmp_path / "cut", 35, own, checkpoint_every=6)
    left = [int(p.stem[-6:]) for p in checkpoint.paths(tmp_path / "cut" / "checkpoints")]
    assert left == [i for i in range(6, stop, 6)][-2:]
    resumed = made(toy_capture, tmp_path / "cut", 35, own, checkpoint_every=6)
    assert whole.table.count("cloud") > 40
    assert same(resumed.state(), whole.state())
    ends = [checkpoint.newest(tmp_path / name / "checkpoints", pytest.fail) for name in ("cut", "whole")]
    assert same(*(end.state["generator"] for end in ends))


def test_another_run_in_the_folder_is_told(toy_capture: Capture, tmp_path: Path) -> None:
    made(toy_capture, tmp_path, 10)
    density = dataclasses.replace(toy.Settings().density, max_gaussians=77)
    with pytest.raises(AvatarError, match=r"density\.max_gaussians was 80, is 77.*--no-resume"):
        made(toy_capture, tmp_path, 10, toy.Settings(density=density))
    with pytest.raises(AvatarError, match="iterations was 10, is 11; seed was 0, is 3"):
        made(toy_capture, tmp_path, 11, seed=3)
    with pytest.raises(AvatarError, match="the capture's content is another"):
        made(dataclasses.replace(toy_capture, frames=toy_capture.frames[1:]), tmp_path, 10)
    assert [p.name for p in checkpoint.paths(tmp_path / "checkpoints")] == ["iteration_000010.ckpt"]


def test_a_loss_that_is_no_number_stops(toy_capture: Capture, tmp_path: Path) -> None:
    with pytest.raises(
        AvatarError, match=r"iteration 9, frame \d+: loss l1 is nan; .*iteration_000008\.ckpt is kept"
    ):
        made(toy_capture, tmp_path, 20, toy.Settings(poison=9), checkpoint_every=4)
    kept = checkpoint.newest(tmp_path / "checkpoints", pytest.fail)
    assert kept is not None and kept.iteration == 8
    assert all(torch.isfinite(entry["value"]).all() for entry in kept.state["system"]["table"].values())
    with pytest.raises(AvatarError, match="there is no checkpoint yet"):
        made(toy_capture, tmp_path / "none", 20, toy.Settings(poison=1))


def test_a_parameter_that_is_no_number_never_reaches_a_checkpoint(
    toy_capture: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def spoil(self: toy.Toy, iteration: int, generator: torch.Generator) -> None:
        if iteration == 11:  # a splat that is not drawn, so the loss stays sound
            with torch.no_grad():
                self.table["opacity_logit"][0] = -40.0
                self.table["sh"][0] = float("nan")

    monkeypatch.setattr(toy.Toy, "after_step", spoil)
    with pytest.raises(
        AvatarError, match=r"iteration 12: \w+ is no longer finite; .*iteration_000010\.ckpt is kept"
    ):
        made(toy_capture, tmp_path, 20, checkpoint_every=2, log_every=1000)


def test_no_frame_to_train_on(toy_capture: Capture, tmp_path: Path) -> None:
    held_out = dataclasses.replace(toy_capture, frames=toy_capture.test)
    with pytest.raises(AvatarError, match="no frame of split `train`"):
        made(held_out, tmp_path)


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        RuntimeError("[enforce fail at alloc_cpu.cpp:114] DefaultCPUAllocator: can't allocate memory"),
        RuntimeError("CUDA out of memory. Tried to allocate 2 GiB"),
    ],
)
def test_memory_that_ran_out_says_what_to_lower(error: Exception) -> None:
    with (
        pytest.raises(AvatarError, match=r"memory ran out; lower --gaussians .*--size or --sh-degree"),
        memory_advice(),
    ):
        raise error
    with pytest.raises(RuntimeError, match="shape"), memory_advice():
        raise RuntimeError("shape mismatch")


def test_the_screen_gradient_is_by_device_units() -> None:
    found = Trainer._in_device_units(torch.ones(3, 2), torch.zeros(192, 256, 3))
    assert found.tolist() == [[128, 96]] * 3
