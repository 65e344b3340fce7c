"""One iteration of training: a frame, its image, a step of the optimiser; and its state in a checkpoint."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
import torch
from torch import Tensor

from avatar_runtime import AvatarError
from avatar_runtime.backends.cpu import thread_count
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import Target
from avatar_trainer.loop.refine import Refinement
from avatar_trainer.loop.resume import load_system
from avatar_trainer.loop.run import refines
from avatar_trainer.losses import psnr_db
from avatar_trainer.raster.renderer import render
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.drawing import Drawing, raster_settings
from avatar_trainer.systems.protocol import System


class NotFinite(AvatarError):
    """Training diverged: the loss or a parameter is not finite."""


@dataclass(frozen=True)
class Step:
    """The result of one iteration."""

    terms: dict[str, float]
    psnr_db: float
    gaussians: int


class Trainer:
    """The part of a run that determines its result."""

    def __init__(self, system: System, capture: Capture, settings: TrainSettings) -> None:
        self.system, self.capture, self.settings = system, capture, settings
        self.frames = capture.train
        if not self.frames:
            raise AvatarError("has no frame of split `train`", file=capture.folder)
        self.generator = torch.Generator().manual_seed(settings.seed)
        self.refinement = Refinement(capture, settings.iterations) if refines(settings, capture) else None
        self.drawing = Drawing(settings.rasteriser, thread_count(settings.threads or None))

    def frame(self, iteration: int) -> Frame:
        """The frame of an iteration (from 1): each frame once per epoch, in a different order in each epoch."""
        epoch, place = divmod(iteration - 1, len(self.frames))
        frame = self.frames[order(self.settings.seed, epoch, len(self.frames))[place]]
        return frame if self.refinement is None else self.refinement.frame(frame)

    def step(self, iteration: int, target: Target) -> Step:
        """One iteration. Raises AvatarError for a loss that is not finite; the parameters are then unchanged."""
        system, table, refinement = self.system, self.system.table, self.refinement
        if refinement is not None:
            refinement.begin(iteration)
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
        if refinement is not None:
            refinement.step(iteration, self.frame(iteration), rendered, wanted, target.mask)
        return Step(values, psnr_db(rendered.colour.detach(), wanted), len(splats.mean))

    @torch.no_grad()
    def gaussians(self) -> int:
        """The present number of Gaussians."""
        return len(self.system.splats(self.frames[0].pose).mean)

    def check_parameters(self, iteration: int) -> None:
        """Raise AvatarError if a parameter is not finite."""
        table = self.system.table
        for name in table:
            if not math.isfinite(float(table[name].detach().sum(dtype=torch.float64))):
                raise NotFinite(f"iteration {iteration}: {name} is no longer finite")

    def state(self) -> dict[str, Any]:
        """Everything that `load_state` needs to continue with the same bits."""
        state = {
            "system": self.system.state(),
            "generator": self.generator.get_state(),
            "torch": torch.get_rng_state(),
        }
        return state if self.refinement is None else {**state, "refinement": self.refinement.state()}

    def load_state(self, state: dict[str, Any]) -> None:
        """Continue from `state`. Raises AvatarError for one that does not fit the system."""
        load_system(self.system, state)
        if self.refinement is not None:
            self.refinement.load_state(state.get("refinement"))
        try:
            self.generator.set_state(state["generator"])
            torch.set_rng_state(state["torch"])
        except (KeyError, TypeError, RuntimeError) as error:
            raise AvatarError(
                f"the checkpoint's random numbers cannot be restored ({error}); --no-resume starts again"
            ) from None

    def _check(self, iteration: int, terms: dict[str, float]) -> None:
        wrong = [f"{name} is {value}" for name, value in terms.items() if not math.isfinite(value)]
        if wrong:
            frame = self.frame(iteration).name
            raise NotFinite(f"iteration {iteration}, frame {frame}: loss {', '.join(wrong)}")

    @staticmethod
    def _in_device_units(gradient: Tensor | None, image: Tensor) -> Tensor:
        """The gradient per pixel converted to normalised device units, of which an image has 2 in each direction."""
        assert gradient is not None
        return gradient * torch.tensor([image.shape[1] / 2, image.shape[0] / 2])


@lru_cache(maxsize=2)
def order(seed: int, epoch: int, count: int) -> tuple[int, ...]:
    """The frames of an epoch: a permutation that depends only on these numbers."""
    return tuple(np.random.default_rng([seed, epoch]).permutation(count).tolist())
