"""The trained tensors of Gaussian Blendshapes, their row sets and learning rates."""

from __future__ import annotations

import torch

from avatar_trainer.parameters.table import Table
from avatar_trainer.systems.gaussian_blendshapes.initial import Start
from avatar_trainer.systems.gaussian_blendshapes.settings import Settings

GAUSSIAN, DELTA = "gaussian", "delta"  # row sets
DELTAS = ("mean", "log_scale", "quat_wxyz", "opacity_logit", "sh")
# Parameter groups of the released optimiser -> tensors of the table.
RATE_OF = {
    "xyz": "mean",
    "f_dc": "sh_dc",
    "f_rest": "sh_rest",
    "opacity": "opacity_logit",
    "scaling": "log_scale",
    "rotation": "quat_wxyz",
    "xyz_b": "delta_mean",
    "f_b": "delta_sh",
    "opacity_b": "delta_opacity_logit",
    "scaling_b": "delta_log_scale",
    "rotation_b": "delta_quat_wxyz",
}


def make_table(settings: Settings, first: Start) -> Table:
    """B_0 and B_m as they begin, and differences of 0 wherever something is learned."""
    g, r, table = first.gaussians, settings.rates, Table()
    own = {
        "mean": (g.mean, r.mean * settings.extent),
        "log_scale": (g.log_scale, r.log_scale),
        "quat_wxyz": (g.quat_wxyz, r.quat_wxyz),
        "opacity_logit": (g.opacity_logit, r.opacity_logit),
        "sh_dc": (g.sh[:, :1], r.sh_dc),
        "sh_rest": (g.sh[:, 1:], r.sh_rest),
    }
    for name, (values, rate) in own.items():
        if values.numel():
            table.add(name, values, rate, GAUSSIAN)
    if settings.rules["deltas"] == "trained":
        for name in DELTAS:
            values = getattr(g, name) if name != "sh" else g.sh[:, : (settings.delta_sh_degree + 1) ** 2]
            rate = getattr(r, f"delta_{name}") * (settings.extent if name == "mean" else 1.0)
            table.add(f"delta_{name}", torch.zeros(first.rows.learned.count, *values.shape[1:]), rate, DELTA)
    return table
