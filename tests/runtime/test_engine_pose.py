"""What an engine must set: node transforms that reproduce the skin matrices, weights, names, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from avatar_runtime.avatar import Avatar, Rig
from avatar_runtime.clips import frame_pose
from avatar_runtime.engine_pose import (
    EnginePose,
    bind_nodes,
    engine_clip,
    engine_pose,
    engine_rest,
    rests_bound,
    target_names,
)
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import Pose, joint_rotation, resolve
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.stages.joints import joints
from tests.avatars import CORRECTIVE_JOINTS, EXPRESSIONS, JOINTS, LATE_MORPHS, full_avatar, surface_avatar
from tests.measured import Measure
from tests.rigs import rig_of, scaled_at_rest

Array = npt.NDArray[np.float64]
K, C = len(EXPRESSIONS), len(CORRECTIVE_JOINTS)


def posed(seed: int, angle: float = 0.7, world: Array | None = None) -> Pose:
    """All weights beyond 0..1, all joints turned."""
    rng = np.random.default_rng(seed)
    return Pose(
        {e.name: rng.uniform(-0.3, 1.2) for e in EXPRESSIONS},
        {name: joint_rotation(rng.normal(0, angle / np.sqrt(3), 3)) for name in JOINTS},
        {name: rng.uniform(0, 1) for name in LATE_MORPHS},
        np.eye(4) if world is None else world,
    )


def composed(rig: Rig, pose: EnginePose) -> Array:
    """mesh_from_joint by the definition: T R S down the chain, the quaternion's rotation by v + 2 u x (w v + u x v)."""
    result = np.zeros((rig.joint_count, 4, 4))
    for j, parent in enumerate(rig.parents):
        u, w = pose.rotation_xyzw[j, :3], pose.rotation_xyzw[j, 3]
        local = np.eye(4)
        for axis in range(3):
            v = np.eye(3)[axis]
            local[:3, axis] = (v + 2 * np.cross(u, w * v + np.cross(u, v))) * pose.scale[j, axis]
        local[:3, 3] = pose.translation[j]
        result[j] = local if parent < 0 else result[parent] @ local
    return result


def skin_matrices(avatar: Avatar, pose: EnginePose) -> Array:
    """A as an engine has it."""
    rig = rig_of(avatar)
    result: Array = composed(rig, pose) @ np.linalg.inv(bind_nodes(rig))
    return result


def test_targets_are_named_expressions_then_correctives_then_late_morphs() -> None:
    names = target_names(full_avatar())
    assert names[:K] == full_avatar().expression_names
    assert names[K : K + 9] == tuple(f"corrective_jaw_{r}{c}" for r in range(3) for c in range(3))
    assert names[K + 9 : K + 18] == tuple(f"corrective_leftEye_{r}{c}" for r in range(3) for c in range(3))
    assert names[K + 18 :] == LATE_MORPHS


def test_target_names_that_clash_get_a_number() -> None:
    avatar = full_avatar()
    names = ("corrective_jaw_00", "left", "left_2", "d")
    clash = replace(avatar, expressions=tuple(replace(avatar.expressions[0], name=n) for n in names))
    found = target_names(clash)
    assert found[:4] == names and found[4] == "corrective_jaw_00_2" and found[-2:] == ("left_3", "right")
    assert len(set(found)) == len(found) == K + 9 * C + len(LATE_MORPHS)


def test_bind_nodes_are_rigid_and_stand_where_the_joints_do() -> None:
    avatar = scaled_at_rest(full_avatar(), (1.5, 0.7, 1.2))
    rig, nodes = rig_of(avatar), bind_nodes(rig_of(avatar))
    linear = nodes[:, :3, :3]
    np.testing.assert_allclose(linear @ linear.swapaxes(1, 2), np.tile(np.eye(3), (5, 1, 1)), atol=1e-12)
    assert (np.linalg.det(linear) > 0).all()
    np.testing.assert_allclose(nodes[:, :3, 3], np.linalg.inv(rig.inverse_bind_matrix)[:, :3, 3], atol=1e-6)
    np.testing.assert_allclose(
        bind_nodes(rig_of(full_avatar())), np.linalg.inv(rig_of(full_avatar()).inverse_bind_matrix), atol=1e-6
    )


@pytest.mark.parametrize("seed", range(4))
def test_nodes_reproduce_the_skin_matrices(seed: int, measured: Measure) -> None:
    """Turned rests, joints that expressions move and all: |A_engine - A| in float32 rounding."""
    avatar, pose = full_avatar(seed), posed(seed)
    found = engine_pose(avatar, pose)
    true = joints(rig_of(avatar), resolve(pose, avatar)).skin_matrix
    off = float(np.abs(skin_matrices(avatar, found) - true).max())
    measured("engine_pose: node matrices against the skin matrices, worst entry", off, 5e-7)
    assert off <= 5e-7
    np.testing.assert_allclose(found.scale, 1, atol=1e-6)
    assert np.abs(true - np.eye(4)).max() > 0.3  # or nothing was tested


