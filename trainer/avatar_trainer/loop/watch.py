"""The display of a run while it trains: TensorBoard's curves and contact sheets."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import replace
from pathlib import Path

from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.targets import Targets, evenly
from avatar_trainer.evaluation import preview
from avatar_trainer.evaluation.evaluate import QUICK, quick_psnr_db
from avatar_trainer.loop import run
from avatar_trainer.loop.iterate import Step, Trainer
from avatar_trainer.loop.logs import Logs
from avatar_trainer.systems.drawing import Drawing
from avatar_trainer.systems.protocol import System

WINDOW = 100  # iterations whose mean PSNR is shown


class Watch:
    """Shows a run; changes nothing of it."""

    def __init__(self, trainer: Trainer, targets: Targets, logs: Logs, out: Path) -> None:
        self.trainer, self.targets, self.logs, self.out = trainer, targets, logs, out
        self.recent: deque[float] = deque(maxlen=WINDOW)
        self.gaussians = 0
        self.began, self.at = time.perf_counter(), 0

    def step(self, iteration: int, step: Step) -> float:
        """After an iteration; the mean PSNR of the last images, dB, all drawn with this number of Gaussians."""
        settings = self.trainer.settings
        if step.gaussians != self.gaussians:  # images from before a densification show another avatar
            self.gaussians = step.gaussians
            self.recent.clear()
        self.recent.append(step.psnr_db)
        self.at += 1
        mean = sum(self.recent) / len(self.recent)
        if iteration % settings.log_every == 0:
            self._log(iteration, step, mean)
        if settings.evaluate_every and iteration % settings.evaluate_every == 0:
            self.logs.scalars("psnr_db", self._held_out(), iteration)
        last = iteration == settings.iterations
        if settings.preview_every and (last or iteration % settings.preview_every == 0):
            path = self.out / run.PREVIEW / f"iteration_{iteration:06d}.png"
            preview.write(path, *self._shown())
        return mean

    def _held_out(self) -> dict[str, float]:
        """The PSNR of a few frames, refined as those that are trained on."""
        system, capture, targets, by = self._shown()
        if (refinement := self.trainer.refinement) is not None:
            frames = refinement.held_out(system, evenly(capture.test, QUICK), targets, by)
            capture = replace(capture, frames=tuple(frames))
        return quick_psnr_db(system, capture, targets, by)

    def _shown(self) -> tuple[System, Capture, Targets, Drawing]:
        return self.trainer.system, self.trainer.capture, self.targets, self.trainer.drawing

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
