"""What keeps PSAvatar together in motion that no image shows: reach, smoothing and decay, by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from avatar_runtime.pose import PoseArrays
from avatar_trainer.captures.model import Capture
from avatar_trainer.kernels.smooth import edges_of
from avatar_trainer.systems.psavatar.initial import APART, MOVES, _held_steadily
from avatar_trainer.systems.psavatar.steady import (
    NEAR,
    Motion,
    motion,
    settle,
)
from tests.trainer.systems.psavatar import scene
from tests.trainer.systems.splatting_avatar import scene as sheet

TWO = np.array([[0, 1, 2], [1, 3, 2]], np.uint32)  # a square; vertex 4 is in no triangle
SWING = 2e-3


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    return sheet.blank(tmp_path_factory.mktemp("capture") / "sheet")


def unturned(pose: PoseArrays) -> PoseArrays:
    """Expressions alone: every joint is the identity, so points are compared with the mesh at rest."""
    still = np.tile(np.eye(4), (len(pose.joint_delta), 1, 1))
    return replace(pose, joint_delta=still, world_from_avatar=np.eye(4))


def test_points_within_their_limits_swing_no_further(capture: Capture) -> None:
    system = scene.system_of(capture, acquiring=0.0)
    count, largest = len(capture.rig.triangles), 0.0
    triangle = np.arange(len(system.triangle)) % count
    at = torch.from_numpy(triangle), torch.full_like(system.barycentric, 1 / 3), system.off_mesh
    for pose in (unturned(frame.pose) for frame in capture.train):
        seen = motion(capture.rig, [pose])
        limit = np.minimum(seen.limit(triangle, np.zeros(len(triangle)), SWING), 0.5)
        assert seen.swing(triangle, limit) == pytest.approx(
            seen.moved[triangle] + limit * seen.turned[triangle], rel=1e-6
        )
        system._place(*at, torch.from_numpy(limit))
        with torch.no_grad():
            system.table["displacement"].copy_(torch.from_numpy(limit))
        rest = replace(pose, expression_weights=0 * pose.expression_weights)
        moved = (system.splats(pose).mean - system.splats(rest).mean).detach().norm(dim=1)
        allowed = np.maximum(SWING, 1.5 * seen.moved[triangle]) + 1e-5
        beyond = limit > NEAR
        assert (moved.numpy()[beyond] < allowed[beyond]).all()
        largest = max(largest, float(moved[beyond].max()))
    assert largest > SWING / 2  # the bound is no larger than it must be


def test_bases_go_towards_the_mean_of_their_neighbours_and_to_0() -> None:
    bases = torch.from_numpy(np.random.default_rng(0).normal(size=(3, 5, 3)).astype(np.float32))
    before = bases.double().numpy()
    settle(bases, edges_of(TWO, 5), 0.25, 0.9)
    around = {0: (1, 2), 1: (0, 2, 3), 2: (0, 1, 3), 3: (1, 2)}
    for vertex in range(5):
        mean = before[:, list(around[vertex])].mean(1) if vertex in around else before[:, vertex]
        wanted = 0.75 * before[:, vertex] + 0.25 * mean
        length = np.linalg.norm(wanted, axis=1, keepdims=True)
        shorter = wanted * np.maximum(length - 0.9, 0) / length
        assert np.abs(bases[:, vertex].numpy() - shorter).max() < 1e-6
    zero = (bases == 0).all(dim=2)
    assert zero.any() and not zero.all()


def test_what_images_do_not_need_off_the_mesh_fades_and_is_removed(capture: Capture) -> None:
    system = scene.system_of(capture, acquiring=0.0, off_mesh=0.5, thin=0.2, iterations=8)
    step = scene.trainer_of(system).step(1, scene.read(capture.train[0]))
    opacity = system.table["opacity_logit"].detach().sigmoid()
    assert step.terms["thin"] == pytest.approx(
        0.2 * 0.1 * 0.5, rel=1e-3
    )  # they begin at 0.1; half are off the mesh
    with torch.no_grad():
        system.table["opacity_logit"][: len(opacity) // 3] = -6.0
    for iteration in range(2, 9):
        system.after_step(iteration, torch.Generator())
        assert len(system.triangle) == len(opacity) - (len(opacity) // 3) * (iteration >= 6)


def test_nothing_is_held_from_elsewhere_close_to_what_moves(capture: Capture) -> None:
    rig, f = capture.rig, len(capture.rig.triangles)
    triangle, thirds = np.full(2, f // 2), np.full((2, 3), 1 / 3)
    at = triangle, thirds, APART + np.array([-5e-4, 5e-4])
    for moved, first in ((2 * MOVES, 1), (MOVES / 2, 0)):
        motion = Motion(np.full(f, moved), np.zeros(f))
        _, _, distance = _held_steadily(rig, np.arange(f), at, motion, 1, None)
        assert distance == pytest.approx(at[2][first : first + 1], rel=1e-3)
