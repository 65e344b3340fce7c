"""Stage `activate`: out of training space."""

from __future__ import annotations

import math

import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.bind import SHORTEST, quat_at, set_quat
from avatar_runtime.backends.cpu.jit import inlined

ZERO, ONE = np.float32(0), np.float32(1)


@inlined
def unit_quats(count: int, planes: F32) -> None:
    """QUAT of every lane made unit."""
    for lane in range(count):
        w, x, y, z = quat_at(lane, planes)
        length = math.sqrt(w * w + x * x + y * y + z * z)
        if length < SHORTEST:
            length = SHORTEST
        set_quat(lane, (w / length, x / length, y / length, z / length), planes)


@inlined
def sigmoid(x: float) -> float:
    """1 / (1 + e^-x) in float32, without overflow."""
    e = math.exp(-abs(x))
    return (ONE if x >= ZERO else e) / (ONE + e)