def test_scaled_and_mirrored_joints_are_exact() -> None:
    avatar = full_avatar()
    delta = joint_rotation([0.3, 0.2, -0.4]) @ np.diag([2.0, 0.5, 1.25, 1.0])
    pose = Pose({}, {"jaw": delta, "leftEye": np.diag([-1.0, 1.0, 1.0, 1.0])})
    found = engine_pose(avatar, pose)
    true = joints(rig_of(avatar), resolve(pose, avatar)).skin_matrix
    np.testing.assert_allclose(skin_matrices(avatar, found), true, atol=1e-6)
    np.testing.assert_allclose(found.scale[2], [2, 0.5, 1.25], atol=1e-6)
    np.testing.assert_allclose(found.scale[3], -1, atol=1e-6)


def test_shear_is_lost_but_no_joint_leaves_its_place() -> None:
    avatar, pose = scaled_at_rest(full_avatar(), (2.0, 0.5, 1.0)), posed(5)
    rig = rig_of(avatar)
    true = joints(rig, resolve(pose, avatar)).skin_matrix
    found = engine_pose(avatar, pose)
    origins = (true @ bind_nodes(rig)[..., 3:])[:, :3, 0]
    np.testing.assert_allclose(composed(rig, found)[:, :3, 3], origins, atol=1e-6)
    assert np.abs(skin_matrices(avatar, found) - true).max() > 0.05


def test_a_joint_of_scale_0_does_not_stop_its_children() -> None:
    avatar = full_avatar()
    pose = Pose({}, {"neck": np.diag([0.0, 0.0, 0.0, 1.0]), "jaw": joint_rotation([0.5, 0, 0])})
    found = engine_pose(avatar, pose)
    state = joints(rig_of(avatar), resolve(pose, avatar))
    np.testing.assert_allclose(skin_matrices(avatar, found), state.skin_matrix, atol=1e-6)
    assert (found.scale[1] == 0).all()


def test_weights_are_expressions_features_and_late_morphs() -> None:
    avatar, pose = full_avatar(), posed(7)
    arrays = resolve(pose, avatar)
    found = engine_pose(avatar, pose).weights
    assert found.dtype == np.float32 and len(found) == len(target_names(avatar))
    assert (found[:K] == arrays.expression_weights).all() and (found[-2:] == arrays.late_weights).all()
    assert (found[K:-2] == joints(rig_of(avatar), arrays).pose_feature).all()
    jaw = pose.joints["jaw"][:3, :3] - np.eye(3)
    np.testing.assert_allclose(found[K + 5], jaw[1, 2], rtol=1e-6)


def test_world_from_avatar_goes_to_the_root_and_nowhere_else() -> None:
    world = homogeneous(matrix_from_rotvec([0.1, -2.0, 0.4]), np.array([0.3, -1.0, 2.0]))
    moved, still = engine_pose(full_avatar(), posed(8, world=world)), engine_pose(full_avatar(), posed(8))
    np.testing.assert_array_equal(moved.translation, still.translation)
    np.testing.assert_array_equal(moved.rotation_xyzw, still.rotation_xyzw)
    np.testing.assert_allclose(moved.root_translation, [0.3, -1, 2])
    half = np.linalg.norm([0.1, -2.0, 0.4]) / 2
    assert abs(abs(moved.root_rotation_xyzw[3]) - abs(np.cos(half))) < 1e-12
    np.testing.assert_array_equal(still.root_rotation_xyzw, [0, 0, 0, 1])


def test_rest_is_the_rest_skeleton_without_weights() -> None:
    avatar = scaled_at_rest(full_avatar(), (1.5, 0.7, 1.2))
    rest = engine_rest(avatar)
    np.testing.assert_allclose(composed(rig_of(avatar), rest), bind_nodes(rig_of(avatar)), atol=1e-12)
    assert not rest.weights.any() and len(rest.weights) == len(target_names(avatar))
    np.testing.assert_allclose(rest.scale, 1, atol=1e-12)
    nothing = engine_pose(avatar, Pose())
    np.testing.assert_allclose(nothing.translation, rest.translation, atol=1e-6)
    np.testing.assert_allclose(nothing.rotation_xyzw, rest.rotation_xyzw, atol=1e-6)


