"""Properties of rotations; the oracles are series, SVD and products, not the formulas of rotation.py."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from avatar_runtime.rotation import (
    matrix_from_quat,
    matrix_from_rotvec,
    polar,
    quat_from_matrix,
    quat_multiply,
)
from tests.golden import Array

CLOSE = 1e-9
rotvecs = arrays(np.float64, 3, elements=st.floats(-6, 6))


def exponential(rotvec: Array) -> Array:
    """The matrix exponential of the cross-product matrix, by its series."""
    x, y, z = rotvec
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    term, total = np.eye(3), np.eye(3)
    for n in range(1, 80):
        term = term @ cross / n
        total = total + term
    return total


@st.composite
def unit_quats(draw: st.DrawFn) -> Array:
    q = draw(arrays(np.float64, 4, elements=st.floats(-1, 1)))
    length = np.linalg.norm(q)
    assume(length > 0.1)
    return q / length


@given(rotvecs)
def test_rotation_vector_is_the_matrix_exponential(rotvec: Array) -> None:
    np.testing.assert_allclose(matrix_from_rotvec(rotvec), exponential(rotvec), atol=CLOSE)


def test_directions_by_hand() -> None:
    """A quarter turn about +X takes +Y to +Z; about +Y, +Z to +X; about +Z, +X to +Y."""
    x, y, z = np.eye(3)
    for axis, start, end in ((x, y, z), (y, z, x), (z, x, y)):
        np.testing.assert_allclose(matrix_from_rotvec(axis * math.pi / 2) @ start, end, atol=CLOSE)


@given(unit_quats(), arrays(np.float64, 3, elements=st.floats(-5, 5)))
def test_quaternion_matrix_turns_as_q_v_q_conjugate(q: Array, v: Array) -> None:
    conjugate = q * [1, -1, -1, -1]
    turned = quat_multiply(quat_multiply(q, np.array([0.0, *v])), conjugate)
    np.testing.assert_allclose(turned, [0, *(matrix_from_quat(q) @ v)], atol=1e-8)


@given(unit_quats(), unit_quats())
def test_product_of_quaternions_is_product_of_matrices(a: Array, b: Array) -> None:
    want = matrix_from_quat(a) @ matrix_from_quat(b)
    np.testing.assert_allclose(matrix_from_quat(quat_multiply(a, b)), want, atol=CLOSE)


@given(unit_quats())
def test_matrix_and_back_keeps_the_rotation_with_the_largest_component_positive(q: Array) -> None:
    got = quat_from_matrix(matrix_from_quat(q))
    assert got.max() >= np.abs(got).max() - CLOSE  # ties by a rounding may fall either way
    np.testing.assert_allclose(got, q if q @ got > 0 else -q, atol=1e-7)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_half_turns_have_a_zero_real_part(axis: int) -> None:
    """If the trace is -1, the real part is 0."""
    diagonal = -np.ones(3)
    diagonal[axis] = 1
    np.testing.assert_array_equal(quat_from_matrix(np.diag(diagonal)), np.eye(4)[1 + axis])


@given(rotvecs, rotvecs, arrays(np.float64, 3, elements=st.floats(0.8, 1.25)))
def test_polar_is_the_nearest_rotation(turn: Array, axes: Array, stretch: Array) -> None:
    """Three Newton steps take singular values of 0.8 to 1.25 to within 1e-7 of 1."""
    basis = exponential(axes)
    m = exponential(turn) @ (basis * stretch) @ basis.T
    u, _, vt = np.linalg.svd(m)
    np.testing.assert_allclose(polar(m), u @ vt, atol=2e-7)


def test_polar_takes_three_steps() -> None:
    """s <- (s + 1/s) / 2 from 3 gives 5/3, 17/15, 257/255: the trainer stops there."""
    np.testing.assert_allclose(polar(np.diag([3.0, 3.0, 3.0])), np.diag([257 / 255] * 3), atol=1e-12)
