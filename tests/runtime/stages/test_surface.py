"""Surface binding against a transcription of the rules in words, on meshes so fine that the floors matter."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_runtime.avatar import Embedding, Rules
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_runtime.rules import NORMAL_POSITIONS
from avatar_runtime.stages.surface import pose_embedded, prepare
from avatar_runtime.topology import topology_hash, vertex_triangles
from tests.avatars import full_avatar, surface_avatar
from tests.oracles import surface_rule

Array = npt.NDArray[Any]
N = 40
GAUSSIAN_AVATARS = Rules("triangle_frame", position="triangle_frame", scale="triangle_linear")
SPLATTING_AVATAR = Rules("vertex_quaternion", scale="log_area")
PAPER = {"position": "interpolated_normal", "rotation": "vertex_quaternion_mean", "scale": "linear_area"}


def sheet(size: float, seed: int = 0) -> tuple[Array, Array, Array]:
    """(canonical, posed, triangles) of a bumpy 4 x 4 sheet whose triangles have edges of about `size`."""
    rng = np.random.default_rng(seed)
    x, y = np.meshgrid(np.arange(4.0), np.arange(4.0))
    flat = np.stack([x, y, 0 * x], axis=-1).reshape(-1, 3) + rng.normal(0, 0.15, (16, 3))
    quads = [(4 * r + c, 4 * r + c + 1, 4 * r + c + 5, 4 * r + c + 4) for r in range(3) for c in range(3)]
    triangles = np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))], np.uint32)
    turn = matrix_from_rotvec(rng.normal(0, 0.4, 3))
    posed = (flat + rng.normal(0, 0.15, (16, 3))) @ turn.T
    return (flat * size).astype(np.float32), (posed * size).astype(np.float32), triangles


def embedding(canonical: Array, triangles: Array, rules: Rules, size: float) -> Embedding:
    rng = np.random.default_rng(1)
    by_normal = rules.position in NORMAL_POSITIONS
    return Embedding(
        canonical,
        triangles,
        rng.integers(0, len(triangles), N).astype(np.uint32),
        rng.dirichlet([1, 1, 1], N).astype(np.float32) if by_normal else np.full((N, 3), 1 / 3, np.float32),
        (rng.normal(0, size, N if by_normal else 0)).astype(np.float32),
        rng.normal(0, 1, (0 if by_normal else N, 3)).astype(np.float32),
        rng.normal(0, 1, (N, 4)).astype(np.float32),
    )


CHOICES = [frozenset(names) for count in range(4) for names in combinations(PAPER, count)]


@pytest.mark.parametrize("by_paper", CHOICES, ids=lambda names: "+".join(sorted(names)) or "code")
@pytest.mark.parametrize("u", [1.0, 4.0])
@pytest.mark.parametrize("size", [5e-4, 1e-3, 0.01, 0.3], ids=["floored", "partly", "fine", "coarse"])
def test_splatting_avatar_is_its_rule_in_training_units(
    size: float, u: float, by_paper: frozenset[str]
) -> None:
    rules = replace(SPLATTING_AVATAR, **{name: PAPER[name] for name in by_paper})
    canonical, posed, triangles = sheet(size)
    e = embedding(canonical, triangles, rules, size)
    log_scale = np.random.default_rng(2).normal(np.log(0.01), 0.5, (N, 3)).astype(np.float32)
    in_metres = replace(
        e, canonical_vertices=canonical / np.float32(u), displacement=e.displacement / np.float32(u)
    )
    surface = prepare(in_metres, rules, u)
    found = pose_embedded(surface, posed / np.float32(u), (log_scale - np.log(u)).astype(np.float32))
    quat = found.quat_wxyz / np.linalg.norm(found.quat_wxyz, axis=1, keepdims=True)
    for i in range(N):
        xyz, rotation, scale = surface_rule.splatting_avatar(
            *(canonical, posed, triangles, int(e.triangle[i]), e.barycentric[i].astype(np.float64)),
            *(
                float(e.displacement[i]),
                e.local_quat_wxyz[i].astype(np.float64),
                log_scale[i].astype(np.float64),
            ),
            by_paper,
        )
        assert np.abs(found.mean[i] * u - xyz).max() <= 1e-6 * max(size, 0.1)
        assert min(np.abs(quat[i] - rotation).max(), np.abs(quat[i] + rotation).max()) <= 1e-5
        assert np.abs(np.exp(found.log_scale[i].astype(np.float64)) * u / scale - 1).max() <= 1e-5


@pytest.mark.parametrize("u", [1.0, 4.0])
def test_gaussian_avatars_is_its_rule(u: float) -> None:
    canonical, posed, triangles = sheet(0.01)
    e = embedding(canonical, triangles, GAUSSIAN_AVATARS, 0.01)
    local = np.random.default_rng(2).normal(-1, 0.5, (N, 3)).astype(np.float32)
    sizes = [surface_rule.edge_frame(canonical, triangles[t])[1] for t in e.triangle]
    bound = (local + np.log(np.array(sizes) / u)[:, None]).astype(np.float32)
    surface = prepare(replace(e, canonical_vertices=canonical / np.float32(u)), GAUSSIAN_AVATARS, u)
    found = pose_embedded(surface, posed / np.float32(u), bound)
    quat = found.quat_wxyz / np.linalg.norm(found.quat_wxyz, axis=1, keepdims=True)
    for i in range(N):
        xyz, rotation, scale = surface_rule.gaussian_avatars(
            posed,
            triangles[e.triangle[i]],
            e.local_offset[i],
            e.local_quat_wxyz[i],
            local[i].astype(np.float64),
        )
        assert np.abs(found.mean[i] * u - xyz).max() <= 1e-8
        assert min(np.abs(quat[i] - rotation).max(), np.abs(quat[i] + rotation).max()) <= 1e-6
        assert np.abs(np.exp(found.log_scale[i].astype(np.float64)) * u / scale - 1).max() <= 1e-5


def test_posed_vertices_must_fit() -> None:
    camera = Camera.orbit(np.zeros(3), 1.0, 0, 0, 0.5, 16, 16)
    with pytest.raises(ValueError, match=r"posed_vertices has shape \[19, 3\]; \[20, 3\]"):
        Player(surface_avatar()).frame(Pose(), camera, posed_vertices=np.zeros((19, 3)))
    with pytest.raises(ValueError, match="bound to a surface"):
        Player(full_avatar()).animate(Pose(), posed_vertices=np.zeros((20, 3)))


def test_vertex_triangle_lists_and_the_name_of_a_topology() -> None:
    triangles = np.array([[0, 1, 2], [2, 1, 3], [4, 2, 0]], np.uint32)
    ptr, triangle = vertex_triangles(triangles, 6)
    lists = [triangle[ptr[v] : ptr[v + 1]].tolist() for v in range(6)]
    assert lists == [[0, 2], [0, 1], [0, 1, 2], [1], [2], []]
    names = {
        topology_hash(triangles, 6),
        topology_hash(triangles, 5),
        topology_hash(triangles[::-1], 6),
        topology_hash(triangles[:, [1, 2, 0]], 6),
    }
    assert len(names) == 4
    assert topology_hash(triangles[:1], 3) == (
        # sha256 of 03000000 00000000 01000000 02000000, by coreutils' sha256sum
        "6256a4b0be4127b6ff9fa076fe7595961bc296521bd01220f64c6f95768c1fdd"
    )
