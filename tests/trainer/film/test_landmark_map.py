"""The table of landmarks: on the head model's skin and eyes, even on both sides, and blind to roll and size."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.film.fit.landmark_map import SKIN, features, load, seen_from
from avatar_trainer.head import load_head_model

TIP, FOREHEAD, CHIN, LIPS = 4, 10, 152, (13, 14)
SIDES = ((33, 263), (133, 362), (61, 291), (48, 278), (70, 300), (234, 454), (172, 397), (468, 473))


def test_landmarks_lie_on_the_head() -> None:
    table, head = load(), load_head_model()
    known = {tuple(sorted(row)) for row in head.triangles.tolist()}
    assert all(tuple(sorted(row)) in known for row in table.triangle_corners.tolist())
    assert table.barycentric.min() >= 0
    assert table.barycentric.sum(axis=1) == pytest.approx(1, abs=1e-5)
    assert head.in_part("face", "head")[table.triangle_corners[:SKIN]].all()
    assert head.in_part("left_eye", "right_eye")[table.triangle_corners[SKIN:]].all()
    place = np.einsum("lc,lcx->lx", table.barycentric, head.vertices[table.triangle_corners])
    for right, left in SIDES:
        assert place[right] * (-1, 1, 1) == pytest.approx(place[left], abs=0.005), (right, left)
        assert place[left, 0] > 0.005
    assert place[FOREHEAD, 1] > 0.06 > place[TIP, 1] > place[LIPS[0], 1] > place[CHIN, 1]
    assert place[LIPS[0]] == pytest.approx(place[LIPS[1]], abs=0.006)


def test_corrections_turn_and_grow_with_the_face() -> None:
    table, rng = load(), np.random.default_rng(0)
    face = table.template * 200 + rng.normal(size=(478, 2))
    yaw, pitch, scores = np.array(0.4), np.array(-0.2), rng.uniform(0, 0.5, 52)
    moved = table.corrected(face, yaw, pitch, scores) - face
    assert 0.5 < np.linalg.norm(moved, axis=1).mean() < 8
    turn = matrix_from_rotvec(np.array([0, 0, 0.3]))[:2, :2]
    turned = face @ turn.T * 1.5 + (40, 30)
    assert table.corrected(turned, yaw, pitch, scores) - turned == pytest.approx(moved @ turn.T * 1.5)
    (size, roll), (larger, more) = table.frame(face), table.frame(turned)
    assert (larger / size, more - roll) == (pytest.approx(1.5), pytest.approx(0.3))
    many = table.corrected(np.stack([face] * 3), np.zeros(3), np.zeros(3), np.stack([scores] * 3))
    assert many[1] == pytest.approx(table.corrected(face, np.zeros(()), np.zeros(()), scores))
    beyond = table.corrected(face, np.array(9.0), pitch, scores)
    assert np.abs(beyond - face).max() < 60


def test_what_stays_over_a_film() -> None:
    """An error that never changes is found the better, the longer the film; in the axes of each frame's face."""
    table, rng = load(), np.random.default_rng(1)
    own, faces, away = 2 * rng.normal(size=(478, 2)), [], []
    for angle in np.linspace(-0.4, 0.4, 60):
        turn = matrix_from_rotvec(np.array([0, 0, angle]))[:2, :2]
        faces.append(table.template @ turn.T * 220)
        away.append((own + rng.normal(size=own.shape)) @ turn.T)
    places, errors = np.array(faces), np.array(away)
    left = errors - table.placed(table.of_film(errors, places), places)
    assert np.abs(left).mean() < 0.6 * np.abs(errors).mean()
    few = errors[:1] - table.placed(table.of_film(errors[:1], places[:1]), places[:1])
    assert np.abs(few).mean() > 0.7 * np.abs(left).mean()


def test_weights_follow_mediapipes() -> None:
    table = load()
    scores = np.zeros((2, 52))
    scores[1, table.score_names.index("jawOpen")] = 0.7
    weights, sigma = table.prior(scores, np.zeros(2), np.zeros(2))
    jaw = table.names.index("jawOpen")
    assert weights[0, jaw] < 0.15 < 0.4 < weights[1, jaw]
    assert weights.shape == sigma.shape == (2, 51)
    assert 0 <= weights.min() <= weights.max() <= 1
    assert 0.02 < sigma.min() <= sigma.max() < 0.6


def test_a_turned_face_is_less_certain() -> None:
    table = load()
    straight, *turned = (table.sigma_at(np.radians(angle)) for angle in (0.0, -40.0, 40.0))
    assert all(np.median(sigma / straight) > 1.3 for sigma in turned)
    assert np.median(straight / table.sigma) == pytest.approx(0.8, abs=0.15)
    assert features(np.zeros(3), np.zeros(3), np.zeros((3, 52))).shape == (3, table.weight_matrix.shape[1])


@pytest.mark.parametrize("yaw, pitch", [(0.5, 0.0), (0.0, 0.4), (-0.3, -0.2)])
def test_seen_from(yaw: float, pitch: float) -> None:
    """A camera at the head's left and above it."""
    place = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
    middle, z = np.array([0.0, -0.01, 0.06]), -place
    x = np.cross(z, (0.0, 1, 0))
    rotation = np.stack([x / np.linalg.norm(x), np.cross(z, x / np.linalg.norm(x)), z])
    found = seen_from(rotation, -rotation @ (middle + 0.7 * place))
    assert np.array(found) == pytest.approx([yaw, pitch])
