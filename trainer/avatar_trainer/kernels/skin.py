"""Stages bind and activate of Gaussians that follow joints or groups: `stages.bind.bind_skin`, then `activate`."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F32
from avatar_runtime.backends.cpu import inlined, kernel, newton_step, quat_from_matrix, quat_multiply
from avatar_runtime.backends.cpu.deform import POLAR_STEPS
from avatar_trainer.kernels.activation import ONE, conjugate, divided, quat_at, sigmoid, store_quat, undivided
from avatar_trainer.kernels.arrays import plain
from avatar_trainer.stages.activate import SHORTEST
from avatar_trainer.tensors import Gaussians, Splats

LEAST = np.float32(SHORTEST)


class Motion(NamedTuple):
    """The transforms of N Gaussians."""

    matrix: F32  # [N, 12]
    rotation: F32  # [N, 9]
    quat_wxyz: F32  # [N, 4] of `rotation`
    corrective: F32  # [N, 3]
    late: F32  # [N, 3]


class Values(NamedTuple):
    """The values that the stages change, of N Gaussians before or of N splats after them."""

    mean: F32  # [N, 3]
    log_scale: F32  # [N, 3] or scale
    quat_wxyz: F32  # [N, 4]
    opacity_logit: F32  # [N] or opacity


def skinned_cpu(
    blended: Gaussians,
    matrix: Tensor,  # [N, 3, 4] of positions
    rotation: Tensor | None = None,  # [N, 3, 3] of quaternions; None: the polar factor of `matrix`
    corrective: Tensor | None = None,  # [N, 3] added before the matrix
    late: Tensor | None = None,  # [N, 3] added after it, unrotated
) -> Splats:
    """As `activate(*bind_skin(...))`, float32; differentiable only in `blended`.

    Matrices may be expanded from a single one. Raises ValueError if another input needs a gradient, and for another
    type or shape.
    """
    others = [given for given in (matrix, rotation, corrective, late) if given is not None]
    if any(given.requires_grad for given in others):
        raise ValueError(
            "skinned_cpu has gradients for the Gaussians alone; stages.bind.bind_skin has the others"
        )
    n = len(blended.mean)
    still = torch.zeros((), dtype=torch.float32).expand(n, 3)
    motion = Motion(
        plain(matrix, n, 12),
        np.empty((n, 9), np.float32) if rotation is None else plain(rotation, n, 9),
        np.empty((n, 4), np.float32),
        plain(still if corrective is None else corrective, n, 3),
        plain(still if late is None else late, n, 3),
    )
    _turn(rotation is None, motion)
    moved = blended.mean, blended.log_scale, blended.quat_wxyz, blended.opacity_logit
    mean, scale, quat, opacity = _Skin.apply(motion, *moved)  # type: ignore[no-untyped-call]
    frame = torch.from_numpy(motion.rotation).reshape(n, 3, 3)
    return Splats(mean, scale, quat, opacity, blended.sh, frame)


class _Skin(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, motion: Motion, *values: Tensor) -> tuple[Tensor, ...]:
        out = tuple(torch.empty(value.shape) for value in values)
        ctx.motion, ctx.out = motion, values_of(out)
        ctx.length = np.empty(len(values[0]), np.float32)
        _move(motion, values_of(values), ctx.out, ctx.length)
        return out

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        back = tuple(torch.empty(gradient.shape) for gradient in gradients)
        _move_backward(ctx.motion, ctx.out, ctx.length, values_of(gradients), values_of(back))
        return None, *back


def values_of(tensors: tuple[Tensor, ...]) -> Values:
    """Mean, scale, quaternion and opacity as arrays. Raises ValueError for another type or shape."""
    n = len(tensors[0])
    shapes = ((n, 3), (n, 3), (n, 4), (n,))
    return Values(*(plain(tensor, *shape) for tensor, shape in zip(tensors, shapes, strict=True)))


@kernel(parallel=True)
def _turn(by_polar: bool, motion: Motion) -> None:
    """The rotation's quaternion, and with `by_polar` the rotation itself."""
    for i in numba.prange(len(motion.matrix)):
        _turn_row(i, by_polar, motion)


@kernel(parallel=True)
def _move(motion: Motion, given: Values, out: Values, length: F32) -> None:
    """`out` activated; `length` of the quaternions before they were made unit."""
    for i in numba.prange(len(given.mean)):
        _move_row(i, motion, given, out, length)


@kernel(parallel=True)
def _move_backward(motion: Motion, out: Values, length: F32, gradient: Values, back: Values) -> None:
    for i in numba.prange(len(length)):
        _move_row_backward(i, motion, out, length, gradient, back)


@inlined
def _turn_row(i: int, by_polar: bool, motion: Motion) -> None:
    if by_polar:
        a = motion.matrix[i]
        m = (a[0], a[1], a[2], a[4], a[5], a[6], a[8], a[9], a[10])
        for _ in range(POLAR_STEPS):
            m = newton_step(m)
        to = motion.rotation[i]
        to[0], to[1], to[2], to[3], to[4], to[5], to[6], to[7], to[8] = m
    r = motion.rotation[i]
    quat = quat_from_matrix((r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8]), ONE)
    store_quat(quat, i, motion.quat_wxyz)


@inlined
def _move_row(i: int, motion: Motion, given: Values, out: Values, length: F32) -> None:
    x = given.mean[i, 0] + motion.corrective[i, 0]
    y = given.mean[i, 1] + motion.corrective[i, 1]
    z = given.mean[i, 2] + motion.corrective[i, 2]
    for k in range(3):
        a = motion.matrix[i, 4 * k : 4 * k + 4]
        out.mean[i, k] = (a[0] * x + a[1] * y + a[2] * z + a[3]) + motion.late[i, k]
        out.log_scale[i, k] = math.exp(given.log_scale[i, k])
    turned = quat_multiply(quat_at(i, motion.quat_wxyz), quat_at(i, given.quat_wxyz))
    unit, length[i] = divided(turned, LEAST)
    store_quat(unit, i, out.quat_wxyz)
    out.opacity_logit[i] = sigmoid(given.opacity_logit[i])


@inlined
def _move_row_backward(
    i: int, motion: Motion, out: Values, length: F32, gradient: Values, back: Values
) -> None:
    x, y, z = gradient.mean[i, 0], gradient.mean[i, 1], gradient.mean[i, 2]
    a = motion.matrix[i]
    for k in range(3):
        back.mean[i, k] = a[k] * x + a[4 + k] * y + a[8 + k] * z
        back.log_scale[i, k] = gradient.log_scale[i, k] * out.log_scale[i, k]
    turned = undivided(quat_at(i, gradient.quat_wxyz), quat_at(i, out.quat_wxyz), length[i], LEAST)
    store_quat(quat_multiply(conjugate(quat_at(i, motion.quat_wxyz)), turned), i, back.quat_wxyz)
    opacity = out.opacity_logit[i]
    back.opacity_logit[i] = gradient.opacity_logit[i] * opacity * (ONE - opacity)
