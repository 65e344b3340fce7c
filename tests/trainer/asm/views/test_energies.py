"""Faces from uncalibrated images: poses, energies against plain definitions, depth, the files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from PIL import Image

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.asm.kernels.consistency import Scene, consistency
from avatar_trainer.asm.kernels.zbuffer import depth_buffers, in_front
from avatar_trainer.asm.model import Face
from avatar_trainer.asm.views.energy import (
    FLAT,
    Cameras,
    Priors,
    Texels,
    photometric_energy,
    prior_energy,
    unwrapped,
)
from avatar_trainer.asm.views.files import read
from avatar_trainer.asm.views.pose import pose_from_points

K = np.array([[300.0, 0, 64], [0, 310.0, 60], [0, 0, 1]])


def test_a_pose_is_found_again_from_every_side() -> None:
    rng = np.random.default_rng(0)
    points = rng.normal(0, 0.06, (40, 3))
    for turn in rng.normal(0, 1.2, (20, 3)):
        rotation, translation = matrix_from_rotvec(turn), np.array([0.03, -0.02, 0.9])
        x = points @ rotation.T + translation
        found = pose_from_points(points, x[:, :2] / x[:, 2:] * (300, 310) + (64, 60), K)
        np.testing.assert_allclose(found[0], rotation, atol=1e-8)
        np.testing.assert_allclose(found[1], translation, atol=1e-8)


def _ncc_by_hand(maps: np.ndarray[Any, Any], valid: np.ndarray[Any, Any], texels: int) -> float:
    """Eq. 21 and 22 with loops; numpy's correlation coefficient where patches are far from flat."""
    n, m, _ = maps.shape
    total = 0.0
    for i in range(n):
        for j in range(i + 1, n):
            for y in range(m - 2):
                for x in range(m - 2):
                    if valid[i, y, x] and valid[j, y, x]:
                        a, b = (maps[v, y : y + 3, x : x + 3].ravel() for v in (i, j))
                        total += 1 - np.corrcoef(a, b)[0, 1]
    return 2 / (n * (n - 1)) * total / texels


def test_the_consistency_is_one_minus_the_correlation_of_patches() -> None:
    rng = np.random.default_rng(1)
    maps, valid = (
        100 * rng.random((4, 9, 9)),
        rng.random((4, 7, 7)) > 0.3,
    )  # so far from flat that FLAT is nothing
    found = photometric_energy(torch.from_numpy(maps), torch.from_numpy(valid).double(), 50)
    assert float(found) == pytest.approx(_ncc_by_hand(maps, valid, 50), rel=1e-5)


def _scene(seed: int = 0) -> tuple[list[torch.Tensor], Scene, Texels]:
    generator = torch.Generator().manual_seed(seed)

    def uniform(*shape: int) -> torch.Tensor:
        return torch.rand(*shape, generator=generator)

    views, size, count = 4, 10, 60
    row = torch.randperm(size * size, generator=generator)[:count].sort().values
    corner = torch.randint(0, 30, (count, 3), generator=generator)
    texels = Texels(size, row, corner, torch.softmax(3 * uniform(count, 3), -1))
    valid = torch.nn.functional.pad((uniform(views, size - 2, size - 2) > 0.3).float(), (1, 1, 1, 1))
    scene = Scene(
        uniform(views, 20, 24).numpy(),
        np.array([22.0, 21.0]),
        np.array([12.0, 10.0]),
        *(part.numpy() for part in (row, corner, texels.barycentric, valid)),
        FLAT,
    )
    translation = torch.tensor([0.0, 0.0, 1.0]) + 0.05 * uniform(views, 3)
    return [0.5 * uniform(30, 3) - 0.25, 0.2 * uniform(views, 3) - 0.1, translation], scene, texels


def test_the_kernel_has_the_definitions_value_and_gradients() -> None:
    given, scene, texels = _scene()
    results = []
    for fused in (True, False):
        vertices, turn, translation = (t.clone().requires_grad_() for t in given)
        cameras = Cameras(
            torch.eye(3).expand(len(turn), 3, 3),
            turn,
            translation,
            torch.from_numpy(scene.focal).float(),
            torch.from_numpy(scene.principal).float(),
        )
        if fused:
            energy = consistency(vertices, cameras.turned(), translation, scene)
        else:
            pixels = cameras.pixels(texels.points(vertices))
            maps = unwrapped(torch.from_numpy(scene.images), pixels, texels)
            inner = torch.from_numpy(scene.valid)[:, 1:-1, 1:-1]
            energy = photometric_energy(maps, inner, len(texels.row))
        energy.backward()
        results.append([energy.detach(), vertices.grad, turn.grad, translation.grad])
    for ours, theirs in zip(*results, strict=True):
        assert ours is not None and theirs is not None and theirs.abs().max() > 0
        torch.testing.assert_close(ours, theirs, rtol=1e-4, atol=1e-5 * float(theirs.abs().max()))


