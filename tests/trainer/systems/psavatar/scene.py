"""PSAvatar on the sheet of splatting_avatar_scene: settings, a run of some iterations, and the paper's formulas."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import torch

from avatar_runtime.pose import PoseArrays
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.targets import read
from avatar_trainer.loop.iterate import Trainer
from avatar_trainer.settings import TrainSettings
from avatar_trainer.systems.psavatar.system import PSAvatar, Settings, create
from tests.oracles.lbs import posed_vertices, rodrigues
from tests.trainer.systems.splatting_avatar import scene as sheet

Array = npt.NDArray[Any]
FLOOR = 1e-6 / 4**2  # of vertex normals: an area in training units, 4 a metre
TURNS = 4 * 9  # entries of R - I of the four joints after the root


def settings(**values: Any) -> Settings:
    """Small ones, with rules given beside them."""
    plain = Settings(iterations=12, gaussians=90, acquiring=0.5, removals=2, sh_degree=1, sh_degree_every=3)
    rules = {name: values.pop(name) for name in plain.rules if name in values}
    return replace(plain, rules={**plain.rules, **rules}, **values)


def system_of(capture: Capture, **values: Any) -> PSAvatar:
    return create(capture, settings(**values), 0)


def trainer_of(system: PSAvatar) -> Trainer:
    return Trainer(system, system.capture, TrainSettings(iterations=system.settings.iterations, seed=3))


def run(trainer: Trainer, first: int, last: int) -> None:
    """The iterations `first` to `last`."""
    for iteration in range(first, last + 1):
        trainer.step(iteration, read(trainer.frame(iteration)))


def as_gaussians(capture: Capture, seed: int = 1, **values: Any) -> PSAvatar:
    """An avatar of Gaussians, none of whose values is at its start."""
    system = system_of(capture, acquiring=0.0, **values)
    generator = torch.Generator().manual_seed(seed)
    sizes = {"bases": 3e-3, "displacement": 5e-3, "rotation": 0.7, "log_scale": 0.3, "sh_dc": 1.0}
    with torch.no_grad():
        for name in (*sizes, "sh_rest", "opacity_logit"):
            if name in system.table:
                tensor = system.table[name]
                tensor.add_(sizes.get(name, 0.3) * torch.randn(tensor.shape, generator=generator))
        system.sh_degree = system.settings.sh_degree
    return system


def dense_bases(system: PSAvatar) -> tuple[Array, Array]:
    """(P' [V, 3, 36], E' [V, 3, 1]) float64 of what a system has learned."""
    used, bases = system.used.numpy(), system.table["bases"].detach().double().numpy()
    dense = np.zeros((TURNS + 1, *bases.shape[1:]))
    dense[used] = bases
    moved = np.moveaxis(dense, 0, 2)
    return moved[:, :, :TURNS], moved[:, :, TURNS:]


def rotation_vectors(pose: PoseArrays) -> Array:
    """[J, 3] of joints turned by less than half a turn."""
    found = []
    for matrix in pose.joint_delta[:, :3, :3]:
        angle = np.arccos(np.clip((np.trace(matrix) - 1) / 2, -1, 1))
        axis = np.array(
            [matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]]
        )
        found.append(axis * (angle / (2 * np.sin(angle)) if angle else 0.5))
    return np.array(found)


def mesh(pose: PoseArrays, pose_basis: Array, expression_basis: Array) -> Array:
    """[V, 3] metres, Eqs. 4 to 6: joints see the body model's expressions and nothing of what was learned."""
    model = sheet.body()
    corrected = {**model, "posedirs": model["posedirs"].astype(np.float64) + pose_basis}
    return posed_vertices(
        corrected,
        np.zeros(1),
        pose.expression_weights,
        rotation_vectors(pose),
        np.zeros(3),
        unseen_by_joints=expression_basis @ pose.expression_weights.astype(np.float64),
    )


def joint_turns(pose: PoseArrays) -> Array:
    """[J, 4, 4] whose rotations are those of the skin matrices."""
    model, found = sheet.body(), np.zeros((5, 4, 4))
    for j, vector in enumerate(rotation_vectors(pose)):
        parent = model["parents"][j]
        before = np.eye(3) if parent < 0 else found[parent, :3, :3]
        found[j, :3, :3] = before @ rodrigues(vector)
    return found
