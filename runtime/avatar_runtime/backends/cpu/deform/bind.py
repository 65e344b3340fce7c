"""Stage `bind` of a block of Gaussians that follow joints or groups."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.cpu.arrays import BLOCK, Blocks, Influences, Offsets, PosedArrays
from avatar_runtime.backends.cpu.deform.blend import offset_of
from avatar_runtime.backends.cpu.deform.planes import (
    LATE,
    MATRIX,
    MEAN,
    TURN,
    matrix_at,
    quat_at,
    set_quat,
    set_turn,
    turn_at,
)
from avatar_runtime.backends.cpu.jit import inlined
from avatar_runtime.backends.cpu.rotation import (
    matrix_multiply,
    newton_step,
    quat_from_matrix,
    quat_multiply,
)
from avatar_schema import constants

ZERO, ONE = np.float32(0), np.float32(1)
POLAR_STEPS = int(constants()["polar_steps"])


@inlined
def bind_block(
    block: int,
    blocks: Blocks,
    correctives: Offsets,
    late_morphs: Offsets,
    skin: Influences,
    posed: PosedArrays,
    planes: F32,
) -> None:
    """Binds one block. MEAN and QUAT hold its blended values, then the bound ones; TURN becomes the SH frame."""
    first, count, group = blocks.begin[block], blocks.size[block], blocks.group[block]
    for lane in range(count):
        x, y, z = offset_of(first + lane, correctives, posed.pose_feature)
        planes[MEAN + lane] += x
        planes[MEAN + BLOCK + lane] += y
        planes[MEAN + 2 * BLOCK + lane] += z
        x, y, z = offset_of(first + lane, late_morphs, posed.late_weights)
        planes[LATE + lane] = x
        planes[LATE + BLOCK + lane] = y
        planes[LATE + 2 * BLOCK + lane] = z
    if blocks.matrix_by_row[group]:
        for lane in range(count):
            skin_matrix_of(first + lane, lane, skin, posed.skin_matrix, planes)
    else:
        spread(posed.group_matrix[group], MATRIX, count, planes)
    if blocks.rotation_by_polar[group]:
        polar(count, planes)
    else:
        spread(posed.group_rotation[group], TURN, count, planes)
    move(count, planes)
    place(count, blocks.sh_world, posed.world, posed.world_quat, planes)


@inlined
def skin_matrix_of(i: int, lane: int, skin: Influences, skin_matrix: F32, planes: F32) -> None:
    """MATRIX of one lane: the sum of weight * joint matrix of Gaussian `i`."""
    for k in range(12):
        planes[MATRIX + k * BLOCK + lane] = ZERO
    for e in range(skin.row_ptr[i], skin.row_ptr[i + 1]):
        w, joint = skin.weight[e], skin.joint[e]
        for k in range(12):
            planes[MATRIX + k * BLOCK + lane] += skin_matrix[joint, k] * w


@inlined
def spread(values: F32, at: int, count: int, planes: F32) -> None:
    """The same values for every lane, in the planes from `at`."""
    for k in range(len(values)):
        value = values[k]
        for lane in range(count):
            planes[at + k * BLOCK + lane] = value


@inlined
def polar(count: int, planes: F32) -> None:
    """TURN is the polar factor of MATRIX, by the trainer's few Newton steps."""
    for lane in range(count):
        m = matrix_at(MATRIX + lane, 4 * BLOCK, planes)
        for _ in range(POLAR_STEPS):
            m = newton_step(m)
        set_turn(lane, m, planes)


@inlined
def move(count: int, planes: F32) -> None:
    """MEAN by MATRIX and then LATE, unrotated; QUAT by TURN."""
    for lane in range(count):
        x, y, z = planes[MEAN + lane], planes[MEAN + BLOCK + lane], planes[MEAN + 2 * BLOCK + lane]
        for row in range(3):
            at = MATRIX + 4 * BLOCK * row + lane
            moved = planes[at] * x + planes[at + BLOCK] * y + planes[at + 2 * BLOCK] * z
            moved += planes[at + 3 * BLOCK]
            planes[MEAN + BLOCK * row + lane] = moved + planes[LATE + BLOCK * row + lane]
        turn = quat_from_matrix(turn_at(lane, planes), ONE)
        set_quat(lane, quat_multiply(turn, quat_at(lane, planes)), planes)


@inlined
def place(count: int, sh_world: bool, world: F32, world_quat: F32, planes: F32) -> None:
    """All by world_from_avatar; TURN becomes the frame in which SH are seen, by rule sh_direction."""
    w00, w01, w02, w03 = world[0], world[1], world[2], world[3]
    w10, w11, w12, w13 = world[4], world[5], world[6], world[7]
    w20, w21, w22, w23 = world[8], world[9], world[10], world[11]
    turn = (w00, w01, w02, w10, w11, w12, w20, w21, w22)
    quat = (world_quat[0], world_quat[1], world_quat[2], world_quat[3])
    for lane in range(count):
        x, y, z = planes[MEAN + lane], planes[MEAN + BLOCK + lane], planes[MEAN + 2 * BLOCK + lane]
        planes[MEAN + lane] = w00 * x + w01 * y + w02 * z + w03
        planes[MEAN + BLOCK + lane] = w10 * x + w11 * y + w12 * z + w13
        planes[MEAN + 2 * BLOCK + lane] = w20 * x + w21 * y + w22 * z + w23
        set_quat(lane, quat_multiply(quat, quat_at(lane, planes)), planes)
    if sh_world:
        for lane in range(count):
            set_turn(lane, turn, planes)
    else:
        for lane in range(count):
            set_turn(lane, matrix_multiply(turn, turn_at(lane, planes)), planes)
