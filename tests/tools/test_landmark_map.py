"""The tool that makes the table of landmarks, on pictures whose landmarks are made up: known points, a known error."""

from __future__ import annotations

import numpy as np
import pytest
from tools.landmark_map import fit
from tools.landmark_map.faces import SIZE, Faces, turn
from tools.landmark_map.table import score_names

from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.film.fit.landmark_map import load, seen_from
from avatar_trainer.head import load_head_model

COUNT, PEOPLE = 150, 10
BY_YAW = 0.04  # sizes of the face by radian


def made_up(seed: int) -> Faces:
    """The points of the table that ships, moved aside by the yaw, with noise; a part of it by person."""
    head, table, rng = load_head_model(), load(), np.random.default_rng(seed)
    person, films = np.arange(COUNT) % PEOPLE, 0.01 * rng.normal(size=(PEOPLE, 478, 2))
    rotation = np.stack([turn(rng) for _ in range(COUNT)])
    translation = np.array([0, 0, 0.8]) + 0.02 * rng.normal(size=(COUNT, 3))
    shape = head.vertices + np.tensordot(0.5 * rng.normal(size=(COUNT, 3)), head.identity[:3], 1)
    x = np.einsum("nij,nvj->nvi", rotation, shape) + translation[:, None]
    pixels = 600 * x[..., :2] / x[..., 2:] + SIZE / 2
    points = np.einsum("nlcx,lc->nlx", pixels[:, table.triangle_corners], table.barycentric)
    yaw, _ = seen_from(rotation, translation)
    error = films[person] + 0.01 * rng.normal(size=points.shape)
    error[..., 0] += BY_YAW * yaw[:, None]
    size, roll = table.frame(points)
    spin = matrix_from_rotvec(np.stack([0 * roll, 0 * roll, roll], axis=1))[:, :2, :2]
    points += np.einsum("nxy,nly->nlx", spin, error) * size[:, None, None]
    depth = np.zeros((COUNT, 478, 1))
    return Faces(
        identity=person,
        skin=person,
        weights=np.zeros((COUNT, 51)),
        rotation=rotation,
        translation=translation,
        focal=np.full(COUNT, 600.0),
        pixels=pixels,
        landmarks=np.concatenate([points, depth], axis=2),
        scores=rng.uniform(0, 1, (COUNT, 52)),
        matrix=np.tile(np.eye(4), (COUNT, 1, 1)),
    )


def test_points_and_their_error_are_found_again() -> None:
    head, faces = load_head_model(), made_up(0)
    seen = fit.upright(faces)
    corners, bary = fit.surface_points(seen, faces, head)
    found, put = (
        np.einsum("lc,lcx->lx", b, head.vertices[c])
        for c, b in ((corners, bary), (load().triangle_corners, load().barycentric))
    )
    assert np.median(np.linalg.norm(found - put, axis=1)) < 0.004
    error = fit.errors(seen, corners, bary)
    table = fit.correction(seen.inputs, error)
    left = error - fit.predicted(table, seen.inputs)
    assert np.abs(left).mean() < 0.8 * np.abs(error).mean()
    by_pose = fit.Upright(seen.template, seen.landmarks, seen.vertices, seen.inputs[:, :3])
    assert np.median(fit.film_share(by_pose, faces, error)) == pytest.approx(0.5, abs=0.1)


def test_names_are_apples() -> None:
    assert score_names()[0] == "_neutral"
    assert set(load().names) < set(score_names())


def test_weights_are_predicted_with_their_deviation() -> None:
    rng = np.random.default_rng(3)
    given = rng.uniform(0, 1, (4000, 1))
    true = given + rng.normal(size=given.shape) * np.sqrt(0.01 + 0.05 * given)
    assert fit.weight_variance(given, true)[0] == pytest.approx([0.01, 0.05], rel=0.15)
