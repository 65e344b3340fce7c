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
from avatar_runtime.conformance import make_reference
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.stages.activate import Splats
from tests.avatars import COUNT, full_avatar, surface_avatar
from tests.conformance.cases import cases_of
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


@pytest.mark.parametrize("backend", ["cpu", "gl"])
@pytest.mark.parametrize("direction", ["inverse_rotation", "world"])
@pytest.mark.parametrize("position", ["interpolated_normal", "normal"])
def test_the_backends_agree(backend: str, direction: str, position: str, measured: Measure) -> None:
    rules = replace(BY_JOINTS, sh_direction=direction, position=position)
    for seed in range(3):
        avatar = surface_avatar(seed, rules)
        world = homogeneous(matrix_from_rotvec(np.array([0.3, -0.8, 0.2])), np.array([0.1, 0.2, 0.3]))
        pose = replace(pose_of(avatar, seed, 0.9), world_from_avatar=world)
        got, want = (Player(avatar, name).animate(pose) for name in (backend, "reference"))
        for name in ("mean", "scale", "quat_wxyz", "sh_rotation"):
            off = float(np.abs(getattr(got, name) - getattr(want, name)).max())
            measured(f"bary_vertex_lbs, {backend}: largest difference of {name} to the reference", off, 1e-6)
            assert off <= 1e-6, name


def test_what_the_oracle_would_find() -> None:
    """The other order of Eq. 10, a transposed turn and a sum that is not a rotation differ clearly from the result."""
    avatar, pose, _, rotations, turns = expected(0.5)
    (rig, e), joints = parts(avatar), Player(avatar, "reference").posed(pose).skin_matrix
    local = np.array([joint_turns.rotation_of(q) for q in e.local_quat_wxyz])
    blended = np.einsum("vj,jrs->vrs", dense(rig), joints[:, :3, :3])[e.vertex_ids]
    unrotated = np.einsum("nc,ncrs->nrs", e.barycentric, blended)
    assert np.abs(local @ turns - rotations).max() > 0.1
    assert np.abs(turns.transpose(0, 2, 1) @ local - rotations).max() > 0.1
    assert np.abs(unrotated - turns).max() > 0.01


def test_three_steps_are_near_the_polar_factor(measured: Measure) -> None:
    """The rule has as many Newton steps as `polar3`; they do not converge if the corners' rotations differ strongly."""
    for turn, limit in ((0.5, 2e-6), (1.0, 1e-2)):
        avatar, pose, _, _, turns = expected(turn)
        splats = Player(avatar, "reference").animate(pose)
        assert splats.sh_rotation is not None
        off = float(np.abs(splats.sh_rotation - turns).max())
        measured(
            f"bary_vertex_lbs: three steps, largest difference to the polar factor, {turn} rad", off, limit
        )
        assert off <= limit


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_head_that_turns_as_a_whole_turns_its_splats(backend: str) -> None:
    """By R R', not by R' R: the root joint alone moves."""
    avatar = surface_avatar(2, BY_JOINTS)
    rig, _ = parts(avatar)
    turn = matrix_from_rotvec(np.array([0.4, -0.7, 0.3]))
    rest = rig.rest_local[0].astype(np.float64)
    delta = np.linalg.inv(rest) @ homogeneous(turn) @ rest
    delta[3] = (0, 0, 0, 1)
    player = Player(avatar, backend)
    still, moved = player.animate(Pose()), player.animate(Pose(joints={rig.joint_names[0]: delta}))
    np.testing.assert_allclose(moved.mean, still.mean @ turn.T, atol=1e-6)
    np.testing.assert_allclose(rotations_of(moved), turn @ rotations_of(still), atol=3e-6)
    np.testing.assert_allclose(moved.scale, still.scale, rtol=1e-6)


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


def test_nothing_turns_in_the_binding_pose() -> None:
    avatar = surface_avatar(2, BY_JOINTS)
    _, e = parts(avatar)
    np.testing.assert_array_equal(avatar.gaussians.quat_wxyz, e.local_quat_wxyz)


def test_the_rule_needs_a_rig() -> None:
    with pytest.raises(AvatarError, match=r"rules.rotation: bary_vertex_lbs .* needs a rig"):
        surface_avatar(2, BY_JOINTS, rigged=False)
    with pytest.raises(AvatarError, match="such rules need an embedding"):
        check_avatar(replace(full_avatar(), rules=BY_JOINTS))
    with pytest.raises(AvatarError, match=r"bary_vertex_lbs, normal \| interpolated_normal, none"):
        surface_avatar(2, replace(BY_JOINTS, scale="log_area"))


def test_stage_bind_of_a_reference_is_given_the_matrices() -> None:
    for rules, given in ((BY_JOINTS, True), (Rules("vertex_quaternion"), False)):
        avatar = surface_avatar(2, rules)
        reference = make_reference(avatar, cases_of("surface_joints", avatar), rows=8, pixels=8)
        (bind,) = [s for s in reference.cases[0].steps if s.stage == "bind"]
        assert ("skin_matrix" in bind.inputs) == given and "posed_vertices" in bind.inputs
