"""The training loop: one frame an iteration, resumable at any moment, the same result for the same seed."""

from __future__ import annotations

import math
import time
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
import numpy as np
import torch
from torch import Tensor

from avatar_runtime.backends.cpu.threads import thread_count
from avatar_runtime.errors import AvatarError
from avatar_trainer import checkpoint, preview, run
from avatar_trainer.capture import Capture, Frame
from avatar_trainer.drawing import Drawing, raster_settings
from avatar_trainer.evaluate import quick_psnr_db
from avatar_trainer.finished import load_system, save_upstream
from avatar_trainer.logs import Logs
from avatar_trainer.losses import psnr_db
from avatar_trainer.pictures import AHEAD, Pictures, Target
from avatar_trainer.progress import TrainProgress, note
from avatar_trainer.renderer import RASTERISERS, render
from avatar_trainer.settings import TrainSettings
from avatar_trainer.system import System

WINDOW = 100  # iterations whose mean PSNR is shown


@dataclass(frozen=True)
class Trained:
    """The end of a run."""

    iterations: int
    gaussians: int
    seconds: float  # of this process, without what an interrupted one took
    checkpoint: Path


@dataclass(frozen=True)
class Step:
    """What one iteration came to."""

    terms: dict[str, float]
    psnr_db: float
    gaussians: int


def train(
    system: System,
    capture: Capture,
    settings: TrainSettings,
    out: Path,
    *,
    system_settings: Any = None,
    resume: bool = True,
    upstream: bool = True,
) -> Trained:
    """Train `system`, fresh from its `create`, on the capture's frames of split `train`; writes into the folder `out`.

    Goes on from the newest whole checkpoint of `out` unless `resume` is False, which removes what is there. The
    result depends on the settings (without `TrainSettings.FREE`), the capture and the machine, not on how often the
    run was interrupted. At the end `out/upstream` holds the released code's layout, unless `upstream` is False.

    Raises AvatarError: `out` holds another run; no frame to train on; the loss or a parameter is no longer finite;
    memory ran out. ValueError for an unknown rasteriser; OSError where something cannot be written.
    """
    if settings.rasteriser not in RASTERISERS:
        raise ValueError(f"{settings.rasteriser!r} is none of {', '.join(RASTERISERS)}")
    facts = run.facts(system.name, capture, settings, system_settings)
    with memory_advice(), reproducible(settings.seed, settings.threads):
        trainer = Trainer(system, capture, settings)
        done = go_on(trainer, out, facts, resume)
        run.write(out, facts)
        trained = _loop(trainer, out, facts, done)
        if upstream:
            save_upstream(system, out, settings.iterations)
    return trained


