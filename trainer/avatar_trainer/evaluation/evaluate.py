"""Held-out self-reenactment: how close the avatar comes to frames of the same person that it was not trained on."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from statistics import fmean
from typing import Any

import torch
from rich.table import Table
from torch import Tensor

from avatar_runtime import AvatarError
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import Target, Targets, evenly
from avatar_trainer.evaluation.lpips import Lpips
from avatar_trainer.losses import WINDOW, psnr_db, ssim
from avatar_trainer.systems.drawing import DRAWING, Drawing, draw
from avatar_trainer.systems.protocol import System

QUICK = 8  # frames looked at during training
TRAIN_FRAMES = 50  # of split `train` that are measured at the end
INSIDE = 0.5  # of the mask
HOW = (
    "8-bit images as captured against the rendering clamped to 0..1, both over black; mean over frames of each "
    "frame's PSNR (peak 1) and SSIM (Gaussian window 11, sigma 1.5, mean of the channels). whole: all pixels; "
    "inside: PSNR of the pixels whose mask is above 0.5, SSIM of the mask's bounding box, black outside the mask. "
    "test: every frame, none trained on; train: "
    f"at most {TRAIN_FRAMES}, evenly spaced; "
    "lpips: of the whole images, where weights were given; over: how many frames each mean is over, which are those "
    "where it has a finite value: a rendering equal to its image has no finite PSNR, an empty mask no inside"
)
MEASURES = ("psnr_db", "ssim", "psnr_inside_db", "ssim_inside")
ENHANCED = "psnr_enhanced_db"  # of the whole image by the system's enhancer, where one has been trained
LPIPS = "lpips"  # of the whole image, where weights are given
OPTIONAL = (LPIPS, ENHANCED)
TITLES = {
    "psnr_db": "PSNR dB",
    "ssim": "SSIM",
    "psnr_inside_db": "PSNR dB inside",
    "ssim_inside": "SSIM inside",
    LPIPS: "LPIPS",
    ENHANCED: "PSNR dB enhanced",
}


@dataclass(frozen=True)
class Score:
    """One frame."""

    frame: str
    split: str
    psnr_db: float | None  # None: infinite (equal images); of `inside` also: nothing inside the mask
    ssim: float
    psnr_inside_db: float | None
    ssim_inside: float | None
    lpips: float | None = None  # None: no weights
    psnr_enhanced_db: float | None = None  # None: no enhancer, or infinite


def evaluate(
    system: System, capture: Capture, by: Drawing = DRAWING, lpips: Lpips | None = None
) -> dict[str, Any]:
    """Means of each split, every frame's score and how they were computed, as JSON data.

    AvatarError for a rendering that is not finite.
    """
    scores = measured(capture, lambda frame, target: measure(system, frame, target, by, lpips))
    return summary(system.name, len(system.splats(capture.frames[0].pose).mean), capture, scores)


def measured(capture: Capture, of: Callable[[Frame, Target], Score]) -> list[Score]:
    """The score `of` every frame held out, and of TRAIN_FRAMES others."""
    with Targets(0) as targets:
        return [of(f, targets(f)) for f in [*capture.test, *evenly(capture.train, TRAIN_FRAMES)]]


def summary(system: str, gaussians: int, capture: Capture, scores: list[Score]) -> dict[str, Any]:
    """The scores of frames of `capture` as JSON data, with the means of each split."""
    splits = {split: [s for s in scores if s.split == split] for split in ("test", "train")}
    there = (name for name in OPTIONAL if any(getattr(score, name) is not None for score in scores))
    measures = (*MEASURES, *there)
    return {
        "system": system,
        "capture": capture.name,
        "width": capture.width,
        "height": capture.height,
        "gaussians": gaussians,
        "how": HOW,
        "splits": {split: _means(of, measures) for split, of in splits.items() if of},
        "frames": [_shared(score, measures) for score in scores],
    }


def measure(
    system: System, frame: Frame, target: Target, by: Drawing = DRAWING, lpips: Lpips | None = None
) -> Score:
    """A frame's rendering against its image, over black. AvatarError for a rendering that is not finite."""
    colour = _drawn(system, frame, by)
    found = score(colour, frame, target, lpips)
    return replace(found, psnr_enhanced_db=_enhanced_psnr_db(system, colour, target.over(torch.zeros(3))))


