"""Framing: what a camera must show of the avatar at rest and of its head."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.measure.framing import framing
from avatar_export.measure.height_px import height_px
from avatar_runtime.avatar import Avatar, Group
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import matrix_from_rotvec
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


HEAD = np.array([name != "root" for name in JOINTS], np.float32)[:, None]  # `neck` and its descendants


def of_head(avatar: Avatar) -> npt.NDArray[np.bool_]:
    """Gaussians that follow the joint of the head, by themselves or with their triangle."""
    if avatar.embedding is None or avatar.rig is None:
        return gather(avatar.skin, HEAD)[:, 0] > 0.5
    vertex = gather(avatar.rig.skin, HEAD)[:, 0][avatar.embedding.vertex_ids]
    return (avatar.embedding.barycentric * vertex).sum(axis=1) > 0.5


@pytest.mark.parametrize("make", [skinned, surface_avatar])
@pytest.mark.parametrize("part", ["whole", "head"])
def test_the_whole_avatar_and_its_head_lie_inside(make: Callable[[], Avatar], part: str) -> None:
    avatar = opaque(make())
    found = framing(avatar)
    rows = of_head(avatar) if part == "head" else slice(None)
    assert 16 < of_head(avatar).sum() < COUNT
    mean = Player(avatar, "reference").animate(Pose()).mean[rows]
    low, high = corners(found[part])
    assert part == "head" or ((mean > low).all() and (mean < high).all())
    np.testing.assert_allclose((low + high) / 2, (mean.min(axis=0) + mean.max(axis=0)) / 2, atol=4e-3)
    np.testing.assert_allclose(high - low, 1.08 * np.ptp(mean, axis=0), rtol=0.05)
    assert found["up"] == [0, 1, 0] and found["front"] == [0, 0, 1]
    json.dumps(found, allow_nan=False)


WHOLE = {"target": [0.1, 0.2, 0.3], "size": [0.3, 0.5, 0.4]}
FOV = math.radians(20)


@pytest.mark.parametrize("yaw", [0.0, 1.2, 3.0])
@pytest.mark.parametrize("scale", [1.0, 2.5])
def test_a_pinhole_gives_focal_length_times_size_by_depth(yaw: float, scale: float) -> None:
    placement = np.eye(4)
    placement[:3, :3] = scale * matrix_from_rotvec(np.array([0.3, yaw, -0.4]))
    placement[:3, 3] = [1.0, -2.0, 0.5]
    target = placement[:3, :3] @ WHOLE["target"] + placement[:3, 3]
    camera = Camera.orbit(target, 4.0, yaw, 0.3, FOV, 640, 480)
    expected = 480 / (2 * math.tan(FOV / 2)) * scale * 0.5 / 4.0
    assert height_px(WHOLE, camera.clip_from_world, placement, 480) == pytest.approx(expected, rel=1e-5)


def test_without_framing_and_behind_the_camera_it_is_infinite() -> None:
    camera = Camera.orbit(np.array(WHOLE["target"]), 4.0, 0.0, 0.0, FOV, 64, 64)
    behind = np.eye(4)
    behind[2, 3] = 8.0
    assert height_px(None, camera.clip_from_world, None, 64) == math.inf
    assert height_px(WHOLE, camera.clip_from_world, behind, 64) == math.inf
