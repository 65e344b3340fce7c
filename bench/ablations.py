"""The papers' ablations at a small size: `python -m bench.ablations OUT` prints the table of trainer/README.md.

Every row is trained from the same capture, seed and number of iterations as its neighbours; what differs is named. The
images measured were never trained on. Orders, not figures, are what compares with the papers.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from avatar_runtime.pose import PoseArrays
from avatar_runtime.posed import posed_mesh
from avatar_runtime.stages.joints import joints
from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import Targets
from avatar_trainer.loop.train import train
from avatar_trainer.losses import psnr_db, ssim
from avatar_trainer.settings import TrainSettings, with_values
from avatar_trainer.systems.drawing import draw
from avatar_trainer.systems.protocol import System
from avatar_trainer.systems.table import system_module

SIZE, FRAMES, SEED = 128, 240, 3
UNSEEN = (
    *("mouthSmileLeft", "mouthSmileRight", "mouthPucker", "mouthFunnel", "cheekPuff"),
    *("noseSneerLeft", "noseSneerRight", "browInnerUp", "mouthStretchLeft", "mouthStretchRight"),
)
CAPTURES = {
    "head": ("--subject", "head"),
    "head, expressions held out": ("--subject", "head", "--hold-out", ",".join(UNSEEN)),
    "head, tracking noise": ("--subject", "head", "--tracking-noise", "0.02"),
    "body": ("--subject", "body"),
}
MOUTH_REACH = 0.045  # metres about the middle of the lips
BOX_MARGIN = 2  # pixels


@dataclass(frozen=True)
class Variant:
    """One row: settings by name, as `--set` and `--rule` take them."""

    label: str
    rules: tuple[tuple[str, str], ...] = ()
    settings: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Ablation:
    """One comparison of a paper; the first variant is the paper's own."""

    title: str
    capture: str
    system: str
    settings: tuple[tuple[str, str], ...]
    variants: tuple[Variant, ...]
    region: str = "whole"  # a key of REGIONS


BLENDSHAPES = (
    *(("gaussians", "4000"), ("mouth_gaussians", "400"), ("sh_degree", "0"), ("iterations", "1000")),
    *(("supported", "0"), ("decay", "0")),  # the paper has neither
)
SPLATTING = (("gaussians", "4000"), ("iterations", "1000"))
ABLATIONS = {
    "consistency": Ablation(
        "Gaussian Blendshapes, Fig. 4: unseen expressions",
        "head, expressions held out",
        "gaussian_blendshapes",
        BLENDSHAPES,
        (
            Variant("blendshape consistency"),
            Variant("consistency of positions only", (("consistency", "position"),)),
            Variant("no consistency", (("consistency", "none"),)),
        ),
    ),
    "deltas": Ablation(
        "Gaussian Blendshapes, Fig. 9: joint optimisation",
        "head",
        "gaussian_blendshapes",
        BLENDSHAPES,
        (Variant("differences trained"), Variant("initial differences kept", (("deltas", "fixed"),))),
    ),
    "mouth": Ablation(
        "Gaussian Blendshapes, Fig. 10: mouth interior (measured about the mouth)",
        "head",
        "gaussian_blendshapes",
        BLENDSHAPES,
        (Variant("mouth Gaussians"), Variant("no mouth Gaussians", (("mouth", "off"),))),
        "mouth",
    ),
    "walking": Ablation(
        "SplattingAvatar, Table A2: walking on triangles",
        "head",
        "splatting_avatar",
        SPLATTING,
        (
            Variant("walking on triangles"),
            Variant("(u, v) held in its triangle", (("embedding", "clamped"),)),
            Variant("(u, v) not trained, as released", (("embedding", "released"),)),
        ),
    ),
    "embedding": Ablation(
        "SplattingAvatar, Fig. 7: trainable embedding, unseen expressions",
        "head, expressions held out",
        "splatting_avatar",
        SPLATTING,
        (
            Variant("trainable embedding"),
            Variant("fixed embedding, local shift trained", (("embedding", "fixed"),)),
        ),
    ),
    "scaling": Ablation(
        "SplattingAvatar, Fig. 7: scale regularisation, unseen expressions",
        "head, expressions held out",
        "splatting_avatar",
        SPLATTING,
        (Variant("with Eq. 14"), Variant("without", settings=(("scaling", "0"),))),
    ),
    "areas": Ablation(
        "SplattingAvatar: how Gaussians follow their triangles",
        "head",
        "splatting_avatar",
        SPLATTING,
        (
            Variant("scale times the ratio of areas"),
            Variant("its logarithm times the ratio, as released", (("scale", "log_area"),)),
            Variant("not at all", (("scale", "none"),)),
        ),
    ),
}


