"""A small reference that tests modify."""

from __future__ import annotations

from functools import cache

import numpy as np

from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.conformance import Case, Reference, encode, make_reference
from avatar_runtime.pose import clip_pose
from tests.avatars import full_avatar

CAMERA = Camera.orbit(np.zeros(3), 0.4, 0.3, 0.1, 0.6, 40, 24)


@cache
def avatar() -> Avatar:
    return full_avatar(2)


@cache
def reference() -> Reference:
    """One posed case of 16 Gaussians, 8 vertices and 64 pixels."""
    case = Case("nod", "für alle", clip_pose(avatar(), avatar().clips[0], 3), CAMERA, (0.5, 0.25, 1.0))
    return make_reference(avatar(), [case], rows=16, pixels=64, generator="made for tests")


def encoded() -> dict[str, bytes]:
    """The files of `reference()`."""
    return dict(encode(reference()))
