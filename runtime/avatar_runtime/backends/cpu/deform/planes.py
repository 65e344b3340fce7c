"""The values of a block of Gaussians between the stages, in one small array.

Value p of the Gaussian in lane l stands at planes[p * BLOCK + l]. With such constant distances LLVM vectorises
a loop over lanes; it does not vectorise a loop over rows of several arrays.
"""

from __future__ import annotations

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.arrays import BLOCK
from avatar_runtime.backends.cpu.jit import inlined
from avatar_runtime.backends.cpu.rotation import Matrix, Quat

# Where the values begin.
MATRIX = 0  # 12, row-major 3x4 of positions
TURN = 12 * BLOCK  # 9, row-major rotation
MEAN = 21 * BLOCK  # 3
QUAT = 24 * BLOCK  # 4
LATE = 28 * BLOCK  # 3
SHAPE = 0  # 4, in place of MATRIX once that is no longer needed: log scale or scale, opacity logit or opacity
PLANES = 31 * BLOCK


@inlined
def matrix_at(at: int, row: int, planes: F32) -> Matrix:
    """The 3x3 matrix whose rows begin at `at` and lie `row` apart."""
    second, third = at + row, at + 2 * row
    return (
        planes[at],
        planes[at + BLOCK],
        planes[at + 2 * BLOCK],
        planes[second],
        planes[second + BLOCK],
        planes[second + 2 * BLOCK],
        planes[third],
        planes[third + BLOCK],
        planes[third + 2 * BLOCK],
    )


@inlined
def turn_at(lane: int, planes: F32) -> Matrix:
    """TURN of one lane."""
    return matrix_at(TURN + lane, 3 * BLOCK, planes)


@inlined
def set_turn(lane: int, turn: Matrix, planes: F32) -> None:
    """TURN of one lane becomes `turn`."""
    for k in range(9):
        planes[TURN + k * BLOCK + lane] = turn[k]


@inlined
def quat_at(lane: int, planes: F32) -> Quat:
    """QUAT of one lane."""
    at = QUAT + lane
    return planes[at], planes[at + BLOCK], planes[at + 2 * BLOCK], planes[at + 3 * BLOCK]


@inlined
def set_quat(lane: int, quat: Quat, planes: F32) -> None:
    """QUAT of one lane becomes `quat`."""
    for k in range(4):
        planes[QUAT + k * BLOCK + lane] = quat[k]


@inlined
def load(first: int, count: int, rows: F32, at: int, planes: F32) -> None:
    """Rows first .. first + count of `rows` into the planes from `at`."""
    for lane in range(count):
        for k in range(rows.shape[1]):
            planes[at + k * BLOCK + lane] = rows[first + lane, k]


@inlined
def store(first: int, count: int, planes: F32, at: int, rows: F32) -> None:
    """The planes from `at` into rows first .. first + count of `rows`."""
    for lane in range(count):
        for k in range(rows.shape[1]):
            rows[first + lane, k] = planes[at + k * BLOCK + lane]
