"""A system's image of a frame, without gradients: for evaluation, previews, references and comparisons."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from avatar_runtime import RasterSettings
from avatar_schema import constants
from avatar_trainer.captures.model import Frame
from avatar_trainer.raster.renderer import render
from avatar_trainer.systems.protocol import System
from avatar_trainer.tensors import Rendered


@dataclass(frozen=True)
class Drawing:
    """Which rasteriser draws, and on how many threads."""

    rasteriser: str = "cpu"
    threads: int | None = None  # as for the runtime's backend `cpu`


DRAWING = Drawing()


def raster_settings(system: System) -> RasterSettings:
    """The settings of a system's images: the trainers' near plane is in training units, the splats are in metres."""
    return RasterSettings(near=float(constants()["near"]) / system.training_per_bundle)


@torch.no_grad()
def draw(
    system: System,
    frame: Frame,
    background: Tensor | None = None,  # [3]; None: black
    by: Drawing = DRAWING,
) -> Rendered:
    """A frame of the system's capture, drawn by the present model."""
    return render(
        system.splats(frame.pose),
        frame.camera,
        raster_settings(system),
        system.sh_degree,
        torch.zeros(3) if background is None else background,
        by.rasteriser,
        threads=by.threads,
    )
