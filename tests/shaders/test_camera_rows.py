"""The README's way from an engine's view and projection matrices to the rows that `project` takes."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_runtime.camera import CLIP_FAR, CLIP_NEAR, Camera

TURN = np.diag([1.0, -1.0, -1.0, 1.0])
EYE, FOV_Y, WIDTH, HEIGHT = np.array([0.4, 0.3, 0.9]), 0.5, 640, 360


def look_at(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """gluLookAt by its manual page: the camera looks along -z, +y up."""
    f = (target - eye) / np.linalg.norm(target - eye)
    s = np.cross(f, [0.0, 1.0, 0.0])
    s /= np.linalg.norm(s)
    view = np.eye(4)
    view[:3, :3] = [s, np.cross(s, f), -f]
    view[:3, 3] = -view[:3, :3] @ eye
    return view


def perspective() -> np.ndarray:
    """gluPerspective by its manual page: depth -1..1."""
    cot, n, f = 1 / np.tan(FOV_Y / 2), CLIP_NEAR, CLIP_FAR
    g = np.zeros((4, 4))
    g[0, 0], g[1, 1] = cot * HEIGHT / WIDTH, cot
    g[2, 2], g[2, 3], g[3, 2] = (f + n) / (n - f), 2 * f * n / (n - f), -1
    return g


@pytest.mark.parametrize("mirrored", [False, True])
def test_rows_from_an_engines_matrices(mirrored: bool) -> None:
    """In a left-handed world (x negated) the view matrix has the other determinant; nothing else changes."""
    mirror = np.diag([-1.0, 1, 1, 1]) if mirrored else np.eye(4)
    view = look_at(EYE, np.zeros(3)) @ mirror
    g = perspective()
    g[2] = (g[2] + g[3]) / 2
    p = g @ TURN
    p[1] = -p[1]
    away = np.linalg.norm(EYE)
    yaw, pitch = np.arctan2(EYE[0], EYE[2]), np.arcsin(EYE[1] / away)
    want = Camera.orbit(np.zeros(3), away, yaw, pitch, FOV_Y, WIDTH, HEIGHT)
    want = want.mirrored() if mirrored else want
    np.testing.assert_allclose(TURN @ view, want.camera_from_world, atol=1e-6)
    np.testing.assert_allclose(p @ TURN @ view, want.clip_from_world, atol=2e-6)
    np.testing.assert_allclose((mirror[:3, :3] @ EYE), want.centre, atol=1e-6)
