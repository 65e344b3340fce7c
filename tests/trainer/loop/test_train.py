"""The training loop on the toy system: it learns, is reproducible, resumes bit by bit, and stops where it must."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
import torch
from PIL import Image

from avatar_runtime.backends.cpu.threads import using
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.targets import Targets
from avatar_trainer.evaluation.evaluate import evaluate
from avatar_trainer.loop import checkpoint
from avatar_trainer.loop.iterate import Trainer, order
from avatar_trainer.loop.machine import memory_advice, reproducible
from avatar_trainer.loop.train import train
from avatar_trainer.raster.renderer import render
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.drawing import raster_settings
from avatar_trainer.tensors import Rendered
from tests.measured import Measure
from tests.trainer import toy

QUIET = {"log_every": 1000, "evaluate_every": 0, "checkpoint_every": 1000, "threads": 1}


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return load(toy.capture_folder(tmp_path_factory.mktemp("capture") / "toy"))


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


def bits(state: Any) -> Any:
    """A state as nested plain values."""
    if isinstance(state, torch.Tensor):
        return str(state.dtype), tuple(state.shape), state.numpy().tobytes()
    if isinstance(state, dict):
        return {key: bits(value) for key, value in state.items()}
    return state


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


def test_it_learns_and_writes_its_files(capture: Capture, tmp_path: Path, measured: Measure) -> None:
    own = toy.Settings(gaussians=60)
    before = evaluate(toy.create(capture, own, 1), capture)["splits"]["test"]["psnr_db"]
    system = made(capture, tmp_path, 80, own, log_every=20, preview_every=40, evaluate_every=40)
    result = evaluate(system, capture)
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


def test_scalars_are_logged(capture: Capture, tmp_path: Path) -> None:
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    made(capture, tmp_path, 20, log_every=5, evaluate_every=10)
    events = EventAccumulator(str(tmp_path / "logs")).Reload()
    steps = {tag: [event.step for event in events.Scalars(tag)] for tag in events.Tags()["scalars"]}
    assert {tag for tag in steps if steps[tag] == [5, 10, 15, 20]} == {
        "loss/l1", "loss/alpha", "loss/sum", "psnr_db/train", "run/gaussians", "run/ms_an_iteration",
        *(f"learning_rate/{name}" for name in toy.cloud(1, 0)),
    }  # fmt: skip
    assert steps["psnr_db/test"] == [10, 20]
    total = [event.value for event in events.Scalars("loss/sum")]
    terms = [[event.value for event in events.Scalars(f"loss/{name}")] for name in ("l1", "alpha")]
    assert np.allclose(total, np.sum(terms, axis=0), rtol=1e-6)


def test_same_seed_same_bits(capture: Capture, tmp_path: Path) -> None:
    own = toy.Settings(rules={"sky": "random"})
    first, again, other = (
        made(capture, tmp_path / name, 25, own, seed=seed) for name, seed in (("a", 4), ("b", 4), ("c", 5))
    )
    assert bits(first.state()) == bits(again.state()) != bits(other.state())


def test_threads_logs_previews_and_checkpoints_change_nothing(capture: Capture, tmp_path: Path) -> None:
    plain = made(capture, tmp_path / "plain", 25)
    busy = {"threads": 2, "log_every": 1, "evaluate_every": 3, "preview_every": 4, "checkpoint_every": 2}
    assert bits(made(capture, tmp_path / "busy", 25, **busy).state()) == bits(plain.state())
    assert bits(made(capture, tmp_path / "small", 25, cache_megabytes=0).state()) == bits(plain.state())


@pytest.mark.parametrize("stop", [1, 7, 22, 31])
def test_an_interrupted_run_ends_in_the_same_bits(
    capture: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, stop: int
) -> None:
    own = toy.Settings(
        rules={"sky": "random"}, density=dataclasses.replace(toy.Settings().density, densify_every=3)
    )
    whole = made(capture, tmp_path / "whole", 35, own)
    with stopped_at(monkeypatch, stop):
        made(capture, tmp_path / "cut", 35, own, checkpoint_every=6)
    left = [int(p.stem[-6:]) for p in checkpoint.paths(tmp_path / "cut" / "checkpoints")]
    assert left == [i for i in range(6, stop, 6)][-2:]
    resumed = made(capture, tmp_path / "cut", 35, own, checkpoint_every=6)
    assert whole.table.count("cloud") > 40
    assert bits(resumed.state()) == bits(whole.state())
    assert bits(checkpoint.newest(tmp_path / "cut/checkpoints", pytest.fail).state["generator"]) == bits(
        checkpoint.newest(tmp_path / "whole/checkpoints", pytest.fail).state["generator"]
    )


def test_a_broken_checkpoint_costs_the_iterations_since_the_one_before(
    capture: Capture, tmp_path: Path
) -> None:
    whole = made(capture, tmp_path, 24, checkpoint_every=8)
    newest = checkpoint.paths(tmp_path / "checkpoints")[-1]
    newest.write_bytes(newest.read_bytes()[:1000])
    (tmp_path / "checkpoints" / ".iteration_000025.ckpt.partial").write_bytes(b"half")
    assert bits(made(capture, tmp_path, 24, checkpoint_every=8).state()) == bits(whole.state())
    assert checkpoint.partials(tmp_path / "checkpoints") == []


def test_a_finished_run_is_not_trained_on(capture: Capture, tmp_path: Path) -> None:
    whole = made(capture, tmp_path, 12)
    (tmp_path / "upstream" / "toy12.npz").unlink()
    assert bits(made(capture, tmp_path, 12, checkpoint_every=1).state()) == bits(whole.state())
    assert (tmp_path / "upstream" / "toy12.npz").is_file()


def test_another_run_in_the_folder_is_told(capture: Capture, tmp_path: Path) -> None:
    made(capture, tmp_path, 10)
    density = dataclasses.replace(toy.Settings().density, max_gaussians=77)
    with pytest.raises(AvatarError, match=r"density\.max_gaussians was 80, is 77.*--no-resume"):
        made(capture, tmp_path, 10, toy.Settings(density=density))
    with pytest.raises(AvatarError, match="iterations was 10, is 11; seed was 0, is 3"):
        made(capture, tmp_path, 11, seed=3)
    with pytest.raises(AvatarError, match="the capture's content is another"):
        made(dataclasses.replace(capture, frames=capture.frames[1:]), tmp_path, 10)
    kept = checkpoint.paths(tmp_path / "checkpoints")
    assert [p.name for p in kept] == ["iteration_000010.ckpt"]
    own = toy.Settings(iterations=5)
    train(
        toy.create(capture, own, 1), capture, TrainSettings(iterations=5, **QUIET), tmp_path,
        system_settings=own, resume=False, upstream=False,
    )  # fmt: skip
    assert [p.name for p in checkpoint.paths(tmp_path / "checkpoints")] == ["iteration_000005.ckpt"]
    assert not (tmp_path / "upstream").exists()  # that of the run before


def test_a_checkpoint_of_another_shape_is_bad_data(capture: Capture, tmp_path: Path) -> None:
    made(capture, tmp_path, 4)
    found = checkpoint.newest(tmp_path / "checkpoints", pytest.fail)
    assert found is not None
    found.state["system"]["table"].pop("sh")
    checkpoint.write(tmp_path / "checkpoints", 4, found.state)
    with pytest.raises(AvatarError, match="does not fit toy"):
        made(capture, tmp_path, 4)


def test_a_loss_that_is_no_number_stops(capture: Capture, tmp_path: Path) -> None:
    with pytest.raises(
        AvatarError, match=r"iteration 9, frame \d+: loss l1 is nan; .*iteration_000008\.ckpt is kept"
    ):
        made(capture, tmp_path, 20, toy.Settings(poison=9), checkpoint_every=4)
    kept = checkpoint.newest(tmp_path / "checkpoints", pytest.fail)
    assert kept is not None and kept.iteration == 8
    assert all(torch.isfinite(entry["value"]).all() for entry in kept.state["system"]["table"].values())
    with pytest.raises(AvatarError, match="there is no checkpoint yet"):
        made(capture, tmp_path / "none", 20, toy.Settings(poison=1))


def test_a_parameter_that_is_no_number_never_reaches_a_checkpoint(
    capture: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
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
        made(capture, tmp_path, 20, checkpoint_every=2, log_every=1000)


def test_only_numbers_gone_astray_are_told_of_learning_rates(
    capture: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def empty(*_: object) -> None:
        raise AvatarError("no Gaussian is left")

    with pytest.raises(AvatarError, match="lower a learning rate"):
        made(capture, tmp_path, 5, toy.Settings(poison=2))
    monkeypatch.setattr(toy.Toy, "after_step", empty)
    with pytest.raises(AvatarError, match=r"no Gaussian is left; there is no checkpoint yet$"):
        made(capture, tmp_path, 5)


def test_what_lies_in_a_folder_that_is_no_run_is_left_alone(capture: Capture, tmp_path: Path) -> None:
    for name in ("evaluation.json", "preview/iteration_000001.png", "logs/events.out.tfevents.1"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("dear")
    made(capture, tmp_path, 2)
    assert (tmp_path / "evaluation.json").read_text() == "dear"
    assert (tmp_path / "preview" / "iteration_000001.png").is_file()
    assert (tmp_path / "logs" / "events.out.tfevents.1").is_file()


def test_what_the_released_layout_cannot_hold_is_said(
    capture: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def refuse(*_: object) -> None:
        raise AvatarError("nothing holds this rule")

    monkeypatch.setattr(toy.Toy, "save", refuse)
    made(capture, tmp_path, 3)
    assert "upstream is not written: nothing holds this rule" in capfd.readouterr().err
    assert not (tmp_path / "upstream").exists() and not list(tmp_path.glob(".*"))


def test_no_frame_to_train_on(capture: Capture, tmp_path: Path) -> None:
    held_out = dataclasses.replace(capture, frames=capture.test)
    with pytest.raises(AvatarError, match="no frame of split `train`"):
        made(held_out, tmp_path)
    with pytest.raises(ValueError, match="'gpu' is not one of"):
        made(capture, tmp_path, rasteriser="gpu")


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


def test_what_torch_and_numpy_raise_is_recognised() -> None:
    for ask in (lambda: torch.empty(1 << 50), lambda: np.empty(1 << 50)):
        with pytest.raises(AvatarError, match="memory ran out"), memory_advice():
            ask()


def test_reproducible_puts_everything_back() -> None:
    def now() -> tuple[Any, ...]:
        return (
            torch.get_num_threads(),
            torch.are_deterministic_algorithms_enabled(),
            numba.get_num_threads(),
            torch.get_rng_state().numpy().tobytes(),
        )

    threads = torch.get_num_threads()
    torch.set_num_threads(2)
    try:
        with using(numba.config.NUMBA_NUM_THREADS):
            before = now()
            with pytest.raises(Stop), reproducible(3, 1):
                assert torch.get_num_threads() == numba.get_num_threads() == 1
                assert torch.are_deterministic_algorithms_enabled() and torch.initial_seed() == 3
                raise Stop
            assert now() == before
    finally:
        torch.set_num_threads(threads)


def test_every_epoch_shows_each_frame_once(capture: Capture) -> None:
    trainer = Trainer(toy.create(capture, toy.Settings(), 1), capture, TrainSettings(seed=3))
    epochs = [[trainer.frame(9 * e + i + 1).name for i in range(9)] for e in range(4)]
    assert all(sorted(epoch) == sorted(f.name for f in capture.train) for epoch in epochs)
    assert len({tuple(epoch) for epoch in epochs}) == 4
    assert order(3, 1, 9) != order(4, 1, 9)


def test_the_screen_gradient_is_by_device_units(capture: Capture) -> None:
    """Against the same step on an image of the same view in twice the pixels: by pixels it would be half."""
    seen: list[torch.Tensor] = []

    class Seen(toy.Toy):
        def losses(self, rendered: Rendered, *_: Any) -> dict[str, torch.Tensor]:
            height, width = rendered.alpha.shape
            across = torch.linspace(0, 1, width)
            return {"ramp": (rendered.alpha * across).sum() / (width * height)}

        def observe(self, rendered: Rendered, screen_gradient: torch.Tensor) -> None:
            seen.append(screen_gradient)

    frames = tuple(
        dataclasses.replace(f, camera=dataclasses.replace(f.camera, width=128, height=96))
        for f in capture.frames
    )
    twice = tuple(
        dataclasses.replace(f, camera=dataclasses.replace(f.camera, width=256, height=192))
        for f in capture.frames
    )
    for some in (frames, twice):
        scene = dataclasses.replace(
            capture, frames=some, width=some[0].camera.width, height=some[0].camera.height
        )
        trainer = Trainer(Seen(scene, toy.Settings(), 1), scene, TrainSettings(seed=3))
        with Targets(10) as targets:
            trainer.step(1, targets(trainer.frame(1)))
    small, large = seen
    assert small.abs().max() > 1e-4
    assert torch.linalg.vector_norm(large - small) < 0.1 * torch.linalg.vector_norm(small)
    again, frame = Seen(scene, toy.Settings(), 1), trainer.frame(1)  # the last step, by pixels
    splats = again.splats(frame.pose)
    pixels = torch.zeros(len(splats.mean), 2, requires_grad=True)
    drawn = render(splats, frame.camera, raster_settings(again), 0, torch.zeros(3), "cpu", pixels)
    again.losses(drawn)["ramp"].backward()
    assert pixels.grad is not None
    assert torch.allclose(large, pixels.grad * torch.tensor([256 / 2, 192 / 2]), rtol=1e-4, atol=1e-9)


def test_prediction_and_target_have_one_background(capture: Capture) -> None:
    corners: list[list[torch.Tensor]] = []

    class Seen(toy.Toy):
        def losses(
            self, rendered: Rendered, target: torch.Tensor, mask: torch.Tensor, iteration: int
        ) -> dict[str, torch.Tensor]:
            assert rendered.alpha[0, 0] == mask[0, 0] == 0
            corners.append([rendered.colour[0, 0].detach(), target[0, 0]])
            return super().losses(rendered, target, mask, iteration)

    trainer = Trainer(Seen(capture, toy.Settings(rules={"sky": "random"}), 1), capture, TrainSettings())
    with Targets(10) as targets:
        for iteration in (1, 2):
            trainer.step(iteration, targets(trainer.frame(iteration)))
    (first, wanted), (second, also) = corners
    assert torch.equal(first, wanted) and torch.equal(second, also)
    assert len({*first.tolist(), *second.tolist()}) == 6


def test_the_near_plane_is_in_training_units(capture: Capture) -> None:
    system = toy.create(capture, toy.Settings(), 1)
    assert raster_settings(system).near == 0.2
    system.training_per_bundle = 4.0
    assert raster_settings(system).near == 0.05
