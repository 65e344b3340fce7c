"""The height of an avatar in an image: a pinhole's by hand, and what has none."""

from __future__ import annotations

import math

import numpy as np
import pytest

from avatar_export.measure.height_px import height_px
from avatar_runtime.camera import Camera
from avatar_runtime.rotation import matrix_from_rotvec

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


def test_an_orthographic_camera_knows_no_depth() -> None:
    clip = np.diag([2 / 3.0, 2 / 2.0, -0.1, 1.0])  # 2 metres from top to bottom
    assert height_px(WHOLE, clip, None, 1000) == pytest.approx(1000 * 0.5 / 2)


def test_without_framing_and_behind_the_camera_it_is_infinite() -> None:
    camera = Camera.orbit(np.array(WHOLE["target"]), 4.0, 0.0, 0.0, FOV, 64, 64)
    behind = np.eye(4)
    behind[2, 3] = 8.0
    assert height_px(None, camera.clip_from_world, None, 64) == math.inf
    assert height_px(WHOLE, camera.clip_from_world, behind, 64) == math.inf
