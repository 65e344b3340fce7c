"""A tiny system and a capture for it: a cloud of splats that no pose moves, fitted to images of such a cloud.

`python -m tests.trainer.train_toy` is `avatar-train` with this system beside the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import torch
from torch import Generator, Tensor

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_runtime.pose import PoseArrays
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.own import Shot, write
from avatar_trainer.losses import l1
from avatar_trainer.parameters.densify import SPLIT_SHRINK, Density, DensitySettings
from avatar_trainer.parameters.table import Table
from avatar_trainer.raster.renderer import render
from avatar_trainer.settings import Rule, rule_defaults
from avatar_trainer.systems.table import SYSTEMS
from avatar_trainer.tensors import Rendered, Splats
from tests.trainer.captures.folders import body_folder

SIZE = 40
FOCAL = 55.0
DISTANCE = 1.2
RULES = {"sky": Rule(("random", "black"), "random", "black", "random", "what is behind the cloud")}


@dataclass(frozen=True)
class Settings:
    """Of the toy."""

    iterations: int = 60
    gaussians: int = 40
    sh_degree: int = 0
    learning_rate: float = 0.02
    poison: int = 0  # the iteration whose loss is NaN
    rules: Mapping[str, str] = field(default_factory=lambda: rule_defaults(RULES))
    density: DensitySettings = field(
        default_factory=lambda: DensitySettings(
            densify_from=5, densify_until=60, densify_every=10, opacity_reset_every=1000, max_gaussians=80
        )
    )

    def __post_init__(self) -> None:
        if self.learning_rate <= 0:
            raise ValueError("learning_rate must be above 0")


def create(capture: Capture, settings: Settings, seed: int) -> Toy:
    return Toy(capture, settings, seed)


class Toy:
    """A System."""

    name: ClassVar[str] = "toy"
    training_per_bundle = 1.0

    def __init__(self, capture: Capture, settings: Settings, seed: int) -> None:
        self.capture, self.settings, self.sh_degree = capture, settings, settings.sh_degree
        self.table = Table()
        for name, values in cloud(settings.gaussians, seed).items():
            self.table.add(name, values, settings.learning_rate, "cloud")
        self.density = Density(settings.gaussians)

    def splats(self, pose: PoseArrays) -> Splats:
        t = self.table
        return activated({name: t[name] for name in t})

    def background(self, generator: Generator) -> Tensor:
        random = torch.rand(3, generator=generator)
        return random if self.settings.rules["sky"] == "random" else torch.zeros(3)

    def losses(self, rendered: Rendered, target: Tensor, mask: Tensor, iteration: int) -> dict[str, Tensor]:
        wrong = float("nan") if iteration == self.settings.poison else 1.0
        return {"l1": l1(rendered.colour, target) * wrong, "alpha": (rendered.alpha - mask).square().mean()}

    def observe(self, rendered: Rendered, screen_gradient: Tensor) -> None:
        self.density.observe(rendered.radius, screen_gradient)

    def before_step(self, iteration: int) -> None:
        self.table.learning_rate("mean", self.settings.learning_rate * 0.99**iteration)

    def after_step(self, iteration: int, generator: Generator) -> None:
        if not self.settings.density.due(iteration):
            return
        t = self.table
        plan = self.density.plan(self.settings.density, t["log_scale"], t["opacity_logit"], 1.0)
        index, fresh = plan.rows()
        t.take("cloud", index, fresh)
        copies = 2 * len(plan.split)
        with torch.no_grad():
            if copies:
                spread = t["log_scale"][-copies:].exp()
                t["mean"][-copies:] += spread * torch.randn(copies, 3, generator=generator)
                t["log_scale"][-copies:] -= float(np.log(SPLIT_SHRINK))
        self.density.reset(t.count("cloud"))

    def state(self) -> dict[str, Any]:
        return {"table": self.table.state(), "density": self.density.state()}

    def load_state(self, state: dict[str, Any]) -> None:
        self.table.load_state(state["table"])
        self.density.load_state(state["density"], self.table.count("cloud"))

    def save(self, folder: Path, iteration: int) -> None:
        values = {name: self.table[name].detach().numpy() for name in self.table}
        np.savez(folder / f"toy{iteration}.npz", **values)


def cloud(count: int, seed: int) -> dict[str, Tensor]:
    """Some splats within a hand's breadth of the origin."""
    g = torch.Generator().manual_seed(seed)
    return {
        "mean": torch.randn(count, 3, generator=g) * 0.12,
        "log_scale": torch.randn(count, 3, generator=g) * 0.2 - 3,
        "quat_wxyz": torch.randn(count, 4, generator=g),
        "opacity_logit": torch.randn(count, generator=g),
        "sh": torch.randn(count, 1, 3, generator=g),
    }


def activated(values: Mapping[str, Tensor]) -> Splats:
    return Splats(
        values["mean"],
        values["log_scale"].exp(),
        torch.nn.functional.normalize(values["quat_wxyz"], dim=1),
        values["opacity_logit"].sigmoid(),
        values["sh"],
    )


def capture_folder(folder: Path, count: int = 12, size: int = SIZE) -> Path:
    """A capture of the layout of CAPTURE.md: another cloud from places around it."""
    body_folder(folder / "body")
    splats = activated(cloud(60, 99))
    k = np.array([[FOCAL, 0, size / 2], [0, FOCAL, size / 2], [0, 0, 1]]) * (size / SIZE)
    k[2, 2] = 1
    body = {"kind": "body_model", "model": "body/body_model.npz", "shape": "body/shape.npy"}
    frames = ((f"{t:03d}", _shot(splats, t, count, k, size)) for t in range(count))
    write(
        folder, name="toy", fps=25, head_pose_in="camera", expressions=("exp_000",), body=body, frames=frames
    )
    return folder


def _shot(splats: Splats, t: int, count: int, k: np.ndarray[Any, Any], size: int) -> Shot:
    turn = 2 * np.pi * t / count
    rotation = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    place = np.array([0, 0, DISTANCE])
    camera = Camera.from_opencv(rotation, place, k, size, size)
    drawn = render(splats, camera, RasterSettings(), 0, torch.zeros(3), "cpu")
    alpha = drawn.alpha.clamp(0, 1)
    straight = (drawn.colour / alpha.clamp(min=1e-3)[:, :, None]).clamp(0, 1)
    image, mask = (np.rint(x.numpy() * 255).astype(np.uint8) for x in (straight, alpha))
    return Shot(image, mask, k, rotation, place, [0.0], split="test" if t % 4 == 3 else "train")


def main() -> None:
    """avatar-train with this system."""
    SYSTEMS["toy"] = "tests.trainer.toy"
    from avatar_trainer.cli import main  # makes a command of each system that there is now

    main()
