"""Gradients of one splat's colour with respect to its SH and its mean."""

from __future__ import annotations

import numpy as np

from avatar_runtime import F32
from avatar_runtime.backends.cpu import fma, inlined
from avatar_runtime.backends.cpu.draw import C0, C1, C2, C3
from avatar_trainer.raster.geometry_backward import FOUR, HALF, TWO, Vector, add_to, dot

f32 = np.float32
THREE, SIX, EIGHT = f32(3), f32(6), f32(8)
VALUE, BY_X, BY_Y, BY_Z = range(4)  # columns of a basis


@inlined
def colour_backward(
    i: int,
    grad_rgb: Vector,
    mean: F32,
    sh: F32,
    sh_rotation: F32,  # [N, 3, 3], or [0, 3, 3]
    eye: F32,
    coefficients: int,
    basis: F32,  # [16, 4] scratch
    grad_sh: F32,
    grad_mean: F32,
) -> None:
    """Write the gradient of the SH of splat i, and add that of its mean. A colour clamped at 0 has none."""
    x, y, z = mean[i, 0] - eye[0], mean[i, 1] - eye[1], mean[i, 2] - eye[2]
    distance = np.sqrt(x * x + y * y + z * z)
    unit = x / distance, y / distance, z / distance
    set_basis(basis, turned_back(unit, sh_rotation, i), coefficients)
    red, green, blue = f32(0), f32(0), f32(0)
    for k in range(coefficients):
        value = basis[k, VALUE]
        red, green, blue = (
            fma(value, sh[i, k, 0], red),
            fma(value, sh[i, k, 1], green),
            fma(value, sh[i, k, 2], blue),
        )
    grad_red = grad_rgb[0] if red + HALF >= f32(0) else f32(0)
    grad_green = grad_rgb[1] if green + HALF >= f32(0) else f32(0)
    grad_blue = grad_rgb[2] if blue + HALF >= f32(0) else f32(0)
    grad_x, grad_y, grad_z = f32(0), f32(0), f32(0)
    for k in range(coefficients):
        value = basis[k, VALUE]
        grad_sh[i, k, 0], grad_sh[i, k, 1], grad_sh[i, k, 2] = (
            value * grad_red,
            value * grad_green,
            value * grad_blue,
        )
        slope = sh[i, k, 0] * grad_red + sh[i, k, 1] * grad_green + sh[i, k, 2] * grad_blue
        grad_x, grad_y, grad_z = (
            fma(slope, basis[k, BY_X], grad_x),
            fma(slope, basis[k, BY_Y], grad_y),
            fma(slope, basis[k, BY_Z], grad_z),
        )
    grad_unit = turned((grad_x, grad_y, grad_z), sh_rotation, i)
    along = dot(unit, grad_unit)
    add_to(
        grad_mean,
        i,
        (
            (grad_unit[0] - along * unit[0]) / distance,
            (grad_unit[1] - along * unit[1]) / distance,
            (grad_unit[2] - along * unit[2]) / distance,
        ),
    )


@inlined
def turned_back(v: Vector, rotation: F32, i: int) -> Vector:
    """R^T v; v itself where there are no rotations."""
    if len(rotation) == 0:
        return v
    return (
        rotation[i, 0, 0] * v[0] + rotation[i, 1, 0] * v[1] + rotation[i, 2, 0] * v[2],
        rotation[i, 0, 1] * v[0] + rotation[i, 1, 1] * v[1] + rotation[i, 2, 1] * v[2],
        rotation[i, 0, 2] * v[0] + rotation[i, 1, 2] * v[1] + rotation[i, 2, 2] * v[2],
    )


@inlined
def turned(v: Vector, rotation: F32, i: int) -> Vector:
    """R v; v itself where there are no rotations."""
    if len(rotation) == 0:
        return v
    return (
        rotation[i, 0, 0] * v[0] + rotation[i, 0, 1] * v[1] + rotation[i, 0, 2] * v[2],
        rotation[i, 1, 0] * v[0] + rotation[i, 1, 1] * v[1] + rotation[i, 1, 2] * v[2],
        rotation[i, 2, 0] * v[0] + rotation[i, 2, 1] * v[1] + rotation[i, 2, 2] * v[2],
    )


@inlined
def put(basis: F32, k: int, value: np.float32, x: np.float32, y: np.float32, z: np.float32) -> None:
    """Row k of `basis`."""
    basis[k, VALUE], basis[k, BY_X], basis[k, BY_Y], basis[k, BY_Z] = value, x, y, z


@inlined
def set_basis(basis: F32, direction: Vector, coefficients: int) -> None:
    """SH basis functions as polynomials, in the runtime's order of operations, and their derivatives."""
    x, y, z = direction
    xx, yy, zz = x * x, y * y, z * z
    zero = f32(0)
    put(basis, 0, C0, zero, zero, zero)
    if coefficients > 1:
        put(basis, 1, C1[0] * y, zero, C1[0], zero)
        put(basis, 2, C1[1] * z, zero, zero, C1[1])
        put(basis, 3, C1[2] * x, C1[2], zero, zero)
    if coefficients > 4:
        a, b, c, d, e = C2[0], C2[1], C2[2], C2[3], C2[4]
        put(basis, 4, a * (x * y), a * y, a * x, zero)
        put(basis, 5, b * (y * z), zero, b * z, b * y)
        put(basis, 6, c * (TWO * zz - xx - yy), c * -TWO * x, c * -TWO * y, c * FOUR * z)
        put(basis, 7, d * (x * z), d * z, zero, d * x)
        put(basis, 8, e * (xx - yy), e * TWO * x, e * -TWO * y, zero)
    if coefficients > 9:
        set_cubic(basis, x, y, z)


@inlined
def set_cubic(basis: F32, x: np.float32, y: np.float32, z: np.float32) -> None:
    """The seven of degree 3."""
    xx, yy, zz, xy, xz, yz = x * x, y * y, z * z, x * y, x * z, y * z
    a, b, c, d, e, f, g = C3[0], C3[1], C3[2], C3[3], C3[4], C3[5], C3[6]
    four, zonal = FOUR * zz - xx - yy, TWO * zz - THREE * xx - THREE * yy
    put(basis, 9, a * y * (THREE * xx - yy), a * SIX * xy, a * THREE * (xx - yy), f32(0))
    put(basis, 10, b * xy * z, b * yz, b * xz, b * xy)
    put(basis, 11, c * y * four, c * -TWO * xy, c * (four - TWO * yy), c * EIGHT * yz)
    put(basis, 12, d * z * zonal, d * -SIX * xz, d * -SIX * yz, d * (zonal + FOUR * zz))
    put(basis, 13, e * x * four, e * (four - TWO * xx), e * -TWO * xy, e * EIGHT * xz)
    put(basis, 14, f * z * (xx - yy), f * TWO * xz, f * -TWO * yz, f * (xx - yy))
    put(basis, 15, g * x * (xx - THREE * yy), g * THREE * (xx - yy), g * -SIX * xy, f32(0))
