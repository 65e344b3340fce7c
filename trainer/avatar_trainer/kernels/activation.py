"""Formulas that kernels share: unit quaternions of a row, and their backward pass."""

from __future__ import annotations

import math

import numpy as np

from avatar_runtime import F32
from avatar_runtime.backends.cpu import Quat, Scalar, inlined

ONE = np.float32(1)


@inlined
def quat_at(i: int, quats: F32) -> Quat:
    """Row `i` of [N, 4]."""
    return quats[i, 0], quats[i, 1], quats[i, 2], quats[i, 3]


@inlined
def store_quat(q: Quat, i: int, quats: F32) -> None:
    """Row `i` of [N, 4] becomes `q`."""
    quats[i, 0], quats[i, 1], quats[i, 2], quats[i, 3] = q


@inlined
def divided(q: Quat, shortest: Scalar) -> tuple[Quat, Scalar]:
    """(q / length, length); the length is at least `shortest`."""
    w, x, y, z = q
    length = max(math.sqrt(w * w + x * x + y * y + z * z), shortest)
    return (w / length, x / length, y / length, z / length), length


@inlined
def undivided(gradient: Quat, unit: Quat, length: Scalar, shortest: Scalar) -> Quat:
    """The gradient of `divided`'s argument from that of its quotient `unit`."""
    w, x, y, z = gradient
    a, b, c, d = unit
    along = w * a + x * b + y * c + z * d if length > shortest else ONE - ONE
    return (
        (w - a * along) / length,
        (x - b * along) / length,
        (y - c * along) / length,
        (z - d * along) / length,
    )


@inlined
def conjugate(q: Quat) -> Quat:
    """What a factor is multiplied by on the way back of a product."""
    w, x, y, z = q
    return w, -x, -y, -z


@inlined
def sigmoid(x: Scalar) -> Scalar:
    """1 / (1 + e^-x), without overflow."""
    e = math.exp(-abs(x))
    above = ONE if x >= 0 else e
    return above / (ONE + e)
