"""What cameras see of a mesh, its contours and texels, and what a fit makes of it on each level."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import torch

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.asm.views import fit as fit_module
from avatar_trainer.asm.views.energy import Texels
from avatar_trainer.asm.views.files import Views
from avatar_trainer.asm.views.fit import LEVELS, Level, ViewSettings, fit
from avatar_trainer.asm.views.sight import (
    Sight,
    contour_pairs,
    contour_points,
    seen_texels,
    sight,
)
from tests.trainer.asm import toy as asm_toy

Array = npt.NDArray[Any]

K = np.array([[300.0, 0, 64], [0, 310.0, 60], [0, 0, 1]])
SIZE = (128, 120)
TURNED = np.stack(
    [np.diag([1.0, -1, -1]), matrix_from_rotvec(np.array([0.3, -0.8, 0.5])) @ np.diag([1.0, -1, -1])]
)
BACK = np.array([[0, 0, 1.0], [0.02, -0.01, 0.9]])
EYES = np.stack([-r.T @ t for r, t in zip(TURNED, BACK, strict=True)])


def _sphere(rings: int = 24) -> tuple[Array, Array]:
    """(vertices [V, 3] of a radius of 0.1, triangles)."""
    around = np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    down = np.linspace(0.05, np.pi - 0.05, rings)
    p, q = np.meshgrid(around, down)
    vertices = 0.1 * np.stack([np.sin(q) * np.sin(p), np.cos(q), np.sin(q) * np.cos(p)], -1).reshape(-1, 3)
    r, c = np.meshgrid(np.arange(rings - 1), np.arange(2 * rings), indexing="ij")
    a, b = r * 2 * rings + c, r * 2 * rings + (c + 1) % (2 * rings)
    low, beside = a + 2 * rings, b + 2 * rings
    return vertices, np.concatenate([np.stack(t, -1).reshape(-1, 3) for t in ((a, low, b), (b, low, beside))])


def _degrees(points: Array, normal: Array) -> Array:
    """[N, P] between normals of length 1 and the way to each of EYES, in the world."""
    way = EYES[:, None] - points
    cosine = (normal * way).sum(-1) / np.linalg.norm(way, axis=-1)
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


def _seen(rings: int = 24) -> tuple[Array, Array, Sight]:
    vertices, triangles = _sphere(rings)
    return vertices, triangles, sight(vertices, triangles, TURNED, BACK, K, SIZE)


def _masks() -> Array:
    """[2, H, W] 1 where a ray meets the sphere."""
    y, x = np.mgrid[: SIZE[1], : SIZE[0]] + 0.5
    ray = np.stack([(x - 64) / 300, (y - 60) / 310, np.ones_like(x)], -1)
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    apart = [np.linalg.norm(np.cross(ray, centre), axis=-1) for centre in BACK]
    return (np.stack(apart) < 0.1).astype(np.float32)


def test_what_a_camera_sees_is_that_in_the_world() -> None:
    vertices, triangles, found = _seen()
    normal = np.zeros_like(vertices)
    for a, b, c in triangles:
        normal[[a, b, c]] += np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    assert (np.sum(normal * vertices, axis=1) > 0.09).all()  # outside is where normals point
    np.testing.assert_allclose(found.facing, np.cos(np.radians(_degrees(vertices, normal))), atol=1e-9)
    for n in range(2):
        x = (K @ (TURNED[n] @ vertices.T + BACK[n][:, None])).T
        np.testing.assert_allclose(found.pixels[n], x[:, :2] / x[:, 2:], atol=1e-9)


def test_contour_points_of_a_small_mask() -> None:
    """Inner pixels with a neighbour outside; what goes on beyond the image has no contour there."""
    mask = np.array(
        [
            [0, 0, 0, 0, 0],
            [0, 1, 0.5, 1, 0],
            [0, 1, 1, 1, 1],
            [0, 1, 1, 1, 0.49],
            [0, 0, 0, 1, 0],
        ],
        np.float32,
    )
    found = {tuple(point) for point in contour_points(mask[None])[0].tolist()}
    assert found == {(1.5, 1.5), (2.5, 1.5), (3.5, 1.5), (1.5, 2.5), (1.5, 3.5), (2.5, 3.5), (3.5, 3.5)}


def test_a_spheres_contour_meets_its_mask() -> None:
    vertices, _, found = _seen(40)
    contours = contour_points(_masks())
    pairs = contour_pairs(found, contours, 6.0)
    assert min(np.bincount(pairs.view, minlength=2)) > 40
    away = torch.from_numpy(found.pixels)[pairs.view, pairs.vertex] - pairs.point
    assert away.norm(dim=1).mean() < 2.5
    degrees = _degrees(vertices, 10 * vertices)[pairs.view, pairs.vertex]
    assert np.abs(degrees - 90).max() < 10.3  # and normals of the mesh are nearly the sphere's
    assert np.abs(degrees - 90).max() > 7
    assert len(contour_pairs(found, [points + 500 for points in contours], 6.0).view) == 0


def test_pairs_of_a_view_weigh_as_much_in_each_direction() -> None:
    _, _, found = _seen(40)
    contours = contour_points(_masks())
    pairs = contour_pairs(found, contours, 3.0)
    starts = np.flatnonzero(np.diff(pairs.weight.numpy(), prepend=-1))
    assert len(starts) == 4  # two views, from vertices and from points
    ends = [*starts[1:], len(pairs.weight)]
    for k, (start, end) in enumerate(zip(starts, ends, strict=True)):
        view = k // 2
        assert (pairs.view[start:end] == view).all()
        assert float(pairs.weight[start:end].sum()) == pytest.approx(1, abs=1e-5)
        vertex, point = pairs.vertex[start:end].numpy(), pairs.point[start:end].double().numpy()
        away = np.linalg.norm(found.pixels[view, vertex] - point, axis=1)
        assert away.max() <= 3
        if k % 2 == 0:
            assert len(set(vertex.tolist())) == end - start
            rest = np.linalg.norm(found.pixels[view, vertex][:, None] - contours[view], axis=-1)
            np.testing.assert_allclose(away, rest.min(axis=1))
        else:
            fourth = contours[view][::4]
            assert {tuple(p) for p in point.tolist()} <= {tuple(p) for p in fourth.tolist()}
            assert end - start > 0.8 * len(fourth)


def test_texels_are_seen_up_to_72_degrees() -> None:
    vertices, triangles, found = _seen(40)
    count = len(triangles)
    texels = Texels(100, torch.arange(count), torch.from_numpy(triangles), torch.full((count, 3), 1 / 3))
    seen = seen_texels(found, texels)
    place = vertices[triangles].mean(axis=1)
    degrees = _degrees(place, place / np.linalg.norm(place, axis=1, keepdims=True))
    assert degrees[seen].max() < 72.3 and seen[degrees < 60].all()
    assert seen[(degrees > 67) & (degrees < 71.5)].mean() > 0.8  # depth is coarse where it is steep


# The toy from the left and twice from the right, so far that its sides are hidden from one another.
YAWS = (-0.95, 0.95, 1.0)


def _toy_views(file: Path = Path("views.json")) -> Views:
    """Targets whose grey is the column, and the landmarks."""
    template = asm_toy.template()
    names = tuple(template.landmarks)
    points = template.vertices[list(template.landmarks.values())].astype(np.float64)
    marks = []
    for rotation in _toy_rotations():
        x = points @ rotation.T + (0, 0, 0.9)
        marks.append(x[:, :2] / x[:, 2:] * (300, 310) + (64, 60))
    ramp = np.broadcast_to(np.arange(SIZE[0], dtype=np.float32) + 0.5, (3, SIZE[1], SIZE[0]))
    mask = np.ones((3, SIZE[1], SIZE[0]), np.float32)
    return Views("toy", file, K, ramp.copy(), mask, names, np.array(marks))


def _toy_rotations() -> list[Array]:
    return [np.diag([1.0, -1, -1]) @ matrix_from_rotvec(np.array([0, -yaw, 0])) for yaw in YAWS]


def _problem() -> Any:
    template = asm_toy.template()
    return fit_module._Problem(template, asm_toy.binding(template), _toy_views(), ViewSettings(iterations=4))


def test_a_coarse_level_has_smaller_images_and_a_smaller_camera() -> None:
    """A pixel's grey is its column in the first image, wherever a point falls in the small one."""
    problem = _problem()
    level = next(level for level in LEVELS if level.shrink > 1)
    scene = problem.scene(level, problem.texels(level), problem.look())
    assert scene.images.shape == (3, SIZE[1] // level.shrink, SIZE[0] // level.shrink)
    x = np.array([0.031, -0.02, 0.8])
    whole = x[:2] / x[2] * (300, 310) + (64, 60)
    small = x[:2] / x[2] * scene.focal + scene.principal
    np.testing.assert_allclose(small * level.shrink, whole, atol=1e-9)
    centres = np.arange(scene.images.shape[2]) + 0.5
    assert np.interp(small[0], centres, scene.images[0, 7]) == pytest.approx(whole[0], abs=1e-4)


def test_only_texels_that_two_views_see_are_compared() -> None:
    problem = _problem()
    texels = problem.texels(Level(1.0, 64, 1, 4.0))
    kept = np.zeros((64, 64), bool)
    kept.ravel()[texels.row.numpy()] = True
    uv = (np.stack(np.meshgrid(np.arange(64), np.arange(64)), -1).reshape(-1, 2) + 0.5) / 64
    step = 1e-5
    along = [asm_toy.surface(uv + move) - asm_toy.surface(uv - move) for move in ((step, 0), (0, step))]
    normal = np.cross(along[0], along[1])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    place = asm_toy.surface(uv)
    eyes = [-rotation.T @ (0, 0, 0.9) for rotation in _toy_rotations()]
    degrees = []
    for eye in eyes:
        way = (eye - place) / np.linalg.norm(eye - place, axis=1, keepdims=True)
        degrees.append(np.degrees(np.arccos((normal * way).sum(1))).reshape(64, 64))
    turned_to = (np.array(degrees) < 74).sum(axis=0)
    assert (turned_to == 1).sum() > 200 and kept[turned_to < 2].mean() < 0.02
    left_out = (np.array(degrees) < 66).sum(axis=0) == 2
    assert kept[left_out].mean() > 0.9  # two of three are enough


def test_what_does_not_stay_finite_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    def none(projected: torch.Tensor, *_: torch.Tensor) -> torch.Tensor:
        return projected.sum() * torch.nan

    monkeypatch.setattr(fit_module, "landmark_energy", none)
    template = asm_toy.template()
    with pytest.raises(AvatarError, match=r"views\.json: the fit did not stay finite"):
        fit(template, asm_toy.binding(template), _toy_views(), ViewSettings(iterations=40))
