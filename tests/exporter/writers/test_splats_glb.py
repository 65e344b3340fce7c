"""splats.glb, read back by the oracle: the Gaussians in the units and order of KHR_gaussian_splatting."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from avatar_export.writers.splats_glb import splats_glb
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.avatars import COUNT, full_avatar, surface_avatar
from tests.oracles.gltf_pose import File, quaternion_matrix

PREFIX = "KHR_gaussian_splatting:"


def written(avatar: Avatar) -> File:
    return File(b"".join(splats_glb(avatar)))


def with_gaussians(avatar: Avatar, **fields: Any) -> Avatar:
    return replace(avatar, gaussians=replace(avatar.gaussians, **fields))


@pytest.mark.parametrize("make", [full_avatar, surface_avatar])
def test_attributes_are_the_activated_gaussians(make: Any) -> None:
    avatar = make()
    g, file = avatar.gaussians, written(avatar)
    np.testing.assert_array_equal(file.attribute("POSITION"), g.mean.astype(np.float64))
    np.testing.assert_allclose(
        file.attribute(PREFIX + "SCALE"), np.exp(g.log_scale.astype(np.float64)), rtol=3e-7
    )
    opacity = 1 / (1 + np.exp(-g.opacity_logit.astype(np.float64)))
    np.testing.assert_allclose(file.attribute(PREFIX + "OPACITY")[:, 0], opacity, rtol=3e-7)
    quat = file.attribute(PREFIX + "ROTATION")
    np.testing.assert_allclose(np.linalg.norm(quat, axis=1), 1, atol=1e-7)
    for row in range(COUNT):
        w, x, y, z = g.quat_wxyz[row].astype(np.float64)
        np.testing.assert_allclose(quaternion_matrix(quat[row]), quaternion_matrix([x, y, z, w]), atol=1e-6)
    for k in range(9):  # degree 3 is stored, 2 is active
        degree = int(np.sqrt(k))
        coefficient = file.attribute(f"{PREFIX}SH_DEGREE_{degree}_COEF_{k - degree * degree}")
        np.testing.assert_array_equal(coefficient, g.sh[:, k].astype(np.float64))
    names = set(file.json["meshes"][0]["primitives"][0]["attributes"])
    assert len(names) == 2 + 3 + 9 and not any("SH_DEGREE_3" in name for name in names)


def test_the_binding_pose_is_what_the_runtime_draws_at_rest() -> None:
    avatar = surface_avatar()
    splats, file = Player(avatar).animate(Pose()), written(avatar)
    # The runtime's mesh at rest is the rig's template; the file's is the canonical one.
    assert np.abs(file.attribute("POSITION") - splats.mean).max() < 0.05
    avatar = full_avatar()
    splats, file = Player(avatar).animate(Pose()), written(avatar)
    np.testing.assert_allclose(file.attribute("POSITION"), splats.mean, atol=1e-6)
    np.testing.assert_allclose(file.attribute(PREFIX + "SCALE"), splats.scale, rtol=1e-6)


def test_the_fallback_colour_is_linear_and_straight() -> None:
    sh = np.zeros((COUNT, 16, 3), np.float32)
    sh[:, 0] = (np.array([0.2, 0.5, 1.5]) - 0.5) / 0.28209479177387814
    avatar = with_gaussians(full_avatar(), sh=sh, opacity_logit=np.zeros(COUNT, np.float32))
    colour = written(avatar).attribute("COLOR_0")
    decoded = [((0.2 + 0.055) / 1.055) ** 2.4, ((0.5 + 0.055) / 1.055) ** 2.4, 1.0, 0.5]
    np.testing.assert_allclose(colour, np.tile(decoded, (COUNT, 1)), atol=0.51 / 255)


def test_the_document_says_how_to_read_it() -> None:
    document = written(full_avatar()).json
    primitive = document["meshes"][0]["primitives"][0]
    assert primitive["mode"] == 0 and "indices" not in primitive and "material" not in primitive
    assert primitive["extensions"]["KHR_gaussian_splatting"] == {
        "kernel": "ellipse",
        "colorSpace": "srgb_rec709_display",
        "projection": "perspective",
        "sortingMethod": "cameraDistance",
    }
    assert document["extensionsUsed"] == ["KHR_gaussian_splatting"] and "extensionsRequired" not in document
    assert len(document["meshes"]) == 1 and document["nodes"] == [{"mesh": 0, "name": "avatar_splats"}]
    position = document["accessors"][primitive["attributes"]["POSITION"]]
    mean = full_avatar().gaussians.mean
    assert position["min"] == mean.min(axis=0).tolist() and position["max"] == mean.max(axis=0).tolist()
    assert all(a["count"] == COUNT for a in document["accessors"])


def test_numbers_that_linear_float32_does_not_hold() -> None:
    g = full_avatar().gaussians
    log_scale, quat, logit = g.log_scale.copy(), g.quat_wxyz.copy(), g.opacity_logit.copy()
    log_scale[0], log_scale[1] = 1e4, -1e4
    quat[0], quat[1], quat[2] = 0, 1e-30, 3e38
    logit[0], logit[1] = 1e30, -1e30
    file = written(with_gaussians(full_avatar(), log_scale=log_scale, quat_wxyz=quat, opacity_logit=logit))
    assert (file.attribute(PREFIX + "SCALE")[:2] == [[np.finfo(np.float32).max] * 3, [0] * 3]).all()
    np.testing.assert_array_equal(file.attribute(PREFIX + "ROTATION")[0], [0, 0, 0, 1])
    np.testing.assert_allclose(file.attribute(PREFIX + "ROTATION")[1:3], 0.5)
    np.testing.assert_array_equal(file.attribute(PREFIX + "OPACITY")[:2, 0], [1, 0])


def test_coefficients_are_copied_one_at_a_time() -> None:
    """Whatever N is: the largest piece is an attribute, not all of the SH."""
    sizes = [len(piece) for piece in splats_glb(full_avatar())]
    assert max(sizes[2:]) == 16 * COUNT and sizes.count(12 * COUNT) == 2 + 9