def test_a_clip_is_its_frames_without_jumps_of_sign() -> None:
    """The neck turns by more than a whole turn, so that frame by frame signs would jump."""
    avatar = full_avatar()
    clip = avatar.clips[0]
    delta = np.repeat(clip.joint_delta, 5, axis=0)
    delta[:, 1] = homogeneous(matrix_from_rotvec(np.linspace(0, 7, len(delta))[:, None] * [0.6, 0, 0.8]))
    delta[:, 0] = np.eye(4)
    every = {
        name: np.repeat(getattr(clip, name), 5, axis=0) for name in ("expression_weights", "late_weights")
    }
    world = homogeneous(matrix_from_rotvec(np.linspace(0, 7, len(delta))[:, None] * [0, 1.0, 0]))
    clip = replace(clip, joint_delta=delta, world_from_avatar=world.astype(np.float32), **every)
    found = engine_clip(avatar, clip)
    signs = []
    for t in range(clip.frames):
        one = engine_pose(avatar, frame_pose(avatar, clip, t))
        for name in ("translation", "scale", "weights", "root_translation"):
            np.testing.assert_allclose(getattr(found, name)[t], getattr(one, name), atol=1e-7)
        for name in ("rotation_xyzw", "root_rotation_xyzw"):
            dot = np.sum(getattr(found, name)[t] * getattr(one, name), axis=-1)
            np.testing.assert_allclose(np.abs(dot), 1, atol=1e-12)
            signs.append(np.min(dot))
    assert min(signs) < 0  # the single poses do jump
    for quat in (found.rotation_xyzw, found.root_rotation_xyzw):
        assert (np.sum(quat[1:] * quat[:-1], axis=-1) > 0.9).all()


@pytest.mark.parametrize("noise", [-1e-9, 1e-9])
def test_rounding_flips_no_sign_at_half_turns(noise: float) -> None:
    world = homogeneous(matrix_from_rotvec(np.array([0, -(np.pi + noise), 0])), np.zeros(3))
    found = engine_pose(full_avatar(), Pose(world_from_avatar=world))
    np.testing.assert_allclose(found.root_rotation_xyzw, [0, 1, 0, 0], atol=1e-8)


def test_bad_poses_are_refused() -> None:
    avatar = full_avatar()
    with pytest.raises(AvatarError, match="no rig"):
        engine_pose(surface_avatar(rigged=False), Pose())
    with pytest.raises(AvatarError, match=r"^joint neck: .*float32"):
        engine_pose(avatar, Pose({}, {"neck": np.diag([1e300, 1.0, 1.0, 1.0])}))
    with pytest.raises(AvatarError, match="float32"):
        tiny = np.diag([1e-300, 1e-300, 1e-300, 1.0])
        engine_pose(avatar, Pose({}, {"neck": tiny, "jaw": np.linalg.inv(tiny)}))
    with pytest.raises(AvatarError, match="jawOpn"):
        engine_pose(avatar, Pose({"jawOpn": 1.0}))
    rig = rig_of(avatar)
    far = rig.rest_local.copy()
    far[0, 0, 0] = far[1, 0, 0] = 3e38
    with pytest.raises(AvatarError, match=r"^joint \w+: its rest transform"):
        bind_nodes(replace(rig, rest_local=far))


def resting_elsewhere() -> Avatar:
    """Joints that turn, push and stretch at rest, unevenly."""
    avatar, rng = full_avatar(), np.random.default_rng(3)
    rig = rig_of(avatar)
    stretch = np.exp(rng.normal(0, 0.2, (rig.joint_count, 1, 3)))
    push = homogeneous(matrix_from_rotvec(rng.normal(0, 0.3, (rig.joint_count, 3))) * stretch)
    push[:, :3, 3] = rng.normal(0, 0.01, (rig.joint_count, 3))
    return replace(avatar, rig=replace(rig, rest_local=(rig.rest_local @ push).astype(np.float32)))


def test_a_rig_that_rests_elsewhere_stands_there() -> None:
    avatar = resting_elsewhere()
    rig = rig_of(avatar)
    assert rests_bound(rig_of(full_avatar())) and not rests_bound(rig)
    np.testing.assert_allclose(bind_nodes(rig), np.linalg.inv(rig.inverse_bind_matrix), atol=1e-6)
    np.testing.assert_allclose(bind_nodes(rig), bind_nodes(rig_of(full_avatar())), atol=1e-6)
    rest, posed = engine_rest(avatar), engine_pose(avatar, Pose())
    for name in ("translation", "rotation_xyzw", "scale", "weights"):
        np.testing.assert_array_equal(getattr(rest, name), getattr(posed, name))
    true = joints(rig, resolve(Pose(), avatar)).skin_matrix
    np.testing.assert_allclose(skin_matrices(avatar, rest), true, atol=1e-6)
    assert np.abs(true - np.eye(4)).max() > 0.2 and np.abs(rest.scale - 1).max() > 0.2
