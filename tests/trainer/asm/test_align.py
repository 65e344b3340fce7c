"""Placing scans and the scan-to-mesh error: against surfaces and motions that are known."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from samples.asm.data import load_asm_head

from avatar_runtime.avatar import F64
from avatar_trainer.asm.align import (
    KEYPOINTS,
    Placement,
    Scan,
    ScanError,
    face_region,
    in_face,
    placed_by_pairs,
    refined,
    scan_to_mesh,
)
from avatar_trainer.asm.kernels.closest import triangle_tree
from avatar_trainer.asm.register.fit import template_keypoints
from avatar_trainer.normals import vertex_normals
from tests.measured import Measure
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


def test_a_mirrored_goal_is_no_reason_to_mirror() -> None:
    points = np.random.default_rng(3).normal(size=(7, 3))
    found = placed_by_pairs(points, points * (-1, 1, 1))
    assert np.linalg.det(found.rotation) == pytest.approx(1)
    assert found.scale == 1


def test_pairs_on_a_line_leave_a_motion_open() -> None:
    line = np.arange(4.0)[:, None] * (1, 2, 3)
    with pytest.raises(ValueError, match="line"):
        placed_by_pairs(line, line)
    with pytest.raises(ValueError, match="at least 3"):
        placed_by_pairs(line[:2], line[:2])


def test_placements_compose_and_invert() -> None:
    first, then = a_motion(4, 3.0), a_motion(5, 0.5)
    points = np.random.default_rng(6).normal(size=(9, 3))
    np.testing.assert_allclose(then.after(first).apply(points), then.apply(first.apply(points)), atol=1e-12)
    np.testing.assert_allclose(first.inverse().apply(first.apply(points)), points, atol=1e-12)


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


def test_refinement_finds_a_motion_of_points_on_a_surface(measured: Measure) -> None:
    vertices, triangles = fine_mesh()
    random = np.random.default_rng(7)
    corner = vertices[triangles[random.integers(0, len(triangles), 2000)]]
    points = np.einsum("nk,nkx->nx", random.dirichlet(np.ones(3), len(corner)), corner)
    by = a_motion(8, turn=0.05, shift=0.003)
    placement, distance = refined(by.apply(points), vertices, triangle_tree(vertices, triangles))
    off = np.abs(placement.apply(by.apply(points)) - points).max()
    assert off < 1e-6
    assert distance.max() < 1e-6
    measured("rigid refinement: points off where they were, m", float(off))


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


def test_points_off_a_plane_are_off_by_what_no_motion_removes() -> None:
    """Half of the points 1 mm in front of a plane and half behind: no rigid motion helps, the mean is 1 mm."""
    uv, triangles = grid(3)
    plane = np.c_[uv - 0.5, np.zeros(len(uv))] * 0.5
    given = scan()
    at = np.random.default_rng(0).uniform(-0.05, 0.05, (4000, 2))
    points = np.concatenate([np.c_[at, np.full(len(at), 1e-3)], np.c_[at, np.full(len(at), -1e-3)]])
    keypoints = {name: place * (1, 1, 0) for name, place in given.keypoints.items()}
    found = scan_to_mesh(Scan("s", points, None, keypoints), plane, triangle_tree(plane, triangles))
    assert found.mean_mm == pytest.approx(1, abs=1e-6)


def test_a_scan_without_a_face_has_no_error() -> None:
    vertices, triangles = fine_mesh()
    away = dataclasses.replace(scan(), points=scan().points + 9)
    with pytest.raises(ValueError, match="no point in the facial region"):
        scan_to_mesh(away, vertices, triangle_tree(vertices, triangles))


def test_the_mean_is_in_millimetres() -> None:
    still = Placement(np.eye(3), np.zeros(3))
    assert ScanError(np.arange(3), np.array([1e-3, 2e-3, 6e-3]), still).mean_mm == pytest.approx(3)


def test_right_and_left_are_the_persons_on_the_ict_head() -> None:
    """Which faces +Z with its left at +X, eyes above the nose, the nose above the mouth."""
    at = template_keypoints(load_asm_head("ict").template)
    across = ["right_eye_outer", "right_eye_inner", "nose_bottom", "left_eye_inner", "left_eye_outer"]
    x = [at[name][0] for name in across]
    assert x == sorted(x)
    assert at["mouth_right"][0] < 0 < at["mouth_left"][0]
    eyes, nose, mouth = (at[n][1] for n in ("left_eye_inner", "nose_bottom", "mouth_left"))
    assert eyes > nose > mouth


def test_normals_weigh_triangles_by_area() -> None:
    """A corner of a box whose sides are 1, 2 and 2 at the corner: their sum, and none where nothing is."""
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 2), (9, 9, 9)], np.float64)
    triangles = np.array([(0, 1, 2), (0, 2, 3), (0, 3, 1)])
    found = vertex_normals(vertices, triangles)
    np.testing.assert_allclose(found[0], np.array([2, 2, 1]) / 3)
    np.testing.assert_array_equal(found[4], 0)
