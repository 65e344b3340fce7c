"""A whole iteration of training: milliseconds by Gaussians and resolution, of both systems.

Splats, image, losses, gradients and optimiser, on a synthetic capture of the head, 50 expressions. One thread, CPU
time; density control stands still.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from samples.capture.head import write_head
from samples.capture.shots import Noise

from avatar_trainer.captures.load import load
from avatar_trainer.captures.targets import Targets
from avatar_trainer.loop.iterate import Trainer
from avatar_trainer.loop.machine import reproducible
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.table import system_module

Row = tuple[str, float, str]
COUNTS, SIZES = (5_000, 10_000, 20_000), (128, 256, 512)
SYSTEMS = ("gaussian_blendshapes", "splatting_avatar")
FRAMES, WARM, ROUNDS = 10, 4, 12


def iteration_rows(folder: Path) -> Iterator[Row]:
    """Median CPU milliseconds of an iteration; captures are made in `folder`."""
    for size in SIZES:
        write_head(folder / f"capture_{size}", size, FRAMES, Noise(0.0, 0.0, 0), (), np.radians(40.0))
        capture = load(folder / f"capture_{size}")
        for name in SYSTEMS:
            for count in COUNTS:
                yield f"iteration_{name}_{count}_at_{size}", milliseconds(name, capture, count), "ms"


def milliseconds(name: str, capture: Any, count: int) -> float:
    """Median CPU time of an iteration once everything is compiled."""
    module = system_module(name)
    settings = replace(module.Settings(), gaussians=count, sh_degree=0, iterations=WARM + ROUNDS)
    run = TrainSettings(iterations=WARM + ROUNDS, threads=1)
    spent = []
    with reproducible(0, 1), Targets(256) as targets:
        trainer = Trainer(module.create(capture, settings, 0), capture, run)
        for iteration in range(1, WARM + ROUNDS + 1):
            target = targets(trainer.frame(iteration))
            began = time.process_time()
            trainer.step(iteration, target)
            spent.append(1000 * (time.process_time() - began))
    return statistics.median(spent[WARM:])
