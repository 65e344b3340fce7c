"""Rotations as tensors, batched over leading axes: twins of `avatar_runtime.rotation`."""

from __future__ import annotations

import torch
from torch import Tensor

from avatar_schema import constants


def quat_multiply(a: Tensor, b: Tensor) -> Tensor:
    """Hamilton product a b, wxyz; [..., 4] each."""
    aw, ax, ay, az = a.unbind(-1)
    bw, bx, by, bz = b.unbind(-1)
    return torch.stack(
        [
            aw * bw - ax * bx - ay * by - az * bz,
            aw * bx + ax * bw + ay * bz - az * by,
            aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw,
        ],
        dim=-1,
    )


def matrix_from_quat(q: Tensor) -> Tensor:
    """Rotation matrices [..., 3, 3] of unit quaternions wxyz [..., 4]."""
    w, x, y, z = q.unbind(-1)
    entries = [
        *(1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        *(2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        *(2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    ]
    return torch.stack(entries, dim=-1).reshape(*q.shape[:-1], 3, 3)


def quat_from_matrix(m: Tensor) -> Tensor:
    """Unit quaternions wxyz [..., 4] of rotation matrices [..., 3, 3]; the largest component is positive.

    The choice of component has no gradient; the chosen formula has one.
    """
    m00, m01, m02, m10, m11, m12, m20, m21, m22 = m.flatten(-2).unbind(-1)
    w2, x2, y2, z2 = 1 + m00 + m11 + m22, 1 + m00 - m11 - m22, 1 - m00 + m11 - m22, 1 - m00 - m11 + m22
    squares = torch.stack([w2, x2, y2, z2], dim=-1).clamp_min(0)
    best = squares.detach().sqrt().argmax(-1, keepdim=True)  # the roots, whose ties are the runtime's
    a, b, c = m21 - m12, m02 - m20, m10 - m01
    d, e, f = m10 + m01, m02 + m20, m21 + m12
    candidates = torch.stack([w2, a, b, c, a, x2, d, e, b, d, y2, f, c, e, f, z2], dim=-1)
    row = 4 * best + torch.arange(4, device=m.device)
    return candidates.gather(-1, row) / (2 * squares.gather(-1, best).sqrt())


def inverse_transpose(m: Tensor) -> Tensor:
    """Inverse transpose of [..., 3, 3] by cross products of rows."""
    r0, r1, r2 = m.unbind(-2)
    cofactors = torch.stack([r1.cross(r2, dim=-1), r2.cross(r0, dim=-1), r0.cross(r1, dim=-1)], dim=-2)
    determinant = (r0 * cofactors[..., 0, :]).sum(-1)
    return cofactors / determinant[..., None, None]


def polar(m: Tensor) -> Tensor:
    """Rotation factor of [..., 3, 3] by the trainer's three Newton steps R <- (R + R^-T) / 2."""
    for _ in range(int(constants()["polar_steps"])):
        m = (m + inverse_transpose(m)) * 0.5
    return m
