"""What must hold of joints, skin and bind for any avatar, beyond what the golden head happens to exercise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.pose import Pose, joint_rotation, resolve
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.stages.activate import activate
from avatar_runtime.stages.bind import Bound, bind
from avatar_runtime.stages.blend import blend
from avatar_runtime.stages.groups import anchor_transform, group_transforms
from avatar_runtime.stages.joints import Joints, joints, rest_transforms
from avatar_runtime.stages.project import Projected, project
from tests.avatars import full_avatar
from tests.golden import Array

EXPRESSION = {"jawOpen": 0.7, "mouthSmileLeft": -0.4, "exp_003": 1.0}
TURNED = {"neck": joint_rotation([0.2, -0.5, 0.1]), "jaw": joint_rotation([0.4, 0.1, 0.0])}
WORLD = homogeneous(matrix_from_rotvec(np.array([0.3, 1.1, -0.4])), np.array([0.2, -0.1, 0.3]))


def state_of(avatar: Avatar, pose: Pose) -> Joints:
    assert avatar.rig is not None
    return joints(avatar.rig, resolve(pose, avatar))


def bound(avatar: Avatar, pose: Pose) -> Bound:
    """Stage `bind` with the rig's own anchor vertices, pushed aside a little."""
    arrays = resolve(pose, avatar)
    blended = blend(avatar.gaussians, avatar.blendshapes, arrays.expression_weights)
    state = anchors = None
    matrix = np.zeros((0, 4, 4), np.float32)
    feature = np.zeros(avatar.blendshapes.correctives.columns, np.float32)
    if avatar.rig is not None:
        state = joints(avatar.rig, arrays)
        matrix, feature = state.skin_matrix, state.pose_feature
        anchors = avatar.rig.vertices[avatar.rig.anchor_vertices] + np.float32(0.01)
    groups = group_transforms(avatar, state, anchors)
    return bind(avatar, blended, matrix, feature, arrays.late_weights, groups, arrays.world_from_avatar)


def test_a_turned_joint_carries_its_children_and_only_them() -> None:
    avatar = full_avatar()
    state = state_of(avatar, Pose(joints={"neck": TURNED["neck"]}))
    names = avatar.rig.joint_names
    root, neck = state.skin_matrix[names.index("root")], state.skin_matrix[names.index("neck")]
    np.testing.assert_allclose(root, np.eye(4), atol=1e-6)
    for child in ("jaw", "leftEye", "rightEye"):
        np.testing.assert_allclose(state.skin_matrix[names.index(child)], neck, atol=1e-6)
    # The delta turns in the joint's own rest frame, about the joint.
    rest = rest_transforms(avatar.rig)[names.index("neck"), :3, :3]
    np.testing.assert_allclose(neck[:3, :3], rest @ TURNED["neck"][:3, :3] @ rest.T, atol=1e-6)
    np.testing.assert_allclose(state.position[1], state.rest_position[1], atol=1e-6)


def test_rotation_rules() -> None:
    """`head_bone` turns every skinned Gaussian as one joint; `none` moves it without turning."""
    avatar, pose, face = full_avatar(), Pose(joints=TURNED), slice(0, 24)
    polar3 = bound(avatar, pose)
    jaw = avatar.rig.joint_names.index("jaw")
    head = bound(
        replace(avatar, rules=replace(avatar.rules, rotation="head_bone", rotation_joint="jaw")), pose
    )
    want = state_of(avatar, pose).skin_matrix[jaw, :3, :3]
    np.testing.assert_allclose(head.rotation[face], [want] * 24, atol=1e-6)
    none = bound(replace(avatar, rules=replace(avatar.rules, rotation="none")), pose)
    np.testing.assert_array_equal(none.rotation[face], [np.eye(3)] * 24)
    np.testing.assert_allclose(none.gaussians.quat_wxyz[face], avatar.gaussians.quat_wxyz[face], atol=1e-6)
    for other in (head, none):
        np.testing.assert_array_equal(other.gaussians.mean, polar3.gaussians.mean)