def score(colour: Tensor, frame: Frame, target: Target, lpips: Lpips | None = None) -> Score:
    """A rendering [H, W, 3] of a frame, over black, against its image."""
    drawn = colour.clamp(0, 1)
    wanted = target.over(torch.zeros(3))
    inside = target.mask > INSIDE
    return Score(
        frame.name,
        frame.split,
        _finite(psnr_db(drawn, wanted)),
        _similar(drawn, wanted),
        _finite(psnr_db(drawn[inside], wanted[inside])) if inside.any() else None,
        _ssim_inside(drawn, wanted, inside),
        None if lpips is None else lpips(drawn, wanted),
    )


def quick_psnr_db(system: System, capture: Capture, targets: Targets, by: Drawing) -> dict[str, float]:
    """Mean PSNR of a few held-out frames over black, by split; empty if none is held out.

    Infinite if the rendering of one equals its image. AvatarError for a rendering that is not finite.
    """
    frames = evenly(capture.test, QUICK)
    black = torch.zeros(3)
    found = [psnr_db(_drawn(system, f, by).clamp(0, 1), targets(f).over(black)) for f in frames]
    return {"test": fmean(found)} if found else {}


def table(result: dict[str, Any]) -> Table:
    """The means of each split, with the number of frames if that is not all of them."""
    shown = Table(box=None, pad_edge=False)
    measures = (*MEASURES, *(n for n in OPTIONAL if any(n in m for m in result["splits"].values())))
    shown.add_column("split")
    for title in ("frames", *(TITLES[name] for name in measures)):
        shown.add_column(title, justify="right")
    for split, means in result["splits"].items():
        shown.add_row(split, str(means["frames"]), *(_shown(means, measure) for measure in measures))
    return shown


def _shown(means: dict[str, Any], measure: str) -> str:
    if means[measure] is None:
        return "-"
    text, over = f"{means[measure]:.{2 if 'db' in measure else 4}f}", means["over"][measure]
    return text if over == means["frames"] else f"{text} (of {over})"


def _drawn(system: System, frame: Frame, by: Drawing) -> Tensor:
    colour = draw(system, frame, by=by).colour
    if not colour.isfinite().all():
        raise AvatarError(
            f"frame {frame.name}: the avatar's rendering is not finite; train again, with lower learning rates"
        )
    return colour


@torch.no_grad()
def _enhanced_psnr_db(system: System, colour: Tensor, wanted: Tensor) -> float | None:
    """By the system's enhancer; None for a system without one."""
    enhance = getattr(system, "enhanced", None)  # the one optional member of System
    better = None if enhance is None else enhance(colour)
    return None if better is None else _finite(psnr_db(better.clamp(0, 1), wanted))


def _similar(drawn: Tensor, wanted: Tensor) -> float:
    """SSIM; single precision is 1e-4 off on flat areas. Where both are black as far as the window reaches it is 1."""
    at = torch.nonzero(((drawn != 0) | (wanted != 0)).any(dim=2))
    if not len(at):
        return 1.0
    low, high = (at.amin(0) - WINDOW // 2).clamp_min(0).tolist(), (at.amax(0) + WINDOW // 2 + 1).tolist()
    part = [image[low[0] : high[0], low[1] : high[1]].double() for image in (drawn, wanted)]
    return 1 - (1 - float(ssim(*part))) * part[0].numel() / drawn.numel()


def _ssim_inside(drawn: Tensor, wanted: Tensor, inside: Tensor) -> float | None:
    """SSIM of the mask's bounding box, both images black outside the mask; None for an empty mask."""
    if not inside.any():
        return None
    at = torch.nonzero(inside)
    box = tuple(
        slice(low, high + 1) for low, high in zip(at.amin(0).tolist(), at.amax(0).tolist(), strict=True)
    )
    pair = ((image * inside[:, :, None])[box] for image in (drawn, wanted))
    return _similar(*pair)


def _shared(score: Score, measures: Sequence[str]) -> dict[str, Any]:
    return {name: value for name, value in vars(score).items() if name not in OPTIONAL or name in measures}


def _means(scores: list[Score], measures: Sequence[str]) -> dict[str, Any]:
    means: dict[str, Any] = {"frames": len(scores), "over": {}}
    for name in measures:
        values = [value for score in scores if (value := getattr(score, name)) is not None]
        means[name] = fmean(values) if values else None
        means["over"][name] = len(values)
    return means


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None
