"""Each stage alone: fed with what the released code had before it, held against what it computed next."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_runtime.camera import Camera
from avatar_runtime.rotation import homogeneous, polar, quat_from_matrix, quat_multiply
from avatar_runtime.stages.activate import activate
from avatar_runtime.stages.bind import rows_of
from avatar_runtime.stages.blend import blend
from avatar_runtime.stages.groups import anchor_transform, joint_mix
from avatar_runtime.stages.joints import joints, rest_transforms
from avatar_runtime.stages.morph import morph
from avatar_runtime.stages.skin import skin, transform
from avatar_runtime.stages.sparse import combine, gather
from tests.golden import FRAMES, Array, BlendshapesGolden
from tests.runtime.stages.golden_model import GoldenModel, bound, golden_joints

METRES = 1e-6
UNIT = 2e-6  # rotations, SH, opacity; scale relative
GROUPS = ("face", "upper", "lower")


@pytest.fixture(scope="module")
def model(blendshapes_golden: BlendshapesGolden) -> GoldenModel:
    return GoldenModel(blendshapes_golden)


@pytest.fixture(params=FRAMES)
def frame(request: pytest.FixtureRequest, model: GoldenModel) -> dict[str, Array]:
    return model.frames[request.param]


def near(got: Array, want: Array, tolerance: float) -> None:
    np.testing.assert_allclose(got, want, rtol=0, atol=tolerance)


def test_joints(model: GoldenModel, frame: dict[str, Array]) -> None:
    got = joints(model.rig, model.pose(frame))
    near(got.skin_matrix, frame["A"], METRES)
    near(got.pose_feature, frame["pose_feature"], UNIT)
    near(got.rest_position, frame["joints_rest"], METRES)
    near(got.position, frame["joints_posed"], METRES)


def test_the_neutral_mesh_has_the_subjects_identity(model: GoldenModel) -> None:
    near(model.rig.vertices, model.static["vertices_neutral"], METRES)
    near(rest_transforms(model.rig)[:, :3, 3], model.static["joints_neutral"], METRES)


def test_morph_and_skin(model: GoldenModel, frame: dict[str, Array]) -> None:
    pose, rows = model.pose(frame), model.source.vertex_rows
    morphed = morph(model.rig, pose.expression_weights, frame["pose_feature"])
    without_eyelids = skin(model.rig, morphed, frame["A"], np.zeros(2, np.float32))
    near(without_eyelids[rows], frame["mesh_vertices_before_eyelids"], METRES)
    near(skin(model.rig, morphed, frame["A"], pose.late_weights)[rows], frame["mesh_vertices"], METRES)


def test_blend(model: GoldenModel, frame: dict[str, Array]) -> None:
    avatar, n = model.avatar, len(model.source.face_rows)
    got = blend(avatar.gaussians, avatar.blendshapes, model.pose(frame).expression_weights)
    near(got.mean[:n], frame["face_1_blended_xyz"], METRES)
    near(got.quat_wxyz[:n], frame["face_1_blended_rotation_raw"], UNIT)
    near(got.sh[:n], frame["face_1_blended_sh"], UNIT)
    near(got.log_scale[:n], frame["face_1_blended_scale_log"], UNIT)
    near(got.opacity_logit[:n, None], frame["face_1_blended_opacity_logit"], UNIT)
    for name in ("mean", "quat_wxyz", "sh", "log_scale", "opacity_logit"):
        np.testing.assert_array_equal(
            getattr(got, name)[n:], getattr(avatar.gaussians, name)[n:], err_msg=name
        )


def test_pose_correctives(model: GoldenModel, frame: dict[str, Array]) -> None:
    n = len(model.source.face_rows)
    offset = combine(model.avatar.blendshapes.correctives, frame["pose_feature"])["mean"]
    near(offset[:n], frame["face_2_pose_offset"], METRES)


def test_skinning_of_gaussians(model: GoldenModel, frame: dict[str, Array]) -> None:
    n = len(model.source.face_rows)
    matrix = gather(rows_of(model.avatar.skin, 0, n), frame["A"])
    near(matrix, frame["face_3_skin_matrix"], UNIT)
    near(matrix, frame["face_3_skin_matrix_diff"], UNIT)
    moved = transform(frame["face_3_skin_matrix"][:, :3], frame["face_2_posed_xyz"])
    near(moved, frame["face_3_skinned_xyz"], METRES)


def test_eyelids_of_gaussians(model: GoldenModel, frame: dict[str, Array]) -> None:
    n = len(model.source.face_rows)
    late = combine(model.avatar.blendshapes.late_morphs, frame["eyelids"])["mean"]
    near(frame["face_3_skinned_xyz"] + late[:n], frame["face_4_eyelid_xyz"], METRES)


def test_polar_and_quaternion(frame: dict[str, Array]) -> None:
    near(polar(frame["face_3_skin_matrix"][:, :3, :3]), frame["face_5_lbs_rotation"], UNIT)
    near(quat_from_matrix(frame["face_5_lbs_rotation"]), frame["face_5_lbs_quaternion"], UNIT)
    near(polar(frame["lower_M"][:3, :3]), frame["lower_R"], UNIT)
    turned = quat_multiply(frame["face_5_lbs_quaternion"], frame["face_5_rotation_unit"])
    near(turned, frame["face_rotation"], UNIT)


@pytest.mark.parametrize(("rule", "suffix"), [("repeats", ""), ("unique", "_unique")])
def test_anchor_transform(model: GoldenModel, frame: dict[str, Array], rule: str, suffix: str) -> None:
    neutral = model.static["vertices_neutral"]
    got = anchor_transform(neutral, model.anchors, model.posed_anchors(frame), rule)
    near(got[:3, :3], frame[f"upper_R{suffix}"], UNIT)
    near(got[:3, 3], frame[f"upper_t{suffix}"], METRES)


def test_joint_mix(model: GoldenModel, frame: dict[str, Array]) -> None:
    near(joint_mix(model.avatar, model.avatar.groups[2], golden_joints(frame)), frame["lower_M"], METRES)


def test_bind_and_activate(model: GoldenModel, frame: dict[str, Array]) -> None:
    got = activate(bound(model, frame))
    for group, name in zip(model.avatar.groups, GROUPS, strict=True):
        rows = slice(group.first, group.first + group.count)
        near(got.mean[rows], frame[f"{name}_xyz"], METRES)
        near(got.quat_wxyz[rows], frame[f"{name}_rotation"], UNIT)
        np.testing.assert_allclose(got.scale[rows], frame[f"{name}_scale"], rtol=UNIT)
        near(got.opacity[rows, None], frame[f"{name}_opacity"], UNIT)


def test_world_from_avatar_moves_the_bound_gaussians(model: GoldenModel) -> None:
    """Placed by a rotation of the camera's inverse, every Gaussian lies where the camera saw it."""
    frame = model.frames[3]
    world = homogeneous(frame["camera_R"].astype(np.float64), frame["camera_t"].astype(np.float64))
    here, there = bound(model, frame), bound(model, frame, world)
    mean = here.gaussians.mean @ frame["camera_R"].T + frame["camera_t"]
    near(there.gaussians.mean, mean, METRES)
    near(there.rotation, frame["camera_R"] @ here.rotation, UNIT)


def test_camera(frame: dict[str, Array]) -> None:
    height, width = (int(size) for size in frame["image_size"])
    got = Camera.from_opencv(frame["camera_R"], frame["camera_t"], frame["camera_K"], width, height)
    np.testing.assert_array_equal(got.camera_from_world, frame["view_matrix_t"].T)
    np.testing.assert_allclose(got.clip_from_world, frame["view_proj_matrix_t"].T, rtol=UNIT, atol=UNIT)
    near(got.centre, frame["camera_centre"], METRES)
    near(2 * np.arctan([got.tan_half_fov_x, got.tan_half_fov_y]), [frame["fov_x"], frame["fov_y"]], 1e-7)
