"""Framing: what a camera must show of the avatar at rest and of its head; and the still image."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from avatar_export.images import FOV_Y, frame_camera
from avatar_export.measure.framing import framing, preview_webp, still_pose
from avatar_runtime.avatar import Avatar, Group
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.stages.sparse import gather
from tests.avatars import COUNT, JOINTS, full_avatar, surface_avatar

Array = npt.NDArray[np.float64]


def corners(part: dict[str, list[float]]) -> tuple[Array, Array]:
    target, size = np.array(part["target"]), np.array(part["size"])
    return target - size / 2, target + size / 2


def opaque(avatar: Avatar) -> Avatar:
    solid = np.full(avatar.gaussians.count, 2.0, np.float32)
    return replace(avatar, gaussians=replace(avatar.gaussians, opacity_logit=solid))


def skinned() -> Avatar:
    """All Gaussians in one skinned group, none of them faint; the skeleton's neck is the joint of the head."""
    return replace(opaque(full_avatar()), groups=(Group("face", 0, COUNT, "skin"),))


@pytest.mark.parametrize("make", [skinned, surface_avatar])
def test_the_whole_avatar_lies_inside(make: Callable[[], Avatar]) -> None:
    avatar = opaque(make())
    found = framing(avatar)
    mean = Player(avatar, "reference").animate(Pose()).mean
    low, high = corners(found["whole"])
    assert (mean > low).all() and (mean < high).all()
    np.testing.assert_allclose(high - low, 1.08 * np.ptp(mean, axis=0), rtol=0.05)
    assert found["up"] == [0, 1, 0] and found["front"] == [0, 0, 1]
    json.dumps(found, allow_nan=False)


def test_the_documented_distance_is_that_of_the_camera_of_render() -> None:
    w, h, d = size = np.array(framing(skinned())["whole"]["size"])
    low, high = corners(framing(skinned())["whole"])
    camera = frame_camera(((low + high) / 2 - size / 2 / 1.08, (low + high) / 2 + size / 2 / 1.08), 60, 40)
    ty = np.tan(FOV_Y / 2)
    distance = max(h / ty, max(w, d) / (ty * 60 / 40)) / 2 + np.hypot(w, d) / 2
    assert np.linalg.norm(camera.centre - (low + high) / 2) == pytest.approx(distance, rel=1e-5)


def test_the_head_is_what_follows_its_joint() -> None:
    avatar = skinned()
    mask = np.array([name != "root" for name in JOINTS], np.float32)  # `neck` and its descendants
    follows = gather(avatar.skin, mask[:, None])[:, 0] > 0.5
    assert 16 < follows.sum() < COUNT
    low, high = corners(framing(avatar)["head"])
    mean = Player(avatar, "reference").animate(Pose()).mean[follows]
    np.testing.assert_allclose((low + high) / 2, (mean.min(axis=0) + mean.max(axis=0)) / 2, atol=2e-3)
    np.testing.assert_allclose(high - low, 1.08 * np.ptp(mean, axis=0), rtol=0.05)


def test_the_head_of_a_surface_follows_its_triangles() -> None:
    avatar = opaque(surface_avatar())
    assert avatar.rig is not None and avatar.embedding is not None
    mask = np.array([name != "root" for name in JOINTS], np.float32)
    vertex = gather(avatar.rig.skin, mask[:, None])[:, 0]
    follows = (avatar.embedding.barycentric * vertex[avatar.embedding.vertex_ids]).sum(axis=1) > 0.5
    assert 16 < follows.sum() < COUNT
    low, high = corners(framing(avatar)["head"])
    mean = Player(avatar, "reference").animate(Pose()).mean[follows]
    np.testing.assert_allclose(high - low, 1.08 * np.ptp(mean, axis=0), rtol=0.05)


def test_joints_are_found_by_name_where_driving_names_none() -> None:
    avatar = skinned()
    assert avatar.rig is not None
    silent = replace(avatar, driving=replace(avatar.driving, head_joint=None))
    assert framing(silent) == framing(avatar)
    other = replace(silent, rig=replace(avatar.rig, joint_names=("root", "a", "b", "c", "d")))
    assert framing(other)["head"] is None and framing(other)["whole"] == framing(avatar)["whole"]


def test_faint_gaussians_set_no_frame() -> None:
    avatar = skinned()
    g = avatar.gaussians
    mean, logit = g.mean.copy(), g.opacity_logit.copy()
    mean[5], logit[5] = 3.0, -6.0
    stray = replace(avatar, gaussians=replace(g, mean=mean, opacity_logit=logit))
    assert max(framing(stray)["whole"]["size"]) < 1
    logit[5] = 2.0
    solid = replace(avatar, gaussians=replace(g, mean=mean, opacity_logit=logit))
    assert min(framing(solid)["whole"]["size"]) > 2


def test_the_preview_is_the_avatar_on_nothing() -> None:
    avatar = opaque(full_avatar())
    data = preview_webp(avatar, 48)
    assert data == preview_webp(avatar, 48)
    image = Image.open(io.BytesIO(data))
    assert (image.format, image.mode, image.size) == ("WEBP", "RGBA", (48, 48))
    alpha = np.asarray(image)[..., 3]
    assert alpha[0].max() == 0 and alpha.max() > 200
    bright = replace(avatar, raster=replace(avatar.raster, background=(1.0, 1.0, 1.0)))
    assert preview_webp(bright, 48) == data


def test_faces_are_shown_at_rest_and_bodies_in_motion() -> None:
    avatar = full_avatar()
    assert still_pose(avatar) == Pose()
    clip = replace(avatar.clips[0], expression_weights=avatar.clips[0].expression_weights[:, :0])
    body = replace(avatar, expressions=(), clips=(clip,))
    pose = still_pose(body)
    np.testing.assert_array_equal(pose.joints["jaw"], avatar.clips[0].joint_delta[2][JOINTS.index("jaw")])
    np.testing.assert_array_equal(pose.world_from_avatar, np.eye(4))
    assert still_pose(replace(body, clips=())) == Pose()