class Trainer:
    """The part of a run that decides its result."""

    def __init__(self, system: System, capture: Capture, settings: TrainSettings) -> None:
        self.system, self.capture, self.settings = system, capture, settings
        self.frames = capture.train
        if not self.frames:
            raise AvatarError("has no frame of split `train`", file=capture.folder)
        self.generator = torch.Generator().manual_seed(settings.seed)
        self.drawing = Drawing(settings.rasteriser, thread_count(settings.threads or None))

    def frame(self, iteration: int) -> Frame:
        """The frame of an iteration (from 1): each once an epoch, in an order of the epoch's own."""
        epoch, place = divmod(iteration - 1, len(self.frames))
        return self.frames[order(self.settings.seed, epoch, len(self.frames))[place]]

    def step(self, iteration: int, target: Target) -> Step:
        """One iteration. Raises AvatarError for a loss that is not finite; the parameters are then as they were."""
        system, table = self.system, self.system.table
        system.before_step(iteration)
        background = system.background(self.generator)
        wanted = target.over(background)
        splats = system.splats(self.frame(iteration).pose)
        offset = torch.zeros(len(splats.mean), 2, requires_grad=True)
        rendered = render(
            splats,
            self.frame(iteration).camera,
            raster_settings(system),
            system.sh_degree,
            background,
            self.drawing.rasteriser,
            offset,
            self.drawing.threads,
        )
        terms = system.losses(rendered, wanted, target.mask, iteration)
        values = {name: term.item() for name, term in terms.items()}
        self._check(iteration, values)
        table.zero_grad()
        torch.stack(list(terms.values())).sum().backward()  # type: ignore[no-untyped-call]
        system.observe(rendered, self._in_device_units(offset.grad, wanted))
        table.step()
        system.after_step(iteration, self.generator)
        return Step(values, psnr_db(rendered.colour.detach(), wanted), len(splats.mean))

    @torch.no_grad()
    def gaussians(self) -> int:
        """How many the avatar has now."""
        return len(self.system.splats(self.frames[0].pose).mean)

    def check_parameters(self, iteration: int) -> None:
        """Raise AvatarError where a parameter is not finite."""
        table = self.system.table
        for name in table:
            if not math.isfinite(float(table[name].detach().sum(dtype=torch.float64))):
                raise AvatarError(f"iteration {iteration}: {name} is no longer finite")

    def state(self) -> dict[str, Any]:
        """All that `load_state` needs to go on bit by bit."""
        return {
            "system": self.system.state(),
            "generator": self.generator.get_state(),
            "torch": torch.get_rng_state(),
        }

    def load_state(self, state: dict[str, Any]) -> None:
        """Go on from `state`. Raises AvatarError for one that does not fit the system."""
        load_system(self.system, state)
        self.generator.set_state(state["generator"])
        torch.set_rng_state(state["torch"])

    def _check(self, iteration: int, terms: dict[str, float]) -> None:
        wrong = [f"{name} is {value}" for name, value in terms.items() if not math.isfinite(value)]
        if wrong:
            frame = self.frame(iteration).name
            raise AvatarError(f"iteration {iteration}, frame {frame}: loss {', '.join(wrong)}")

    @staticmethod
    def _in_device_units(gradient: Tensor | None, picture: Tensor) -> Tensor:
        """The gradient by pixels as one by normalised device units, of which a picture has 2 each way."""
        assert gradient is not None
        return gradient * torch.tensor([picture.shape[1] / 2, picture.shape[0] / 2])


@lru_cache(maxsize=2)
def order(seed: int, epoch: int, count: int) -> tuple[int, ...]:
    """The frames of an epoch: a permutation that depends on these numbers alone."""
    return tuple(np.random.default_rng([seed, epoch]).permutation(count).tolist())


def go_on(trainer: Trainer, out: Path, facts: dict[str, Any], resume: bool) -> int:
    """The iteration that the newest checkpoint of `out` is of, now loaded; 0 where there is none.

    Raises AvatarError for a checkpoint of another run.
    """
    folder = out / run.CHECKPOINTS
    if not resume:
        checkpoint.remove(folder)
    for path in checkpoint.partials(folder):
        path.unlink(missing_ok=True)
    found = checkpoint.newest(folder, note)
    if found is None:
        return 0
    different = run.differences(found.state.get("run", {}), facts)
    if different:
        raise AvatarError(
            f"holds another run ({'; '.join(different[:4])}); pass the same settings, name another folder, or pass "
            "--no-resume to begin anew",
            file=out,
        )
    trainer.load_state(found.state)
    note(f"goes on from {found.path}")
    return found.iteration


@contextmanager
def reproducible(seed: int, threads: int) -> Iterator[None]:
    """The same numbers each time: torch's own generator seeded, its deterministic kernels, a fixed thread count.

    threads 0: one a core. Everything is as before afterwards.
    """
    count, kernels = thread_count(threads or None), numba.get_num_threads()
    before = torch.get_num_threads(), torch.are_deterministic_algorithms_enabled()
    memory: Any = torch.utils.deterministic  # a module whose one attribute is set by assignment
    fill = memory.fill_uninitialized_memory
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(seed)
        torch.set_num_threads(count)
        torch.use_deterministic_algorithms(True)
        memory.fill_uninitialized_memory = False  # nothing reads it, and it costs a pass
        numba.set_num_threads(count)
        try:
            yield
        finally:
            numba.set_num_threads(kernels)
            memory.fill_uninitialized_memory = fill
            torch.use_deterministic_algorithms(before[1])
            torch.set_num_threads(before[0])


