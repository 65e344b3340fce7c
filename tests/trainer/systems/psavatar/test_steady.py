"""What keeps PSAvatar together in motion that no image shows: reach, smoothing and decay, by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import torch

from avatar_runtime.pose import PoseArrays
from avatar_runtime.posed import posed_mesh
from avatar_runtime.stages.joints import joints
from avatar_trainer.captures.model import Capture
from avatar_trainer.kernels.smooth import edges_of
from avatar_trainer.systems.psavatar.initial import APART, ITS_OWN, MOVES, _held_steadily, sample_points
from avatar_trainer.systems.psavatar.steady import (
    MOST_STRETCH,
    NEAR,
    Motion,
    _holders,
    motion,
    settle,
    stretch,
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
    """By the system itself: what stands off by `limit` moves by at most the swing, against the mesh at rest."""
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


def test_without_a_swing_points_stand_anywhere(capture: Capture) -> None:
    system = scene.system_of(capture, acquiring=0.0, swing=0.0)
    assert system.motion is None and torch.isinf(system.limit).all()


def test_what_a_leaf_holds_is_counted_against_its_parent(capture: Capture) -> None:
    rig = capture.rig
    leaves = set(range(rig.joint_count)) - set(map(int, rig.parents))
    assert leaves and not leaves & set(_holders(rig).tolist())


def test_what_stands_off_a_mesh_that_turns_is_held_from_behind(capture: Capture) -> None:
    """A sheet that turns, and one behind it that holds still, whose normals lead to the same places."""
    rig, f = capture.rig, len(capture.rig.triangles)
    behind = rig.vertices - np.array([0, 0, 0.02], np.float32)
    two = replace(
        rig,
        vertices=np.concatenate([rig.vertices, behind]),
        triangles=np.concatenate([rig.triangles, rig.triangles + len(behind)]),
    )
    turned = np.repeat([1.0, 0.0], f)
    front = np.repeat([1.0, 0.0], f)  # nothing is drawn behind
    how = (two, "all", 2000, 0.5, 0.03, front, np.ones(2 * f), np.random.default_rng(0))
    found = sample_points(*how, Motion(0 * turned, turned))
    assert len(found.triangle) == 2000 and found.off_mesh.sum() == 1000
    still = turned[found.triangle] == 0
    near = found.displacement <= ITS_OWN
    assert not still[near].any() and (near & found.off_mesh).any()
    assert still[~near].mean() > 0.9
    assert ((found.displacement[still] > 0.02) & (found.displacement[still] < 0.06)).all()
    assert found.barycentric.min() >= 0
    shown = sample_points(*how, Motion(0 * turned, turned), shown=lambda triangle, *_: triangle < f // 4)
    drawn = shown.triangle[shown.off_mesh & (shown.displacement <= ITS_OWN)]
    assert len(drawn) and (drawn < f // 4).all()


def test_nothing_is_held_from_elsewhere_close_to_what_moves(capture: Capture) -> None:
    """Of a place a little nearer than APART to a moving triangle and one a little farther, the second is kept."""
    rig, f = capture.rig, len(capture.rig.triangles)
    triangle, thirds = np.full(2, f // 2), np.full((2, 3), 1 / 3)
    at = triangle, thirds, APART + np.array([-5e-4, 5e-4])
    for moved, first in ((2 * MOVES, 1), (MOVES / 2, 0)):
        motion = Motion(np.full(f, moved), np.zeros(f))
        _, _, distance = _held_steadily(rig, np.arange(f), at, motion, 1, None)
        assert distance == pytest.approx(at[2][first : first + 1], rel=1e-3)


def test_points_stay_within_their_limits(capture: Capture) -> None:
    system = scene.system_of(capture, acquiring=0.0, off_mesh=0.5)
    system.limit = torch.full_like(system.limit, 0.004)
    with torch.no_grad():
        system.table["displacement"].copy_(torch.linspace(-0.02, 0.02, len(system.limit)))
    scene.run(scene.trainer_of(system), 1, 1)
    assert system.table["displacement"].detach().abs().max() <= 0.004
    again = scene.system_of(capture, acquiring=0.0, off_mesh=0.5)
    again.load_state(system.state())
    assert torch.equal(again.limit, system.limit)


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


@pytest.mark.parametrize(
    "values", [{"smoothing": 0.05}, {"decay": 1e-3}, {}], ids=lambda v: next(iter(v), "none")
)
def test_bases_settle_every_tenth_iteration(capture: Capture, values: dict[str, float]) -> None:
    system = scene.system_of(capture, acquiring=0.0, **{"smoothing": 0.0, "decay": 0.0, **values})
    bases = torch.randn(system.table["bases"].shape, generator=torch.Generator().manual_seed(0))
    system.table.set("bases", bases)
    for iteration in range(1, 10):
        system._hold_together(iteration)
    assert torch.equal(system.table["bases"], bases)
    system._hold_together(10)
    assert torch.equal(system.table["bases"], bases) == (not values)
    assert system.table["bases"].detach().norm() <= bases.norm()


def test_stretch_is_the_largest_area_over_that_at_rest(capture: Capture) -> None:
    rig, poses = capture.rig, [unturned(frame.pose) for frame in capture.train]
    still = replace(poses[0], expression_weights=np.zeros_like(poses[0].expression_weights))
    assert stretch(rig, [still]) == pytest.approx(1, abs=1e-5)

    def area(pose: PoseArrays) -> np.ndarray:  # Heron's formula, of the lengths of the edges
        corner = posed_mesh(rig, pose, joints(rig, pose)).astype(np.float64)[rig.triangles]
        a, b, c = (np.linalg.norm(corner[:, i] - corner[:, j], axis=1) for i, j in ((0, 1), (1, 2), (2, 0)))
        half = (a + b + c) / 2
        return np.sqrt(np.maximum(half * (half - a) * (half - b) * (half - c), 0))

    want = np.max([area(pose) / area(still) for pose in [*poses, still]], axis=0).clip(1, MOST_STRETCH)
    assert want.max() > 1.001
    assert stretch(rig, poses) == pytest.approx(want, rel=1e-3)


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
