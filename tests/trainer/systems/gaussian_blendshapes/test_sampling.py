"""Where the first Gaussians lie: points on the mesh, and in the mouth."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_runtime.avatar import Rig
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.systems.common.poisson import poisson_disk
from avatar_trainer.systems.gaussian_blendshapes.mouth import Cylinder, find_mouth, mouth_interior
from tests.golden import BlendshapesGolden


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
    a, b, c = vertices[triangles[chosen]].transpose(1, 0, 2)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    assert apart.min() > 0.6 * np.sqrt(area / 700)  # random points come as near as a twentieth of it


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


def test_a_mouth_that_cannot_be_found_can_be_given(rig: Rig) -> None:
    closed = replace(rig, triangles=rig.triangles[~mouth_interior(rig)])
    bare = replace(closed, skin=closed.skin, joint_names=("root", "neck", "chin", "leftEye", "rightEye"))
    with pytest.raises(AvatarError, match="mouth_cylinder"):
        find_mouth(bare)
    given = Cylinder((0.0, -0.03, 0.07), 0.03, 0.02)
    assert find_mouth(bare, given).cylinder == given