def capture_of(name: str, out: Path) -> Capture:
    """The capture of that name, made under `out` where it is not there yet."""
    folder = out / "captures" / "".join(c if c.isalnum() else "_" for c in name)
    if not folder.exists():
        options = ("--size", str(SIZE), "--frames", str(FRAMES), *CAPTURES[name])
        subprocess.run([sys.executable, "-m", "samples.capture", str(folder), *options], check=True)
    return load(folder)


def trained(
    ablation: Ablation, variant: Variant, capture: Capture, iterations: int | None, out: Path
) -> tuple[System, float]:
    """The variant's model and the seconds it took."""
    module = system_module(ablation.system)
    settings = with_values(module.Settings(), [*ablation.settings, *variant.settings])
    if iterations is not None:
        settings = replace(settings, iterations=iterations)
    settings = replace(settings, rules={**settings.rules, **dict(variant.rules)})
    run = TrainSettings(
        iterations=settings.iterations,
        seed=SEED,
        threads=1,
        evaluate_every=0,
        checkpoint_every=settings.iterations,
    )
    system = module.create(capture, settings, SEED)
    began = time.perf_counter()
    train(system, capture, run, out, system_settings=settings, resume=False, upstream=False)
    return system, time.perf_counter() - began


def whole(capture: Capture, frame: Frame) -> tuple[slice, slice]:
    """Every pixel."""
    return slice(0, capture.height), slice(0, capture.width)


def mouth(capture: Capture, frame: Frame) -> tuple[slice, slice]:
    """The box of the image that the vertices about the lips lie in."""
    rig = capture.rig
    opened = capture.expression_names.index("jawOpen")
    weights = np.zeros(rig.morphs.columns, np.float32)
    weights[opened] = 1
    moved = np.linalg.norm(
        _mesh(capture, replace(frame.pose, expression_weights=weights)) - rig.vertices, axis=1
    )
    front = rig.vertices[np.argsort(moved)[-200:]]
    near = np.linalg.norm(rig.vertices - front.mean(axis=0), axis=1) < MOUTH_REACH
    world = np.c_[_mesh(capture, frame.pose)[near], np.ones(near.sum())]
    clip = world @ frame.camera.clip_from_world.T.astype(np.float64)
    size = np.array([capture.width, capture.height])
    pixel = ((clip[:, :2] / clip[:, 3:] + 1) * size - 1) / 2
    low = np.clip(np.floor(pixel.min(axis=0)) - BOX_MARGIN, 0, size - 1).astype(int)
    high = np.clip(np.ceil(pixel.max(axis=0)) + BOX_MARGIN, 1, size).astype(int)
    return slice(low[1], high[1]), slice(low[0], high[0])


def _mesh(capture: Capture, pose: PoseArrays) -> Any:
    return posed_mesh(capture.rig, pose, joints(capture.rig, pose))


REGIONS: dict[str, Callable[[Capture, Frame], tuple[slice, slice]]] = {"whole": whole, "mouth": mouth}


@torch.no_grad()
def score(system: System, capture: Capture, region: str) -> tuple[float, float]:
    """(PSNR dB, SSIM): means over the held-out frames of a region, over black."""
    scores = []
    with Targets(0) as targets:
        for frame in capture.test:
            rows, columns = REGIONS[region](capture, frame)
            got = draw(system, frame).colour.clamp(0, 1)[rows, columns].contiguous()
            want = targets(frame).over(torch.zeros(3))[rows, columns].contiguous()
            scores.append((psnr_db(got, want), float(ssim(got, want))))
    mean = np.mean(scores, axis=0)
    return float(mean[0]), float(mean[1])


def table(ablation: Ablation, iterations: int | None, out: Path) -> list[str]:
    """Lines of Markdown."""
    capture = capture_of(ablation.capture, out)
    lines = [
        f"| {ablation.title} | PSNR dB | SSIM | Gaussians | crossings | s |",
        "|---|---|---|---|---|---|",
    ]
    for variant in ablation.variants:
        run = out / "runs" / "".join(c if c.isalnum() else "_" for c in f"{ablation.title} {variant.label}")
        system, seconds = trained(ablation, variant, capture, iterations, run)
        psnr, similar = score(system, capture, ablation.region)
        count = len(system.splats(capture.frames[0].pose).mean)
        crossings = getattr(system, "crossings", "-")
        lines.append(
            f"| {variant.label} | {psnr:.2f} | {similar:.4f} | {count} | {crossings} | {seconds:.0f} |"
        )
        print(lines[-1], flush=True)
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m bench.ablations", description=__doc__)
    parser.add_argument("out", type=Path, help="folder to work in")
    parser.add_argument("--only", choices=ABLATIONS, action="append", help="may be repeated")
    parser.add_argument("--iterations", type=int, help="of every run, in place of its own")
    args = parser.parse_args()
    found = [table(ABLATIONS[name], args.iterations, args.out) for name in args.only or ABLATIONS]
    print("\n" + "\n\n".join("\n".join(lines) for lines in found))


if __name__ == "__main__":
    main()
