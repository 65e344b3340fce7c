"""Stage `activate`: out of training space."""

from __future__ import annotations

import math

import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.jit import Scalar, inlined
from avatar_runtime.backends.cpu.planes import quat_at, set_quat

ZERO, ONE = np.float32(0), np.float32(1)
SHORTEST = np.float32(1e-12)  # a quaternion is divided by no less


@inlined
def unit_quats(count: int, planes: F32) -> None:
    """QUAT of `count` lanes made unit."""
    for lane in range(count):
        w, x, y, z = quat_at(lane, planes)
        length: Scalar = math.sqrt(w * w + x * x + y * y + z * z)
        if length < SHORTEST:
            length = SHORTEST
        set_quat(lane, (w / length, x / length, y / length, z / length), planes)


@inlined
def activate_scale(i: int, x: Scalar, y: Scalar, z: Scalar, scale: F32) -> None:
    """exp of the log scale, into row `i` of `scale` [N, 3]."""
    scale[i, 0] = math.exp(x)
    scale[i, 1] = math.exp(y)
    scale[i, 2] = math.exp(z)


@inlined
def activate_opacity(i: int, logit: Scalar, opacity: F32) -> None:
    """Sigmoid of the logit, without overflow, into `opacity` [N]."""
    e = math.exp(-abs(logit))
    opacity[i] = (ONE if logit >= ZERO else e) / (ONE + e)
