"""Gradients of one splat's centre and conic with respect to its mean, scale and quaternion."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from avatar_runtime import F32
from avatar_runtime.backends.cpu import Quat, inlined, matrix_from_quat
from avatar_runtime.backends.cpu.draw import FRUSTUM_CLAMP, HOMOGENEOUS_EPSILON

f32 = np.float32
HALF, ONE, TWO, FOUR = f32(0.5), f32(1), f32(2), f32(4)
Pair = tuple[np.float32, np.float32]
Vector = tuple[np.float32, np.float32, np.float32]
Symmetric = tuple[np.float32, np.float32, np.float32, np.float32, np.float32, np.float32]  # xx xy xz yy yz zz


class Jacobian(NamedTuple):
    """J W of one splat: pixels by world space."""

    x: Vector  # the row of the image's x: j00 W0 + j02 W2
    y: Vector  # of its y: j11 W1 + j12 W2
    j00: np.float32
    j11: np.float32
    ratio_x: np.float32  # x / z in camera space, clamped: j02 = -j00 ratio_x
    ratio_y: np.float32
    free_x: bool  # whether the clamp did not change it
    free_y: bool
    inverse_z: np.float32


@inlined
def row(matrix: F32, k: int) -> Vector:
    """The first three entries of row k."""
    return matrix[k, 0], matrix[k, 1], matrix[k, 2]


@inlined
def dot(a: Vector, b: Vector) -> np.float32:
    """a . b"""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def combined(a: np.float32, x: Vector, b: np.float32, y: Vector) -> Vector:
    """a x + b y"""
    return a * x[0] + b * y[0], a * x[1] + b * y[1], a * x[2] + b * y[2]


@inlined
def times(m: Symmetric, v: Vector) -> Vector:
    """M v"""
    return dot((m[0], m[1], m[2]), v), dot((m[1], m[3], m[4]), v), dot((m[2], m[4], m[5]), v)


@inlined
def add_to(values: F32, i: int, v: Vector) -> None:
    """values[i] += v"""
    values[i, 0] += v[0]
    values[i, 1] += v[1]
    values[i, 2] += v[2]


@inlined
def centre_backward(grad_centre: Pair, mean: Vector, clip: F32, width: int, height: int) -> Vector:
    """Gradient of the mean from that of the centre in pixels."""
    inverse = ONE / (dot(row(clip, 3), mean) + clip[3, 3] + HOMOGENEOUS_EPSILON)
    ndc_x = (dot(row(clip, 0), mean) + clip[0, 3]) * inverse
    ndc_y = (dot(row(clip, 1), mean) + clip[1, 3]) * inverse
    grad_x, grad_y = (
        grad_centre[0] * HALF * f32(width) * inverse,
        grad_centre[1] * HALF * f32(height) * inverse,
    )
    grad_w = -(grad_x * ndc_x + grad_y * ndc_y)
    a, b, c = row(clip, 0), row(clip, 1), row(clip, 3)
    return (
        grad_x * a[0] + grad_y * b[0] + grad_w * c[0],
        grad_x * a[1] + grad_y * b[1] + grad_w * c[1],
        grad_x * a[2] + grad_y * b[2] + grad_w * c[2],
    )


@inlined
def conic_backward(grad_conic: Vector, a: np.float32, b: np.float32, c: np.float32) -> Vector:
    """Gradient of the 2D covariance xx, xy, yy from that of its inverse N = (a, b, c): dN = -N dC N."""
    grad_a, grad_b, grad_c = grad_conic
    return (
        -(a * a * grad_a + a * b * grad_b + b * b * grad_c),
        -(TWO * a * b * grad_a + (a * c + b * b) * grad_b + TWO * b * c * grad_c),
        -(b * b * grad_a + b * c * grad_b + c * c * grad_c),
    )


@inlined
def jacobian(mean: Vector, view: F32, lens: F32, width: int, height: int) -> Jacobian:
    """J W at `mean`; lens: tan_half_fov_x, tan_half_fov_y."""
    inverse_z = ONE / (dot(row(view, 2), mean) + view[2, 3])
    x = (dot(row(view, 0), mean) + view[0, 3]) * inverse_z
    y = (dot(row(view, 1), mean) + view[1, 3]) * inverse_z
    limit_x, limit_y = FRUSTUM_CLAMP * lens[0], FRUSTUM_CLAMP * lens[1]
    ratio_x, ratio_y = min(max(x, -limit_x), limit_x), min(max(y, -limit_y), limit_y)
    j00, j11 = f32(width) / (TWO * lens[0]) * inverse_z, f32(height) / (TWO * lens[1]) * inverse_z
    return Jacobian(
        combined(j00, row(view, 0), -j00 * ratio_x, row(view, 2)),
        combined(j11, row(view, 1), -j11 * ratio_y, row(view, 2)),
        j00,
        j11,
        ratio_x,
        ratio_y,
        ratio_x == x,
        ratio_y == y,
        inverse_z,
    )


@inlined
def jacobian_backward(j: Jacobian, view: F32, grad_x: Vector, grad_y: Vector) -> Vector:
    """Gradient of the mean from that of the rows of J W.

    j00 = f / z and j02 = -f r / z, where r = x / z unless it is clamped.
    """
    grad_j00, grad_j02 = dot(row(view, 0), grad_x), dot(row(view, 2), grad_x)
    grad_j11, grad_j12 = dot(row(view, 1), grad_y), dot(row(view, 2), grad_y)
    grad_view_x = -j.j00 * j.inverse_z * grad_j02 if j.free_x else f32(0)
    grad_view_y = -j.j11 * j.inverse_z * grad_j12 if j.free_y else f32(0)
    grad_view_z = -j.inverse_z * (
        j.j00 * (grad_j00 - j.ratio_x * grad_j02) + j.j11 * (grad_j11 - j.ratio_y * grad_j12)
    ) - (grad_view_x * j.ratio_x + grad_view_y * j.ratio_y)
    a, b = combined(grad_view_x, row(view, 0), grad_view_y, row(view, 1)), row(view, 2)
    return a[0] + grad_view_z * b[0], a[1] + grad_view_z * b[1], a[2] + grad_view_z * b[2]


@inlined
def covariance(scale: Vector, quat_wxyz: Quat) -> Symmetric:
    """R S S R^T."""
    r = matrix_from_quat(quat_wxyz, ONE)
    a = r[0] * scale[0], r[1] * scale[1], r[2] * scale[2]
    b = r[3] * scale[0], r[4] * scale[1], r[5] * scale[2]
    c = r[6] * scale[0], r[7] * scale[1], r[8] * scale[2]
    return dot(a, a), dot(a, b), dot(a, c), dot(b, b), dot(b, c), dot(c, c)


@inlined
def covariance_backward(grad_cov: Vector, x: Vector, y: Vector) -> Symmetric:
    """Gradient of V, a symmetric matrix, from that of x V x, y V x, y V y."""
    xx, half, yy = grad_cov[0], HALF * grad_cov[1], grad_cov[2]
    p, q = combined(xx, x, half, y), combined(half, x, yy, y)
    return (
        p[0] * x[0] + q[0] * y[0],
        p[0] * x[1] + q[0] * y[1],
        p[0] * x[2] + q[0] * y[2],
        p[1] * x[1] + q[1] * y[1],
        p[1] * x[2] + q[1] * y[2],
        p[2] * x[2] + q[2] * y[2],
    )


@inlined
def factors_backward(
    i: int, g: Symmetric, scale: Vector, quat_wxyz: Quat, grad_scale: F32, grad_quat: F32
) -> None:
    """Gradients of scale and quaternion i from that, G, of V = R S S R^T: of R it is 2 G R S S."""
    w, x, y, z = quat_wxyz
    r = matrix_from_quat(quat_wxyz, ONE)
    a, b, c = (r[0], r[3], r[6]), (r[1], r[4], r[7]), (r[2], r[5], r[8])
    h0, h1, h2 = times(g, a), times(g, b), times(g, c)  # columns of G R
    grad_scale[i, 0] = TWO * scale[0] * dot(h0, a)
    grad_scale[i, 1] = TWO * scale[1] * dot(h1, b)
    grad_scale[i, 2] = TWO * scale[2] * dot(h2, c)
    f0, f1, f2 = FOUR * scale[0] * scale[0], FOUR * scale[1] * scale[1], FOUR * scale[2] * scale[2]
    d00, d10, d20 = f0 * h0[0], f0 * h0[1], f0 * h0[2]  # twice the gradient of R, by columns
    d01, d11, d21 = f1 * h1[0], f1 * h1[1], f1 * h1[2]
    d02, d12, d22 = f2 * h2[0], f2 * h2[1], f2 * h2[2]
    grad_quat[i, 0] = z * (d10 - d01) + y * (d02 - d20) + x * (d21 - d12)
    grad_quat[i, 1] = y * (d01 + d10) + z * (d02 + d20) + w * (d21 - d12) - TWO * x * (d11 + d22)
    grad_quat[i, 2] = x * (d01 + d10) + z * (d12 + d21) + w * (d02 - d20) - TWO * y * (d00 + d22)
    grad_quat[i, 3] = x * (d02 + d20) + y * (d12 + d21) + w * (d10 - d01) - TWO * z * (d00 + d11)
