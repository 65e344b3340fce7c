"""The training loop: one frame per iteration, resumable at any moment, the same result for the same seed."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from avatar_runtime import AvatarError
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.targets import AHEAD, Targets
from avatar_trainer.loop import checkpoint, run
from avatar_trainer.loop.iterate import NotFinite, Trainer
from avatar_trainer.loop.logs import Logs
from avatar_trainer.loop.machine import disk_advice, memory_advice, reproducible
from avatar_trainer.loop.progress import TrainProgress, note
from avatar_trainer.loop.refine import Refinement
from avatar_trainer.loop.resume import save_upstream
from avatar_trainer.loop.watch import Watch
from avatar_trainer.raster.renderer import expect_rasteriser
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.protocol import System

EVENTS = "events.out.tfevents.*"  # TensorBoard's files


@dataclass(frozen=True)
class Trained:
    """The end of a run."""

    iterations: int
    gaussians: int
    seconds: float  # of this process only, not of an interrupted one
    checkpoint: Path
    upstream: Path | None = None  # folder of the released code's layout; None: not written
    refinement: Refinement | None = None  # None: poses stayed as they were tracked


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

    Resumes from the newest whole checkpoint of `out` unless `resume` is False; a run that starts again removes what an
    earlier one wrote there. The result depends on the settings (without `TrainSettings.FREE`), the capture and the
    machine, not on how often the run was interrupted. At the end `out/upstream` holds the released code's layout,
    unless `upstream` is False or the layout cannot hold what was trained; `system.capture` has the refined poses.

    Raises AvatarError: `out` holds another run; no frame to train on; the loss or a parameter is no longer finite;
    memory ran out; something cannot be written; the rasteriser lacks what it needs. ValueError for an unknown one.
    """
    expect_rasteriser(settings.rasteriser)
    facts = run.facts(system.name, capture, settings, system_settings)
    with disk_advice(out), memory_advice(), reproducible(settings.seed, settings.threads):
        trainer = Trainer(system, capture, settings)
        done = go_on(trainer, out, facts, resume)
        run.write(out, facts)
        if not done:
            _say_start(trainer, system_settings)
        trained = _loop(trainer, out, facts, done)
        if trainer.refinement is not None:
            system.capture = trainer.refinement.present()
        if upstream:
            trained = replace(trained, upstream=_save(system, out, settings.iterations))
    return trained


def go_on(trainer: Trainer, out: Path, facts: dict[str, Any], resume: bool) -> int:
    """Loads the newest checkpoint of `out` and returns its iteration; 0 without a checkpoint.

    Raises AvatarError for a checkpoint of another run.
    """
    folder = out / run.CHECKPOINTS
    for path in checkpoint.partials(folder):
        path.unlink(missing_ok=True)
    found = checkpoint.newest(folder, note) if resume else None
    if found is None:
        _clear(out)
        return 0
    different = run.differences(found.state.get("run"), facts, found.iteration, trainer.settings.iterations)
    if different:
        raise AvatarError(
            f"holds another run ({'; '.join(different[:4])}); pass the same settings, name another folder, or pass "
            "--no-resume to start again",
            file=out,
        )
    trainer.load_state(found.state)
    note(f"resumes from {found.path}")
    return found.iteration


def _say_start(trainer: Trainer, settings: Any) -> None:
    """A line if there are more Gaussians than were asked for: those of the mouth have a setting of their own."""
    asked, in_mouth = getattr(settings, "gaussians", 0), getattr(settings, "mouth_gaussians", 0)
    more = trainer.gaussians() - asked
    if in_mouth and more:
        note(
            f"{asked + more} Gaussians at the start: {asked} on the face (--gaussians) and {more} in the mouth "
            f"({in_mouth} in each set of teeth; --set mouth_gaussians=N)"
        )


def _clear(out: Path) -> None:
    """Remove the files of an earlier run, the checkpoints last, so that an interruption leaves a valid run."""
    if (out / run.FILE).is_file():  # without a run, files of such names belong to somebody else
        shutil.rmtree(out / run.UPSTREAM, ignore_errors=True)
        for path in [*(out / run.PREVIEW).glob("iteration_*.png"), *(out / run.LOGS).glob(EVENTS)]:
            path.unlink(missing_ok=True)
        for name in (run.EVALUATION, run.POSES):
            (out / name).unlink(missing_ok=True)
    checkpoint.remove(out / run.CHECKPOINTS)


def _loop(trainer: Trainer, out: Path, facts: dict[str, Any], done: int) -> Trained:
    """The iterations after `done`, with checkpoints, logs and previews."""
    settings, folder = trainer.settings, out / run.CHECKPOINTS
    kept = checkpoint.path_of(folder, done) if done else None
    began = time.perf_counter()
    with (
        Targets(settings.cache_megabytes) as targets,
        Logs(out / run.LOGS, done + 1) as logs,
        TrainProgress(settings.iterations, done) as progress,
    ):
        watch = Watch(trainer, targets, logs, out)
        for iteration in range(done + 1, settings.iterations + 1):
            coming = range(iteration, min(iteration + AHEAD, settings.iterations + 1))
            targets.expect(trainer.frame(i) for i in coming)
            target = targets(trainer.frame(iteration))
            saving = iteration % settings.checkpoint_every == 0 or iteration == settings.iterations
            with _last_good(kept):
                step = trainer.step(iteration, target)
                if saving or iteration % settings.log_every == 0:
                    trainer.check_parameters(iteration)
            progress.update(iteration, watch.step(iteration, step), step.gaussians)
            if saving:
                kept = checkpoint.write(folder, iteration, {"run": facts, **trainer.state()})
    assert kept is not None
    return Trained(
        settings.iterations,
        trainer.gaussians(),
        time.perf_counter() - began,
        kept,
        refinement=trainer.refinement,
    )


def _save(system: System, out: Path, iteration: int) -> Path | None:
    """Write the released layout; None, and a note, if it cannot hold the results of some rules."""
    try:
        return save_upstream(system, out, iteration)
    except AvatarError as error:
        note(f"{out / run.UPSTREAM} is not written: {error}")
        return None


@contextmanager
def _last_good(kept: Path | None) -> Iterator[None]:
    try:
        yield
    except AvatarError as error:
        where = f"{kept} is kept" if kept else "there is no checkpoint yet"
        advice = "; going on would meet it again: lower a learning rate or pass another --seed"
        raise AvatarError(f"{error}; {where}{advice if isinstance(error, NotFinite) else ''}") from None