@contextmanager
def memory_advice() -> Iterator[None]:
    """Memory that ran out as an AvatarError that says what to lower."""
    try:
        yield
    except (MemoryError, RuntimeError) as error:
        texts = ("can't allocate memory", "not enough memory", "out of memory")
        if isinstance(error, MemoryError) or any(text in str(error) for text in texts):
            raise AvatarError(
                "memory ran out; lower --gaussians (and --set density.max_gaussians), --size or --sh-degree, or "
                "--set cache_megabytes"
            ) from None
        raise


def _loop(trainer: Trainer, out: Path, facts: dict[str, Any], done: int) -> Trained:
    """The iterations after `done`, with checkpoints, logs and previews."""
    settings, folder = trainer.settings, out / run.CHECKPOINTS
    kept = checkpoint.path_of(folder, done) if done else None
    began = time.perf_counter()
    with (
        Pictures(settings.cache_megabytes) as pictures,
        Logs(out / run.LOGS, done + 1) as logs,
        TrainProgress(settings.iterations, done) as progress,
    ):
        watch = Watch(trainer, pictures, logs, out)
        for iteration in range(done + 1, settings.iterations + 1):
            coming = range(iteration, min(iteration + AHEAD, settings.iterations + 1))
            pictures.expect(trainer.frame(i) for i in coming)
            with _last_good(kept):
                step = trainer.step(iteration, pictures(trainer.frame(iteration)))
                progress.update(iteration, watch.step(iteration, step), step.gaussians)
                saving = iteration % settings.checkpoint_every == 0 or iteration == settings.iterations
                if saving or iteration % settings.log_every == 0:
                    trainer.check_parameters(iteration)
            if saving:
                kept = checkpoint.write(folder, iteration, {"run": facts, **trainer.state()})
    assert kept is not None
    return Trained(settings.iterations, trainer.gaussians(), time.perf_counter() - began, kept)


class Watch:
    """What is shown of a run: TensorBoard's curves and contact sheets. Changes nothing of it."""

    def __init__(self, trainer: Trainer, pictures: Pictures, logs: Logs, out: Path) -> None:
        self.trainer, self.pictures, self.logs, self.out = trainer, pictures, logs, out
        self.recent: deque[float] = deque(maxlen=WINDOW)
        self.began, self.at = time.perf_counter(), 0

    def step(self, iteration: int, step: Step) -> float:
        """After an iteration; the mean PSNR of the last pictures, dB."""
        settings = self.trainer.settings
        self.recent.append(step.psnr_db)
        self.at += 1
        mean = sum(self.recent) / len(self.recent)
        if iteration % settings.log_every == 0:
            self._log(iteration, step, mean)
        if settings.evaluate_every and iteration % settings.evaluate_every == 0:
            held_out = quick_psnr_db(
                self.trainer.system, self.trainer.capture, self.pictures, self.trainer.drawing
            )
            self.logs.scalars("psnr_db", held_out, iteration)
        if settings.preview_every and iteration % settings.preview_every == 0:
            path = self.out / run.PREVIEW / f"iteration_{iteration:06d}.png"
            preview.write(
                path, self.trainer.system, self.trainer.capture, self.pictures, self.trainer.drawing
            )
        return mean

    def _log(self, iteration: int, step: Step, mean: float) -> None:
        now = time.perf_counter()
        self.logs.scalars("loss", {**step.terms, "sum": sum(step.terms.values())}, iteration)
        self.logs.scalars("psnr_db", {"train": mean}, iteration)
        self.logs.scalars(
            "run",
            {"gaussians": step.gaussians, "ms_an_iteration": 1000 * (now - self.began) / self.at},
            iteration,
        )
        self.logs.scalars("learning_rate", self.trainer.system.table.learning_rates(), iteration)
        self.began, self.at = now, 0


@contextmanager
def _last_good(kept: Path | None) -> Iterator[None]:
    """An AvatarError inside tells which checkpoint is kept."""
    try:
        yield
    except AvatarError as error:
        where = f"{kept} is kept" if kept else "there is no checkpoint yet"
        raise AvatarError(
            f"{error}; {where}; going on would meet it again: lower a learning rate or pass another --seed"
        ) from None
