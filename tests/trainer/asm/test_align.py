"""Placing scans and the scan-to-mesh error: against surfaces and motions that are known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from avatar_runtime.avatar import F64
from avatar_trainer.asm.align import (
    KEYPOINTS,
    Placement,
    Scan,
    face_region,
    in_face,
    placed_by_pairs,
    scan_to_mesh,
)
from avatar_trainer.asm.kernels.closest import triangle_tree
from tests.trainer.asm.toy import grid, scan, surface


def a_motion(seed: int = 0, scale: float = 1.0, turn: float = 1.0, shift: float = 0.3) -> Placement:
    """A rotation by `turn` radians, a shift by `shift` metres, and a scale."""
    random = np.random.default_rng(seed)
    x, y, z = axis = random.normal(size=3)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]]) / np.linalg.norm(axis)
    rotation = np.eye(3) + np.sin(turn) * cross + (1 - np.cos(turn)) * cross @ cross
    way = random.normal(size=3)
    return Placement(rotation, shift * way / np.linalg.norm(way), scale)


def moved(by: Placement, given: Scan) -> Scan:
    keypoints = {name: by.apply(at) for name, at in given.keypoints.items()}
    return dataclasses.replace(given, points=by.apply(given.points), keypoints=keypoints)


@pytest.mark.parametrize("scale", [1.0, 250.0])
def test_a_motion_is_found_from_pairs(scale: float) -> None:
    points, by = np.random.default_rng(2).normal(size=(7, 3)), a_motion(scale=scale)
    found = placed_by_pairs(points, by.apply(points), similarity=True)
    np.testing.assert_allclose(found.rotation, by.rotation, atol=1e-12)
    np.testing.assert_allclose(found.translation, by.translation, atol=1e-12 * scale)
    assert found.scale == pytest.approx(scale)


def test_the_facial_region_is_the_ball_that_is_defined() -> None:
    at = np.array(
        [(-5, 4, 0), (-2, 4, 0), (2, 4, 0), (5, 4, 0), (0, 0, 3), (-2, -3, 1), (2, -3, 1)], np.float64
    )
    keypoints = dict(zip(KEYPOINTS, at, strict=True))
    centre, radius = face_region(keypoints)
    np.testing.assert_allclose(centre, (0, 1.2, 2.1))  # three tenths from (0, 0, 3) to (0, 4, 0)
    assert radius == pytest.approx(0.7 * (10 + 5))
    inside = centre + np.array([(radius - 1e-6, 0, 0), (0, radius + 1e-6, 0), (0, 0, 0)])
    assert in_face(inside, keypoints).tolist() == [0, 2]
    assert in_face(inside, keypoints, widened=1.1).tolist() == [0, 1, 2]
    with pytest.raises(ValueError, match="nose_bottom is missing"):
        face_region({k: v for k, v in keypoints.items() if k != "nose_bottom"})


def fine_mesh() -> tuple[F64, F64]:
    uv, triangles = grid(81)
    return surface(uv), triangles


def test_the_error_is_the_mean_distance_whatever_the_frame() -> None:
    vertices, triangles = fine_mesh()
    exact = scan_to_mesh(scan(), vertices, triangle_tree(vertices, triangles))
    # The mesh's flat triangles: sagitta of 2.5 mm chords on curves of some centimetres.
    assert exact.mean_mm < 0.03
    given, by = scan(2.0), a_motion(9)
    here = scan_to_mesh(given, vertices, triangle_tree(vertices, triangles))
    turned = by.apply(vertices)
    there = scan_to_mesh(moved(by, given), turned, triangle_tree(turned, triangles))
    assert here.mean_mm == pytest.approx(there.mean_mm, rel=1e-6)
    assert 0.2 < here.mean_mm < 2
    assert here.rows.tolist() == in_face(given.points, given.keypoints).tolist()


def test_a_scan_without_a_face_has_no_error() -> None:
    vertices, triangles = fine_mesh()
    away = dataclasses.replace(scan(), points=scan().points + 9)
    with pytest.raises(ValueError, match="no point in the facial region"):
        scan_to_mesh(away, vertices, triangle_tree(vertices, triangles))