@pytest.mark.parametrize(
    ("name", "moved", "expected"),
    [
        ("zeta", 0.03, 0.5 * (0.03 / 0.02) ** 2),
        ("mu", 0.03, 0.5 * (0.03 / 0.02) ** 2),
        ("pi_logit", 1.0, 0.5 * 2 * (np.e / (1 + np.e) - 0.5) ** 2),
        ("scale_tril", 0.3, 0.5 * 0.3**2),
        ("rotation_vector", 0.3, 2 * 3.0**2),
        ("translation", 0.03, 2 * 3.0**2),
        ("log_scale", 0.3, 2 * 3.0**2),
    ],
)
def test_the_prior_of_one_entry(name: str, moved: float, expected: float) -> None:
    generator = torch.Generator().manual_seed(4)
    shapes = ((3, 2), (3, 2), (3, 2, 2), (3, 2, 3), (3, 3), (3, 3), (3, 3))
    first = Face(*(torch.randn(shape, generator=generator).double() for shape in shapes))
    still = {part: torch.zeros(3, 3).double() for part in ("rotation_vector", "translation", "log_scale")}
    first = replace(first, **still, pi_logit=torch.zeros(3, 2).double())
    priors = Priors(pose=2.0, binding=0.5)
    assert float(prior_energy(first, first, priors)) == 0
    entry = getattr(first, name).clone()
    entry.view(-1)[1] += moved
    found = prior_energy(replace(first, **{name: entry}), first, priors)
    assert float(found) == pytest.approx(expected / 3, rel=1e-6)


def test_depth_is_of_the_nearest_surface_and_hides_what_is_behind() -> None:
    def wall(z: float, half: float) -> list[list[float]]:
        return [[-half, -half, z], [half, -half, z], [half, half, z], [-half, half, z]]

    points = np.array([wall(2.0, 9.0) + wall(1.0, 0.1)])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    depth = depth_buffers(points, triangles, K, (128, 120))
    np.testing.assert_array_equal(depth, depth_buffers(points, triangles[::-1], K, (128, 120)))
    assert depth[0, 60, 64] == 1 and depth[0, 5, 5] == 2
    assert np.isclose((depth == 1).sum(), 60 * 62, rtol=0.05)  # 0.2 m at 300 and 310 pixels a metre
    pixels, far = np.array([[[64.0, 60], [5, 5], [64, 60], [-3, 5]]]), np.array([[1.5, 1.5, 1.001, 1.0]])
    assert in_front(depth, pixels, far, 0.004).tolist() == [[False, True, True, False]]


def test_slanted_depth_is_perspective() -> None:
    points = np.array([[[-1.0, -1, 1], [1, -1, 3], [0, 1, 2.0]]])  # the plane z = x + 2
    depth = depth_buffers(points, np.array([[0, 1, 2]]), K, (128, 120))[0]
    y, x = np.argwhere(np.isfinite(depth)).T
    ray = (x + 0.5 - 64) / 300
    np.testing.assert_allclose(depth[y, x], 2 / (1 - ray), rtol=1e-6)


def _folder(tmp_path: Path, **changes: Any) -> Path:
    for name in ("a.png", "b.png"):
        Image.fromarray(np.full((16, 20, 3), 90, np.uint8)).save(tmp_path / name)
    Image.fromarray(np.full((16, 20), 255, np.uint8)).save(tmp_path / "m.png")
    marks = [[float(i), float(i * i % 7)] for i in range(7)] + [None]
    document = {
        "version": "1.0",
        "name": "toy",
        "width": 20,
        "height": 16,
        "K": [[30, 0, 10], [0, 30, 8], [0, 0, 1]],
        "landmarks": [f"ibug_{i}" for i in range(8)],
        "views": [{"image": name, "mask": "m.png", "landmarks": marks} for name in ("a.png", "b.png")],
    }
    (tmp_path / "views.json").write_text(json.dumps({**document, **changes}))
    return tmp_path


VIEW = {"image": "a.png", "mask": "m.png", "landmarks": [[1, 2]] * 8}


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"version": "2.0"}, "version"),
        ({"K": [[30, 1, 10], [0, 30, 8], [0, 0, 1]]}, "K"),
        ({"K": [[-30, 0, 10], [0, 30, 8], [0, 0, 1]]}, "K"),
        ({"K": [[1e-300, 0, 10], [0, 30, 8], [0, 0, 1]]}, "K"),
        ({"name": "a\nb"}, "name"),
        ({"width": 8192, "height": 8192, "views": [VIEW] * 4}, None),
        ({"width": 21}, None),
        ({"views": [VIEW]}, "views"),
        ({"views": [VIEW, {**VIEW, "landmarks": [[1, 2]] * 7}]}, "views[1].landmarks"),
        ({"views": [VIEW, {**VIEW, "landmarks": [[1, 2]] * 5 + [None] * 3}]}, "views[1].landmarks"),
        ({"views": [VIEW, {**VIEW, "landmarks": [[1, 1e9]] * 8}]}, "views[1].landmarks"),
        ({"views": [VIEW, {**VIEW, "image": "../a.png"}]}, "views[1].image"),
        ({"views": [VIEW, {**VIEW, "image": "none.png"}]}, None),
        ({"landmarks": ["a", "a"]}, "landmarks"),
        ({"K": [[30, 0, np.nan], [0, 30, 8], [0, 0, 1]]}, None),  # no number of JSON
        ({"views": [VIEW, {**VIEW, "landmarks": [[1, 2]] * 7 + [[np.inf, 1]]}]}, None),
    ],
)
def test_bad_views_are_named(tmp_path: Path, changes: dict[str, Any], field: str | None) -> None:
    with pytest.raises(AvatarError) as error:
        read(_folder(tmp_path, **changes))
    assert "\n" not in str(error.value)
    assert field is None or (error.value.field or "").startswith(field)
