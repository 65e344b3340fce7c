"""Stage `activate`: out of training space."""

from __future__ import annotations

import math

import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.arrays import BLOCK
from avatar_runtime.backends.cpu.deform.planes import SHAPE, quat_at, set_quat
from avatar_runtime.backends.cpu.jit import Scalar, inlined
from avatar_runtime.backends.cpu.lanes import exponential_of_any

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
def activate_planes(planes: F32) -> None:
    """SHAPE of all lanes: exp of the log scale, sigmoid of the logit."""
    for at in range(SHAPE, SHAPE + 3 * BLOCK):
        planes[at] = exponential_of_any(planes[at])
    for at in range(SHAPE + 3 * BLOCK, SHAPE + 4 * BLOCK):
        planes[at] = sigmoid(planes[at])


@inlined
def sigmoid(x: Scalar) -> Scalar:
    """1 / (1 + e^-x), without overflow."""
    e = exponential_of_any(-abs(x))
    return (ONE if x >= ZERO else e) / (ONE + e)


@inlined
def activate_scale(i: int, x: Scalar, y: Scalar, z: Scalar, scale: F32) -> None:
    """exp of the log scale, into row `i` of `scale` [N, 3]."""
    scale[i, 0] = exponential_of_any(x)
    scale[i, 1] = exponential_of_any(y)
    scale[i, 2] = exponential_of_any(z)


@inlined
def activate_opacity(i: int, logit: Scalar, opacity: F32) -> None:
    """Sigmoid of the logit, into `opacity` [N]."""
    opacity[i] = sigmoid(logit)
