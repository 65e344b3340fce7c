"""PSAvatar's enhancer in a checkpoint, measured on held-out images."""

from __future__ import annotations

from collections.abc import Mapping
from statistics import fmean

import torch
from torch import Tensor

from avatar_runtime import Enhancer
from avatar_trainer.captures.targets import evenly, read
from avatar_trainer.enhancer.network import enhanced
from avatar_trainer.enhancer.onnx_file import onnx_enhancer
from avatar_trainer.losses import psnr_db
from avatar_trainer.systems.drawing import draw
from avatar_trainer.systems.protocol import System

MEASURED = 16  # frames at most


@torch.no_grad()
def measured_enhancer(system: System, weights: Mapping[str, Tensor]) -> Enhancer:
    """The enhancer of these weights, with the mean PSNR of held-out frames over black, raw and enhanced."""
    frames = evenly(system.capture.test, MEASURED)
    raw, better = [], []
    for frame in frames:
        wanted, colour = read(frame).over(torch.zeros(3)), draw(system, frame).colour
        raw.append(psnr_db(colour.clamp(0, 1), wanted))
        better.append(psnr_db(enhanced(weights, colour).clamp(0, 1), wanted))
    return onnx_enhancer(
        weights,
        trained_width=system.capture.width,
        trained_height=system.capture.height,
        psnr_raw_db=fmean(raw) if raw else None,
        psnr_enhanced_db=fmean(better) if better else None,
        measured_on=f"{len(frames)} frames held out, over black",
    )
