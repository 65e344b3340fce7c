"""Where the first Gaussians lie: points on the mesh, and in the mouth."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_runtime.avatar import Rig
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.systems.common.poisson import neighbour_distance, poisson_disk
from avatar_trainer.systems.gaussian_blendshapes.initial import dense
from avatar_trainer.systems.gaussian_blendshapes.mouth import Cylinder, find_mouth, mouth_interior
from tests.golden import BlendshapesGolden

Array = npt.NDArray[Any]
K = 50


def test_samples_lie_apart_on_the_mesh(rig: Rig) -> None:
    vertices, triangles = rig.vertices.astype(np.float64), rig.triangles.astype(np.int64)
    chosen = np.flatnonzero(~mouth_interior(rig))
    samples = poisson_disk(vertices, triangles, chosen, 700, np.random.default_rng(3))
    assert len(samples.position) == 700 and np.isin(samples.triangle, chosen).all()
    assert (samples.barycentric >= 0).all() and np.abs(samples.barycentric.sum(axis=1) - 1).max() < 1e-12
    assert np.abs(samples.interpolate(vertices, triangles) - samples.position).max() < 1e-12
    corner = vertices[triangles[samples.triangle]]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    apart = np.linalg.norm(samples.position[:, None] - samples.position, axis=2)
    apart[np.eye(700, dtype=bool) | (normal @ normal.T <= 0)] = np.inf
    corners = vertices[triangles[chosen]]
    area = (
        np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()
        / 2
    )
    assert apart.min() > 0.6 * np.sqrt(area / 700)  # random points come as near as a twentieth of it
    again = poisson_disk(vertices, triangles, chosen, 700, np.random.default_rng(3))
    assert np.array_equal(again.position, samples.position)


def test_the_two_sides_of_a_sheet_do_not_repel_each_other() -> None:
    square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    vertices = np.concatenate([square, square - (0, 0, 1e-6)])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [5, 4, 6], [6, 4, 7]])
    samples = poisson_disk(vertices, triangles, np.arange(4), 200, np.random.default_rng(0))
    front = samples.triangle < 2
    assert 85 < front.sum() < 115
    nearest = np.linalg.norm(samples.position[front, None, :2] - samples.position[front, :2], axis=2)
    np.fill_diagonal(nearest, 9)
    assert nearest.min() > 0.06


def test_distance_to_three_neighbours() -> None:
    points = np.random.default_rng(0).normal(size=(50, 3))
    far = np.sort(np.linalg.norm(points[:, None] - points, axis=2), axis=1)[:, 1:4]
    assert neighbour_distance(points) == pytest.approx(np.sqrt((far**2).mean(axis=1)))
    assert neighbour_distance(points[:2]) == pytest.approx(np.full(2, np.linalg.norm(points[0] - points[1])))
    assert neighbour_distance(points[:1]).tolist() == [0]


def test_the_meshs_teeth_are_the_mouth(rig: Rig, blendshapes_golden: BlendshapesGolden) -> None:
    body = blendshapes_golden.body_model()
    parts = body["part_names"][body["face_part"]]
    inside = np.isin(parts, ["M_Teeth", "M_GumsTongue"])
    assert np.array_equal(mouth_interior(rig), inside)
    mouth = find_mouth(rig)
    assert len(mouth.upper) + len(mouth.lower) == inside.sum()
    teeth = rig.vertices[rig.triangles[parts == "M_Teeth"]].mean(axis=1)
    assert mouth.upper[..., 1].mean() > np.median(teeth[:, 1]) > mouth.lower[..., 1].mean()
    x, _, z = mouth.cylinder.centre
    across = np.hypot(*(rig.vertices[rig.triangles[inside]].reshape(-1, 3)[:, [0, 2]] - (x, z)).T)
    assert abs(x) < 1e-3 and across.max() <= mouth.cylinder.radius < 0.07


def flame_like(rig: Rig) -> Rig:
    """The rig's head alone, with a hole where the lips meet: triangles across the mouth's line are gone."""
    head = rig.triangles[~mouth_interior(rig)]
    jaw = dense(rig.skin, "weight")[:, rig.joint_names.index("jaw")]
    lips = (
        (np.abs(rig.vertices[:, 0]) < 0.02)
        & (rig.vertices[:, 2] > 0.09)
        & (np.abs(rig.vertices[:, 1] + 0.04) < 0.02)
    )
    across = np.ptp(jaw[head], axis=1) > 0.25
    return replace(rig, triangles=head[~(across & lips[head].any(axis=1))])


def test_billboards_stand_behind_the_lips_of_a_mesh_without_teeth(rig: Rig) -> None:
    mouth, teeth = find_mouth(flame_like(rig)), find_mouth(rig)
    assert mouth.upper.shape == mouth.lower.shape == (2, 3, 3)
    low, high = teeth.upper.min(axis=(0, 1)), teeth.lower.max(axis=(0, 1))
    assert np.linalg.norm(np.subtract(mouth.cylinder.centre, teeth.cylinder.centre)) < 0.03
    assert mouth.upper[..., 1].min() == pytest.approx(mouth.lower[..., 1].max())
    assert np.ptp(mouth.upper[..., 2]) == 0 and low[2] < mouth.upper[0, 0, 2] < high[2] + 0.01
    corner = np.abs(np.concatenate([mouth.upper, mouth.lower]).reshape(-1, 3) - mouth.cylinder.centre)
    assert np.hypot(corner[:, 0], corner[:, 2]).max() < mouth.cylinder.radius
    assert corner[:, 1].max() < mouth.cylinder.half_height


def test_a_mouth_that_cannot_be_found_can_be_given(rig: Rig) -> None:
    closed = replace(rig, triangles=rig.triangles[~mouth_interior(rig)])
    bare = replace(closed, skin=closed.skin, joint_names=("root", "neck", "chin", "leftEye", "rightEye"))
    with pytest.raises(AvatarError, match="mouth_cylinder"):
        find_mouth(bare)
    given = Cylinder((0.0, -0.03, 0.07), 0.03, 0.02)
    assert find_mouth(bare, given).cylinder == given
