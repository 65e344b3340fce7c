"""The solver, on heads whose landmarks are known exactly, and the parts of the fit that need no network."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import cv2
import numpy as np
import pytest

from avatar_runtime import F64
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.film import pictures
from avatar_trainer.film.fit import (
    fitting,
    gaze,
    landmark_fit,
    landmark_map,
    photometric,
    silhouette,
    smooth,
    solve,
)
from avatar_trainer.film.fit.images import bands
from avatar_trainer.film.fit.pose import Fit
from avatar_trainer.film.fit.surface import SurfacePoints
from avatar_trainer.film.torso import Chest, still_chest
from avatar_trainer.head import (
    EYE_TURN,
    build_body_model,
    head_for,
    load_head_model,
    load_tracking_head,
    tracking_body,
)

FRAMES, SKIN, SIZE = 12, 468, 256
FACING = np.diag([1.0, -1.0, -1.0])


def filmed(frames: int = FRAMES, seed: int = 3) -> Fit:
    """Poses, expressions and an identity that nobody tracked."""
    rng = np.random.default_rng(seed)
    weights = np.where(rng.random((frames, 51)) < 0.15, rng.uniform(0.2, 0.9, (frames, 51)), 0)
    turn = rng.uniform(-1, 1, (frames, 3)) * (0.25, 0.5, 0.1)
    shift = rng.uniform(-1, 1, (frames, 3)) * (0.02, 0.02, 0.04) + (0, 0.01, 0.75)
    return Fit(
        700.0,
        np.array([256.0, 250.0]),
        rng.normal(size=60),
        weights,
        FACING @ matrix_from_rotvec(turn),
        shift,
    )


@pytest.fixture(scope="module")
def points() -> SurfacePoints:
    known = landmark_map.load()
    return SurfacePoints.on_triangles(
        load_head_model(), known.triangle_corners[:SKIN], known.barycentric[:SKIN]
    )


def degrees(a: F64, b: F64) -> F64:
    cosine = (np.einsum("tij,tij->t", a, b) - 1) / 2
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def test_exact_landmarks_give_pose_identity_and_weights(points: SurfacePoints) -> None:
    true = filmed(24)
    places = true.pixels(true.in_camera(points.posed(true.identity, true.weights)))
    rough = matrix_from_rotvec(np.random.default_rng(1).normal(size=(24, 3)) * 0.1) @ true.rotation
    fit = landmark_fit.begin(places, rough, true.principal, true.focal, 51, 60)
    seen = landmark_fit.Landmarks(places, np.full(places.shape[:2], 0.5), np.arange(SKIN))
    prior = solve.Prior(np.zeros((24, 51)), np.full((24, 51), 0.5), 1.0, true.focal, 0.0)
    fit = landmark_fit.fitted(fit, points, seen, prior, 40)
    assert (
        np.linalg.norm(
            places - fit.pixels(fit.in_camera(points.posed(fit.identity, fit.weights))), axis=-1
        ).mean()
        < 0.5
    )
    assert degrees(fit.rotation, true.rotation).mean() < 1.5
    moves = true.weights.std(axis=0) > 0.1
    found = [np.corrcoef(true.weights[:, k], fit.weights[:, k])[0, 1] for k in np.flatnonzero(moves)]
    assert np.median(found) > 0.85
    shape, known = points.of_person(fit.identity), points.of_person(true.identity)
    assert (
        np.linalg.norm(shape - known, axis=1).mean()
        < 0.6 * np.linalg.norm(points.neutral - known, axis=1).mean()
    )


def rows_of(what: str, at: Fit) -> Callable[[Fit], solve.Rows]:
    """The residuals of one frame with equal weights, by fits near `at`."""
    head = load_head_model()
    vertices = np.flatnonzero(head.in_part("face"))[:6000:50]
    points, index = SurfacePoints.at_vertices(head, vertices), np.arange(len(vertices))
    noise = np.random.default_rng(2).normal(size=(512, 512)).astype(np.float32)
    soft = cv2.normalize(cv2.GaussianBlur(noise, (0, 0), 9), None, 0, 255, cv2.NORM_MINMAX).astype(np.uint8)
    if what == "landmarks":
        places = at.pixels(at.in_camera(points.posed(at.identity, at.weights))) + 2
        seen = landmark_fit.Landmarks(places, np.full(places.shape[:2], 50.0), index)
        return lambda fit: landmark_fit.rows(fit, points, seen, 1.0)
    if what == "outline":
        edges, ones = [silhouette.edge_distance(soft)], np.ones((1, len(index)))
        return lambda fit: silhouette.rows(fit, points, index, ones, edges, 1e5)
    images, normals = [bands(soft, 4.0, 30.0)], head.vertex_normals[vertices]
    _, look = photometric.rows(at, points, index, normals, images, None)
    return lambda fit: photometric.rows(fit, points, index, normals, images, look)[0]


@pytest.mark.parametrize("what", ["landmarks", "skin", "outline"])
def test_rows_are_the_derivatives_of_residuals(what: str) -> None:
    """By finite differences: of the place in camera space and of the focal length."""
    at, small = replace(filmed(1), rotation=FACING[None]), 2e-5
    rows = rows_of(what, at)
    here = rows(at)
    for axis in range(4):
        shift = np.eye(4)[axis, :3] * small
        moved = replace(at, translation=at.translation + shift, focal=at.focal * (1 + small * (axis == 3)))
        by = here.by_focal if axis == 3 else here.by_place[..., axis]
        change = (rows(moved).residual.astype(np.float64) - here.residual) / small
        assert np.count_nonzero(by) > 30
        assert np.linalg.norm(change + by) < 0.35 * np.linalg.norm(by), axis


def test_weights_stay_between_0_and_1(points: SurfacePoints) -> None:
    true = replace(filmed(4), weights=np.zeros((4, 51)))
    places = true.pixels(true.in_camera(points.posed(true.identity, true.weights - 0.3)))
    seen = landmark_fit.Landmarks(places, np.full(places.shape[:2], 1.0), np.arange(SKIN))
    prior = solve.Prior(np.zeros((4, 51)), np.full((4, 51), 1.0), 1.0, true.focal, 0.0, identity=False)
    fit = landmark_fit.fitted(true, points, seen, prior, 5)
    assert fit.weights.min() >= 0
    assert fit.identity is true.identity


def test_the_outline_turns_a_head_back() -> None:
    """The mask of the true head pulls one that stands 4.5 mm beside it."""
    head = load_head_model()
    coarse, _ = load_tracking_head(head)
    true = replace(filmed(1, 5), focal=350.0, principal=np.array([128.0, 125.0]), identity=np.zeros(60))
    true = replace(true, weights=np.zeros((1, 51)))
    drawn = np.zeros((SIZE, SIZE), np.uint8)
    for corners in np.round(true.pixels(true.in_camera(coarse.vertices))[0][coarse.triangles]).astype(
        np.int32
    ):
        cv2.fillConvexPoly(drawn, corners, 255)
    rows, weight = silhouette.candidates(head)
    points = SurfacePoints.at_vertices(head, rows)
    fit = replace(true, translation=true.translation + np.array([0.004, -0.002, 0.0]))
    edges = [silhouette.edge_distance(drawn)]
    prior = solve.Prior(np.zeros((1, 51)), np.full((1, 51), 1e-3), 1.0, true.focal, 0.0, identity=False)
    before = np.linalg.norm(fit.translation[0, :2] - true.translation[0, :2])
    for _ in range(12):
        on = silhouette.outline(
            fit,
            coarse.vertices[None],
            coarse.triangles,
            (SIZE, SIZE),
            points.posed(fit.identity, fit.weights),
            head.vertex_normals[rows],
        )
        compared = silhouette.rows(fit, points, np.arange(len(rows)), on * weight, edges, 110.0)
        fit = solve.step(points, fit, [compared], prior, damping=0.1)
    assert on.sum() > 30
    assert np.linalg.norm(fit.translation[0, :2] - true.translation[0, :2]) < 0.5 * before


@pytest.mark.parametrize("size", [20, 37, 90])
def test_a_cut_keeps_places_and_means(size: int) -> None:
    """Of a picture that says where each pixel's centre is, between stripes as wide as a pixel."""
    x = np.tile(np.arange(80, dtype=np.float32) + 0.5, (60, 1))
    left, top, side = 7.3, 4.0, 48.6
    found = pictures.cut(x, left, top, side, size)
    assert found[size // 2] == pytest.approx(left + (np.arange(size) + 0.5) * side / size, abs=0.02)
    if size < side / 2:
        assert np.ptp(pictures.cut(np.where(x % 2 < 1, 0, 255).astype(np.uint8), left, top, side, size)) < 90


def test_own_errors_go_from_the_landmarks() -> None:
    """Landmarks that are off by the same share of the face in all frames come nearer to their places."""
    known, fit = landmark_map.load(), filmed()
    surface = fitting.Surface.of_model(known, 0)
    true = fit.pixels(fit.in_camera(surface.landmarks.posed(fit.identity, fit.weights)))
    places = np.concatenate([true, np.zeros((FRAMES, 10, 2))], axis=1) + np.array([6.0, -4.0])
    seen = fitting.Seen(places, np.zeros((FRAMES, 52)), fit.rotation, (512, 512))
    own = fitting.own_errors(surface, seen, fit)
    before, after = (
        np.linalg.norm(fitting.landmarks_of(seen, fit, known, each).places - true, axis=-1).mean()
        for each in (None, own)
    )
    assert after < 0.7 * before


def test_the_irises_give_the_gaze() -> None:
    """Both eyes turn together by 0.2 radians to the side, and the irises are seen where the turned balls have them."""
    head, fit = load_head_model(), replace(filmed(), weights=np.zeros((FRAMES, 51)), identity=np.zeros(60))
    turn = np.linspace(-0.25, 0.25, FRAMES)
    places = np.zeros((FRAMES, 478, 2))
    for side, index in enumerate((473, 468)):
        ahead = matrix_from_rotvec(np.stack([0 * turn, turn, 0 * turn], axis=1)) @ (0, 0, gaze.IRIS_RADIUS)
        places[:, index] = fit.pixels(fit.in_camera((head.eye_centres[side] + ahead)[:, None]))[:, 0]
    for angle in gaze.angles(fit, head, places).values():
        assert angle == pytest.approx(np.stack([0 * turn, turn], axis=1), abs=1e-3)
    found = gaze.with_gaze(fit, head, places, np.zeros((FRAMES, 51)))
    for side in ("Left", "Right"):
        columns = {name: found[:, head.expression_names.index(name)] for name in EYE_TURN if side in name}
        angle = sum(value * EYE_TURN[name][1] for name, value in columns.items())
        assert np.polyfit(turn, angle, 1)[0] == pytest.approx(gaze.TRUST, abs=0.15), side


def test_smoothing_keeps_turns_and_stops_at_cuts() -> None:
    t = np.linspace(0, 1, 40)
    turn = np.stack([0.1 * t, 0.6 * t**2, 0 * t], axis=1)
    still = replace(filmed(40), rotation=FACING @ matrix_from_rotvec(turn), weights=np.full((40, 51), 0.5))
    still = replace(still, translation=np.stack([0.02 * t, 0 * t, 0.8 + 0 * t], axis=1))
    assert degrees(smooth.smoothed(still, np.arange(40)).rotation, still.rotation).max() < 0.05
    shaken = matrix_from_rotvec(np.random.default_rng(0).normal(size=(40, 3)) * 0.01) @ still.rotation
    calm = smooth.smoothed(replace(still, rotation=shaken), np.arange(40))
    assert (
        degrees(calm.rotation, still.rotation)[2:-2].mean()
        < 0.8 * degrees(shaken, still.rotation)[2:-2].mean()
    )
    cut = replace(still, translation=still.translation + np.where(t > 0.5, 0.2, 0)[:, None])
    assert smooth.smoothed(cut, np.arange(40)).translation == pytest.approx(cut.translation, abs=1e-9)
    assert smooth.runs(np.arange(40), cut) == [(0, 20), (20, 40)]
    assert smooth.runs(np.r_[0:10, 15:45], still) == [(0, 10), (10, 40)]


def test_a_chest_stays_while_the_head_turns() -> None:
    head = head_for(np.zeros(60))
    body, fit = tracking_body(head, build_body_model(head)), replace(filmed(), identity=np.zeros(60))
    middle = np.linalg.svd(fit.rotation.mean(axis=0))
    chest = Chest.of(head, body, middle[0] @ middle[2])
    for k in range(3):
        one = fit.of(slice(k, k + 1))
        rotation, shift, joints = chest.root_pose(one)
        place = rotation @ (joints["neck"] @ (head.vertices[0] - chest.joint) + chest.joint) + shift
        assert place == pytest.approx(one.rotation[0] @ head.vertices[0] + one.translation[0], abs=1e-9)
        assert rotation is chest.rotation
    wide, narrow = (np.zeros((500, 512), np.uint8) for _ in range(2))
    wide[:], narrow[:, 200:310] = 255, 255
    rows = np.arange(3)
    near = replace(fit, translation=np.tile([0, -0.05, 0.75], (FRAMES, 1)))
    assert still_chest(near, head, [wide] * 3, rows) is not None
    assert still_chest(near, head, [narrow] * 3, rows) is None
    upright = replace(near, rotation=np.tile(FACING, (FRAMES, 1, 1)))
    assert still_chest(upright, head, [wide] * 3, rows) is None
