"""Small subjects of Gaussian Blendshapes: a random body in FLAME's layout, with every field at work."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch

from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture
from avatar_trainer.parameters.densify import DensitySettings
from avatar_trainer.settings import rule_defaults
from avatar_trainer.systems.gaussian_blendshapes.system import RULES, GaussianBlendshapes, Settings, create
from tests.trainer.captures.folders import own

FACE, MOUTH = 60, 7
# Sizes of random values beside the first ones, by tensor of the table.
NOISE = {"mean": 0.02, "opacity_logit": 2.0, "delta_mean": 0.01, "delta_opacity_logit": 1.0}
DENSITY = DensitySettings(
    densify_from=1,
    densify_until=100,
    densify_every=2,
    gradient_threshold=1e-9,
    percent_dense=0.2,
    min_opacity=0.0,
)


def capture(folder: Path) -> Capture:
    """The small capture of own layout: jaw and neck turn, lids close, the head moves."""
    return load(own(folder / "capture"))


def settings(rules: dict[str, str] | None = None, **changed: Any) -> Settings:
    """Few Gaussians, two SH degrees, a mouth given by its cylinder."""
    fields: dict[str, Any] = {
        "iterations": 20,
        "gaussians": FACE,
        "mouth_gaussians": MOUTH,
        "expressions": 3,
        "sh_degree": 1,
        "delta_sh_degree": 1,
        "sh_every": 3,
        "mouth_cylinder": (0.1, -0.05, 0.02, 0.2, 0.1),
        "colours": "grey",
        "unseen": 1.0,
        "density": DENSITY,
        "rules": rule_defaults(RULES) | (rules or {}),
    }
    return Settings(**(fields | changed))


def shaken(system: GaussianBlendshapes, seed: int = 3) -> GaussianBlendshapes:
    """The system with random values added to every tensor of its table, and all SH degrees in use."""
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for name in system.table:
            values = system.table[name]
            values += NOISE.get(name, 0.2) * torch.randn(values.shape, generator=generator)
    system.sh_degree = system.settings.sh_degree
    return system


def subject(folder: Path, rules: dict[str, str] | None = None, **changed: Any) -> GaussianBlendshapes:
    """A shaken system on the small capture."""
    return shaken(create(capture(folder), settings(rules, **changed), 0))
