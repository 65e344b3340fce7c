"""Contact sheets of a run: a few held-out frames, each beside its rendering."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from avatar_export import images
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.targets import Targets, evenly
from avatar_trainer.systems.drawing import DRAWING, Drawing, draw
from avatar_trainer.systems.protocol import System

ROWS = 4
GAIN = 4  # of the differences


def write(path: Path, system: System, capture: Capture, targets: Targets, by: Drawing = DRAWING) -> None:
    """A PNG: a row a frame with target, rendering and their difference times 4, over black.

    Frames of split `test` if there are any.
    """
    rows = []
    for frame in evenly(capture.test or capture.frames, ROWS):
        wanted = targets(frame).over(torch.zeros(3))
        drawn = draw(system, frame, by=by).colour.clamp(0, 1)
        rows.append(torch.cat([wanted, drawn, ((drawn - wanted).abs() * GAIN).clamp(0, 1)], dim=1))
    sheet = np.rint(torch.cat(rows).numpy() * 255).astype(np.uint8)
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(images.png(sheet))
