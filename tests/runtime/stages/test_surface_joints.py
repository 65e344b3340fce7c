"""Rotation rule bary_vertex_lbs against PSAvatar's equations, on every backend."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_runtime.avatar import Avatar, Embedding, Rig, Rules
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.stages.activate import Splats
from tests.avatars import COUNT, full_avatar, surface_avatar
from tests.measured import Measure
from tests.oracles import joint_turns

Array = npt.NDArray[Any]
BY_JOINTS = Rules("bary_vertex_lbs", position="interpolated_normal")
BACKENDS = ("reference", "cpu", "gl")


def parts(avatar: Avatar) -> tuple[Rig, Embedding]:
    assert avatar.rig is not None and avatar.embedding is not None
    return avatar.rig, avatar.embedding


def pose_of(avatar: Avatar, seed: int, turn: float) -> Pose:
    """Every joint turned by about `turn` radians; the expression moves the mesh, not its joints' turns."""
    rng = np.random.default_rng(seed)
    rig, _ = parts(avatar)
    joints = {
        name: homogeneous(matrix_from_rotvec(rng.normal(0, turn / np.sqrt(3), 3)), rng.normal(0, 4e-3, 3))
        for name in rig.joint_names
    }
    return Pose({"jawOpen": 0.6}, joints, {"left": 0.8})


def dense(rig: Rig) -> Array:
    weights = np.zeros((len(rig.vertices), rig.joint_count))
    for v in range(len(weights)):
        entries = slice(int(rig.skin.row_ptr[v]), int(rig.skin.row_ptr[v + 1]))
        weights[v, rig.skin.column[entries]] = rig.skin.values["weight"][entries]
    return weights


@cache
def expected(turn: float) -> tuple[Avatar, Pose, Array, Array, Array]:
    """(avatar, pose, means, rotations, turns of the mesh) by the oracle, on the mesh and joints of the pose."""
    avatar = surface_avatar(9, BY_JOINTS)
    (rig, e), pose = parts(avatar), pose_of(avatar, 1, turn)
    player = Player(avatar, "reference")
    joints, vertices = player.posed(pose).skin_matrix, player.mesh(pose)
    weights, floor = dense(rig), 1e-6 / avatar.training_per_bundle**2
    means, rotations, turns = [], [], []
    for i in range(COUNT):
        at, share = int(e.triangle[i]), e.barycentric[i].astype(np.float64)
        turns.append(joint_turns.rotation_under(weights, joints, e.triangles[at], share))
        rotations.append(turns[-1] @ joint_turns.rotation_of(e.local_quat_wxyz[i]))
        height = float(e.displacement[i])
        means.append(joint_turns.point(vertices, e.triangles, at, share, height, floor))
    return avatar, pose, np.array(means), np.array(rotations), np.array(turns)


def rotations_of(splats: Splats) -> Array:
    return np.array([joint_turns.rotation_of(q) for q in splats.quat_wxyz])


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_papers_equations(backend: str, measured: Measure) -> None:
    avatar, pose, means, rotations, turns = expected(0.5)
    splats = Player(avatar, backend).animate(pose)
    assert splats.sh_rotation is not None
    for what, got, want in (
        ("position", splats.mean, means),
        ("rotation", rotations_of(splats), rotations),
        ("turn of colour", splats.sh_rotation, turns),
    ):
        off = float(np.abs(got - want).max())
        measured(
            f"bary_vertex_lbs, {backend}: largest difference of a {what} to PSAvatar's equations", off, 2e-6
        )
        assert off <= 2e-6, what
    np.testing.assert_allclose(splats.scale, np.exp(avatar.gaussians.log_scale), rtol=1e-5)


@pytest.mark.parametrize("backend", BACKENDS)
def test_joints_turn_gaussians_on_a_mesh_from_elsewhere(backend: str) -> None:
    """`posed_vertices` move the Gaussians, the pose's joints turn them."""
    avatar = surface_avatar(2, BY_JOINTS)
    _, e = parts(avatar)
    player, pose = Player(avatar, backend), pose_of(avatar, 3, 0.5)
    by_rig = player.animate(pose)
    given = player.animate(pose, posed_vertices=player.mesh(pose))
    np.testing.assert_array_equal(given.quat_wxyz, by_rig.quat_wxyz)
    np.testing.assert_array_equal(given.mean, by_rig.mean)
    elsewhere = player.animate(pose, posed_vertices=e.canonical_vertices)
    np.testing.assert_array_equal(elsewhere.quat_wxyz, by_rig.quat_wxyz)
    np.testing.assert_allclose(elsewhere.mean, avatar.gaussians.mean, atol=1e-7)
    unturned = player.animate(Pose(), posed_vertices=player.mesh(pose))
    assert np.abs(unturned.quat_wxyz - by_rig.quat_wxyz).max() > 0.05


def test_the_rule_needs_a_rig() -> None:
    with pytest.raises(AvatarError, match=r"rules.rotation: bary_vertex_lbs .* needs a rig"):
        surface_avatar(2, BY_JOINTS, rigged=False)
    with pytest.raises(AvatarError, match="such rules need an embedding"):
        check_avatar(replace(full_avatar(), rules=BY_JOINTS))
    with pytest.raises(AvatarError, match=r"bary_vertex_lbs, normal \| interpolated_normal, none"):
        surface_avatar(2, replace(BY_JOINTS, scale="log_area"))
