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
from avatar_trainer.kernels.neighbours import nearest_others
from avatar_trainer.kernels.smooth import edges_of
from avatar_trainer.systems.psavatar.initial import sample_points
from avatar_trainer.systems.psavatar.steady import (
    MOST_STRETCH,
    NEAR,
    Motion,
    _holders,
    motion,
    settle,
    steadiest,
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


def test_the_steadiest_are_kept_everywhere() -> None:
    """A tenth of each half of a cloud, although one half swings a hundred times as far as the other."""
    rng = np.random.default_rng(4)
    place = rng.uniform(size=(4000, 3))
    swing = rng.uniform(1, 2, 4000) * np.where(place[:, 0] > 0.5, 100.0, 1.0)
    kept = steadiest(place, swing, 0.1)
    for half in (place[:, 0] > 0.6, place[:, 0] < 0.4):
        assert 0.07 < kept[half].mean() < 0.13
        assert swing[half & kept].max() < np.median(swing[half])


def test_points_are_drawn_where_the_mesh_holds_still(capture: Capture) -> None:
    """Every second triangle turns; the points off the mesh are on the others, whose normals lead to the same places."""
    rig = capture.rig
    turned = np.where(np.arange(len(rig.triangles)) % 2, 1.0, 0.0)
    found = sample_points(
        rig,
        "all",
        2000,
        0.5,
        0.03,
        np.ones(len(rig.triangles)),
        np.ones(len(rig.triangles)),
        np.random.default_rng(0),
        Motion(0 * turned, turned),
    )
    assert len(found.triangle) == 2000 and found.off_mesh.sum() == 1000
    far = found.off_mesh & (found.displacement > 0.005)
    assert (turned[found.triangle[far]] == 0).mean() > 0.95
    assert (turned[found.triangle[~found.off_mesh]] == 0).mean() < 0.6


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


def test_bases_go_towards_the_mean_of_their_neighbours() -> None:
    bases = torch.from_numpy(np.random.default_rng(0).normal(size=(3, 5, 3)).astype(np.float32))
    before = bases.double().numpy()
    settle(bases, edges_of(TWO, 5), 0.25, 0.1)
    around = {0: (1, 2), 1: (0, 2, 3), 2: (0, 1, 3), 3: (1, 2)}
    for vertex in range(5):
        mean = before[:, list(around[vertex])].mean(1) if vertex in around else before[:, vertex]
        wanted = 0.9 * (0.75 * before[:, vertex] + 0.25 * mean)
        assert np.abs(bases[:, vertex].numpy() - wanted).max() < 1e-6


@pytest.mark.parametrize(
    "values", [{"smoothing": 0.05}, {"decay": 0.01}, {}], ids=lambda v: next(iter(v), "none")
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


def test_the_nearest_others_are_those_of_all_distances() -> None:
    place = np.random.default_rng(1).normal(size=(60, 3))
    apart = np.linalg.norm(place[:, None] - place, axis=2) + np.diag(np.full(60, np.inf))
    assert np.array_equal(nearest_others(place, 8), np.argsort(apart, axis=1)[:, :8])
    assert nearest_others(place[:3], 8).shape == (3, 2)
    assert nearest_others(place[:1], 8).shape == (1, 0)


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
