"""Scans that are made of ICT's identity shapes, and the take of expressions in turn."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from samples.asm.data import TOPOLOGIES, AsmHead, load_asm_head, main
from samples.asm.face import HOLD, RISE, in_turn
from samples.asm.scans import HOLE_RADIUS, coefficients, person_scan, seen

from avatar_export.asm.files import load
from avatar_export.asm.model import Take
from avatar_trainer.asm.align import KEYPOINTS, in_face
from avatar_trainer.asm.kernels.closest import nearest, triangle_tree


@pytest.fixture(scope="module")
def ict() -> AsmHead:
    return load_asm_head("ict")


@pytest.fixture(scope="module")
def front(ict: AsmHead) -> np.ndarray:
    return seen(ict)


def test_a_scan_is_of_the_other_persons_surface_and_of_no_vertex(ict: AsmHead, front: np.ndarray) -> None:
    vertices = ict.scan(coefficients(3, 20)).astype(np.float64)
    scan = person_scan(ict, front, vertices, 3, points=2000)
    tree = triangle_tree(vertices, ict.template.triangles)
    found = nearest(scan.points, vertices, tree)
    assert np.sqrt(found.squared_distance).max() < 1e-9
    assert (found.barycentric.max(axis=1) > 0.999).mean() < 0.01
    still = ict.template.vertices.astype(np.float64)
    assert np.sqrt(nearest(scan.points, still, tree).squared_distance).mean() > 1e-3
    for name, landmark in KEYPOINTS.items():
        np.testing.assert_array_equal(scan.keypoints[name], vertices[ict.template.landmarks[landmark]])
    assert len(in_face(scan.points, scan.keypoints)) > 0.5 * len(scan.points)


def test_what_is_seen_from_the_front_is_no_socket(ict: AsmHead, front: np.ndarray) -> None:
    vertices, rows = ict.template.vertices, ict.template.triangles[front]
    middle = vertices[rows].mean(axis=1)
    nose = vertices[ict.template.landmarks["ibug_30"]]
    mouth = vertices[[ict.template.landmarks[f"ibug_{k}"] for k in range(60, 68)]].mean(axis=0)
    behind_lips = (np.abs(middle - mouth) < (0.015, 0.01, 1)).all(axis=1) & (middle[:, 2] < mouth[2] - 0.012)
    assert not behind_lips.any()
    assert np.linalg.norm(middle - nose, axis=1).min() < 0.005


def test_noise_and_holes_are_as_asked(ict: AsmHead, front: np.ndarray) -> None:
    vertices = ict.scan(coefficients(1, 20)).astype(np.float64)
    clean = person_scan(ict, front, vertices, 5, points=4000)
    noisy = person_scan(ict, front, vertices, 5, points=4000, noise_mm=0.5)
    assert np.std(noisy.points - clean.points) == pytest.approx(0.5e-3, rel=0.05)
    holed = person_scan(ict, front, vertices, 5, points=4000, holes=True)
    missing = clean.points[~np.isin(clean.points, holed.points).all(axis=1)]
    assert 50 < len(missing) == len(clean.points) - len(holed.points)
    apart = np.linalg.norm(missing[:, None] - holed.points, axis=2).min(axis=1)
    assert apart.max() > 0.7 * HOLE_RADIUS


def test_expressions_follow_one_another_from_rest_to_rest() -> None:
    def take(value: float) -> Take:
        return Take("t", 30.0, *(np.full((1, 2, 3), value + k) for k in range(3)))

    found = in_turn(take(1.0), [take(3.0), take(-1.0)])
    turn = found.rotation_vector[:, 0, 0]
    assert turn[0] == turn[-1] == 1
    assert turn.max() == 3 and turn.min() == -1
    assert (turn == 3).sum() == HOLD + 1
    steps = np.abs(np.diff(turn))
    assert steps.max() == pytest.approx(2 / RISE)
    np.testing.assert_allclose(found.scale, found.rotation_vector + 2)


@pytest.mark.parametrize("name", TOPOLOGIES)
def test_a_template_is_written_as_a_face(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = tmp_path / "template.npz"
    monkeypatch.setattr(sys, "argv", ["asm_data", name, "-o", str(out), "--components", "3"])
    main()
    face = load(out)
    assert face.binding.components == 3 and len(face.template.bone_names) == 84
    np.testing.assert_array_equal(face.template.vertices, load_asm_head(name).template.vertices)
