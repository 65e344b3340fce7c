"""Rotations of one Gaussian as plain numbers, in whichever precision they come; formulas of avatar_runtime.rotation.

`one` is 1 in that precision: a bare 1 would make every float32 sum a float64 one.
"""

from __future__ import annotations

import math

import numpy as np

from avatar_runtime.backends.cpu.jit import Scalar, inlined

Quat = tuple[Scalar, Scalar, Scalar, Scalar]
Matrix = tuple[Scalar, ...]  # 9, row-major

HALF = np.float32(0.5)


@inlined
def quat_multiply(a: Quat, b: Quat) -> Quat:
    """Hamilton product a b, wxyz."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


@inlined
def matrix_from_quat(q: Quat, one: Scalar) -> Matrix:
    """Rotation matrix of a unit quaternion."""
    w, x, y, z = q
    two = one + one
    return (
        one - two * (y * y + z * z),
        two * (x * y - w * z),
        two * (x * z + w * y),
        two * (x * y + w * z),
        one - two * (x * x + z * z),
        two * (y * z - w * x),
        two * (x * z - w * y),
        two * (y * z + w * x),
        one - two * (x * x + y * y),
    )


@inlined
def quat_from_matrix(m: Matrix, one: Scalar) -> Quat:
    """Unit quaternion of a rotation matrix; its largest component is positive, the first of equals."""
    m00, m01, m02, m10, m11, m12, m20, m21, m22 = m
    zero = one - one
    w = math.sqrt(max(one + m00 + m11 + m22, zero))
    x = math.sqrt(max(one + m00 - m11 - m22, zero))
    y = math.sqrt(max(one - m00 + m11 - m22, zero))
    z = math.sqrt(max(one - m00 - m11 + m22, zero))
    a, b, c = m21 - m12, m02 - m20, m10 - m01
    d, e, f = m10 + m01, m02 + m20, m21 + m12
    size, qw, qx, qy, qz = w, w * w, a, b, c
    if x > size:
        size, qw, qx, qy, qz = x, a, x * x, d, e
    if y > size:
        size, qw, qx, qy, qz = y, b, d, y * y, f
    if z > size:
        size, qw, qx, qy, qz = z, c, e, f, z * z
    twice = (one + one) * size
    return qw / twice, qx / twice, qy / twice, qz / twice


@inlined
def matrix_multiply(a: Matrix, b: Matrix) -> Matrix:
    """a b of 3x3 matrices."""
    a0, a1, a2, a3, a4, a5, a6, a7, a8 = a
    b0, b1, b2, b3, b4, b5, b6, b7, b8 = b
    return (
        a0 * b0 + a1 * b3 + a2 * b6,
        a0 * b1 + a1 * b4 + a2 * b7,
        a0 * b2 + a1 * b5 + a2 * b8,
        a3 * b0 + a4 * b3 + a5 * b6,
        a3 * b1 + a4 * b4 + a5 * b7,
        a3 * b2 + a4 * b5 + a5 * b8,
        a6 * b0 + a7 * b3 + a8 * b6,
        a6 * b1 + a7 * b4 + a8 * b7,
        a6 * b2 + a7 * b5 + a8 * b8,
    )


@inlined
def newton_step(m: Matrix) -> Matrix:
    """(M + M^-T) / 2: one step towards the polar factor."""
    a, b, c, d, e, f, g, h, k = m
    c0, c1, c2 = e * k - f * h, f * g - d * k, d * h - e * g
    c3, c4, c5 = h * c - k * b, k * a - g * c, g * b - h * a
    c6, c7, c8 = b * f - c * e, c * d - a * f, a * e - b * d
    det = a * c0 + b * c1 + c * c2
    return (
        (a + c0 / det) * HALF,
        (b + c1 / det) * HALF,
        (c + c2 / det) * HALF,
        (d + c3 / det) * HALF,
        (e + c4 / det) * HALF,
        (f + c5 / det) * HALF,
        (g + c6 / det) * HALF,
        (h + c7 / det) * HALF,
        (k + c8 / det) * HALF,
    )