def test_anchor_rules_weight_repeats() -> None:
    """Moving one vertex of many copies pulls `repeats` further than `unique`."""
    rng = np.random.default_rng(3)
    index = np.array([0, 0, 0, 0, 1, 2, 3, 4])
    points = rng.normal(size=(5, 3)).astype(np.float32)
    posed = points.copy()
    posed[0] += [0.5, 0, 0]
    repeats = anchor_transform(points, index, posed[index], "repeats")
    unique = anchor_transform(points, index, posed[index], "unique")
    np.testing.assert_allclose(unique, anchor_transform(points, np.arange(5), posed, "repeats"), atol=1e-6)
    assert np.abs(repeats - unique).max() > 0.05
    for fit in (repeats, unique):
        np.testing.assert_allclose(fit[:3, :3] @ fit[:3, :3].T, np.eye(3), atol=1e-6)
        assert np.linalg.det(fit[:3, :3]) == pytest.approx(1, abs=1e-5)


def seen(avatar: Avatar, pose: Pose, camera: Camera) -> Projected:
    return project(activate(bound(avatar, pose)), camera, avatar.raster, avatar.sh_degree)


@pytest.mark.parametrize(
    ("name", "tolerance"), [("centre", 1e-4), ("depth", 1e-6), ("conic", 1e-5), ("rgb", 1e-5)]
)
def test_the_avatar_and_the_camera_moved_alike_give_the_same_splats(name: str, tolerance: float) -> None:
    """Position, shape and view-dependent colour all go along with world_from_avatar."""
    avatar = full_avatar()
    rotation, translation = matrix_from_rotvec(np.array([0.1, 3.0, 0.05])), np.array([0.0, 0.0, 0.6])
    k = np.array([[300.0, 0, 64], [0, 300, 64], [0, 0, 1]])
    here = Camera.from_opencv(rotation, translation, k, 128, 128)
    moved = homogeneous(rotation, translation) @ np.linalg.inv(WORLD)
    there = Camera.from_opencv(moved[:3, :3], moved[:3, 3], k, 128, 128)
    want = seen(avatar, Pose(EXPRESSION, TURNED), here)
    got = seen(avatar, Pose(EXPRESSION, TURNED, world_from_avatar=WORLD), there)
    assert (want.radius > 0).sum() > 30
    np.testing.assert_allclose(getattr(got, name), getattr(want, name), rtol=tolerance, atol=tolerance)


def test_an_anchor_group_needs_its_vertices() -> None:
    avatar, arrays = full_avatar(), resolve(Pose(), full_avatar())
    with pytest.raises(ValueError, match="anchor vertices"):
        group_transforms(avatar, joints(avatar.rig, arrays), None)


def test_activate_leaves_training_space() -> None:
    """exp, logistic function and unit length; extreme logits neither overflow nor warn."""
    avatar = full_avatar()
    logit = avatar.gaussians.opacity_logit.copy()
    logit[:4] = [-200, 200, 0, 20]
    quat: Array = avatar.gaussians.quat_wxyz.copy()
    quat[0] = 0
    gaussians = replace(avatar.gaussians, opacity_logit=logit, quat_wxyz=quat)
    got = activate(Bound(gaussians, np.tile(np.eye(3, dtype=np.float32), (48, 1, 1))))
    wide = logit.astype(np.float64)
    np.testing.assert_allclose(got.opacity, 1 / (1 + np.exp(-wide)), rtol=1e-6, atol=1e-30)
    np.testing.assert_allclose(got.scale, np.exp(gaussians.log_scale.astype(np.float64)), rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(got.quat_wxyz[1:], axis=1), 1, atol=1e-6)
    np.testing.assert_array_equal(got.quat_wxyz[0], 0)
    assert got.opacity.dtype == got.scale.dtype == got.quat_wxyz.dtype == np.float32
