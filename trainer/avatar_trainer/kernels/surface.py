"""Gaussians embedded in a mesh: `stages.surface.pose_mesh` without gradients, and `embed` followed by `activate`."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numba
import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F32, I64, Rules
from avatar_runtime import rules as runtime_rules
from avatar_runtime.backends.cpu import (
    Quat,
    Scalar,
    inlined,
    kernel,
    matrix_from_quat,
    newton_step,
    quat_from_matrix,
    quat_multiply,
)
from avatar_runtime.backends.cpu.deform import fresh_posed_mesh
from avatar_runtime.backends.cpu.deform import surface as runtime
from avatar_schema import constants
from avatar_trainer.kernels.activation import ONE, conjugate, divided, quat_at, sigmoid, store_quat, undivided
from avatar_trainer.kernels.arrays import plain
from avatar_trainer.kernels.mesh import KernelMesh
from avatar_trainer.stages.activate import SHORTEST
from avatar_trainer.stages.surface import TINY, PosedMesh, SurfaceMesh, check_rules, linear_rows, scale_change
from avatar_trainer.tensors import Splats

POLAR_STEPS = int(constants()["polar_steps"])
LEAST, NONE = np.float32(SHORTEST), np.float32(TINY)
Vector = tuple[Scalar, Scalar, Scalar]


class OnMesh(NamedTuple):
    """The embedding of N Gaussians, and the mesh's effect on their scales."""

    vertices: I64  # [N, 3]
    table: F32  # [V, 10] position, normal, quaternion; by joints [V, 15] position, normal, linear skin matrix
    factor: F32  # [N] of the log scale
    shift: F32  # [N] added to it


class Values(NamedTuple):
    """The trained values of N Gaussians."""

    barycentric: F32  # [N, 3]
    displacement: F32  # [N]
    local_quat_wxyz: F32  # [N, 4]
    log_scale: F32  # [N, 3]
    opacity_logit: F32  # [N]


class Out(NamedTuple):
    """Splats without their colour."""

    mean: F32  # [N, 3]
    scale: F32  # [N, 3]
    quat_wxyz: F32  # [N, 4]
    opacity: F32  # [N]


def pose_mesh_cpu(
    vertices: Tensor, mesh: KernelMesh, rules: Rules, vertex_matrix: Tensor | None = None
) -> PosedMesh:
    """As `stages.surface.pose_mesh`, without gradients, by the runtime's kernels; `vertices` [V, 3] float32.

    Raises ValueError as it does, and if `vertices` need a gradient.
    """
    check_rules(rules)
    if vertices.requires_grad:
        raise ValueError("pose_mesh_cpu has no gradients; stages.surface.pose_mesh has")
    definition = mesh.definition
    posed = fresh_posed_mesh(mesh.arrays)
    rotation, sign = (
        runtime_rules.code("rotation", rules.rotation),
        runtime_rules.code("quaternion_sign", rules.quaternion_sign),
    )
    runtime.triangle_turns(plain(vertices, definition.vertices, 3), mesh.arrays, rotation, sign, posed)
    unit_area = definition.training_per_bundle**2
    runtime.vertex_sums(
        mesh.arrays,
        float(constants()["normal_floor"]) / unit_area,
        float(constants()["quaternion_floor"]) / unit_area,
        rotation,
        posed,
    )
    at_vertices = torch.from_numpy(posed.vertex.astype(np.float32))
    linear = linear_rows(vertex_matrix, definition, rules)
    turn = at_vertices[:, 3:] if linear is None else linear.float()
    return PosedMesh(vertices, at_vertices[:, :3], turn, torch.from_numpy(posed.size))


def embedded_cpu(
    posed: PosedMesh,
    mesh: SurfaceMesh,
    triangle: Tensor,  # [N] int64
    barycentric: Tensor,  # [N, 3]
    displacement: Tensor,  # [N]
    local_quat_wxyz: Tensor,  # [N, 4]
    log_scale: Tensor,  # [N, 3]
    opacity_logit: Tensor,  # [N]
    sh: Tensor,  # [N, K, 3]
    rules: Rules,
) -> Splats:
    """As `embed` and then `activate`, float32; differentiable in all but the posed.

    Raises ValueError for a rule that is not trained, for a posed mesh with a gradient, and for another type or shape.
    """
    check_rules(rules)
    n = len(barycentric)
    if posed.vertex_normal.requires_grad or posed.vertices.requires_grad:
        raise ValueError("embedded_cpu has no gradient for the mesh; stages.surface.embed has")
    if triangle.shape != (n,) or (
        n and not 0 <= int(triangle.min()) <= int(triangle.max()) < len(mesh.triangles)
    ):
        raise ValueError(
            f"triangle does not name one of {len(mesh.triangles)} triangles for each of {n} Gaussians"
        )
    table = torch.cat([posed.vertices, posed.vertex_normal, posed.vertex_turn], dim=1)
    factor, shift = scale_change(posed, mesh, triangle, rules)
    on_mesh = OnMesh(
        mesh.triangles[triangle].numpy(),
        plain(table, mesh.vertices, 6 + posed.vertex_turn.shape[1]),
        plain(factor.float(), n),
        plain(shift.float(), n),
    )
    frame = torch.empty(n, 3, 3)
    values = barycentric, displacement, local_quat_wxyz, log_scale, opacity_logit
    unit_normal = rules.position == "normal"
    mean, scale, quat, opacity = _Embed.apply(on_mesh, unit_normal, frame, *values)  # type: ignore[no-untyped-call]
    return Splats(mean, scale, quat, opacity, sh, frame)


class _Embed(torch.autograd.Function):
    @staticmethod
    def forward(
        ctx: Any, on_mesh: OnMesh, unit_normal: bool, frame: Tensor, *values: Tensor
    ) -> tuple[Tensor, ...]:
        n = len(values[0])
        out = tuple(torch.empty(shape) for shape in ((n, 3), (n, 3), (n, 4), (n,)))
        ctx.on_mesh, ctx.unit_normal = on_mesh, unit_normal
        ctx.given, ctx.out = _values(values), _out(out)
        _embed(on_mesh, unit_normal, ctx.given, ctx.out, plain(frame, n, 9))
        return out

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        n = len(gradients[0])
        back = tuple(torch.empty(shape) for shape in ((n, 3), (n,), (n, 4), (n, 3), (n,)))
        _embed_backward(ctx.on_mesh, ctx.unit_normal, ctx.given, ctx.out, _out(gradients), _values(back))
        return None, None, None, *back


def _values(tensors: tuple[Tensor, ...]) -> Values:
    n = len(tensors[0])
    shapes = ((n, 3), (n,), (n, 4), (n, 3), (n,))
    return Values(*(plain(tensor, *shape) for tensor, shape in zip(tensors, shapes, strict=True)))


def _out(tensors: tuple[Tensor, ...]) -> Out:
    n = len(tensors[0])
    shapes = ((n, 3), (n, 3), (n, 4), (n,))
    return Out(*(plain(tensor, *shape) for tensor, shape in zip(tensors, shapes, strict=True)))


@kernel(parallel=True)
def _embed(on_mesh: OnMesh, unit_normal: bool, given: Values, out: Out, frame: F32) -> None:
    """`out` activated, and the mesh's turn [N, 9] under each Gaussian."""
    for i in numba.prange(len(given.displacement)):
        _embed_row(i, on_mesh, unit_normal, given, out, frame)


@kernel(parallel=True)
def _embed_backward(
    on_mesh: OnMesh, unit_normal: bool, given: Values, out: Out, gradient: Out, back: Values
) -> None:
    for i in numba.prange(len(given.displacement)):
        _embed_row_backward(i, on_mesh, unit_normal, given, out, gradient, back)


@inlined
def _under(i: int, on_mesh: OnMesh, given: Values) -> tuple[Vector, Vector, Quat]:
    """Foot, normal and turn of the mesh at Gaussian `i`, the latter two of any length."""
    a, b, c = (on_mesh.vertices[i, 0], on_mesh.vertices[i, 1], on_mesh.vertices[i, 2])
    u, v, w = given.barycentric[i, 0], given.barycentric[i, 1], given.barycentric[i, 2]
    t = on_mesh.table
    foot = (at(t, a, b, c, u, v, w, 0), at(t, a, b, c, u, v, w, 1), at(t, a, b, c, u, v, w, 2))
    normal = (at(t, a, b, c, u, v, w, 3), at(t, a, b, c, u, v, w, 4), at(t, a, b, c, u, v, w, 5))
    if by_joints(on_mesh):
        return foot, normal, _turned_by_joints(t, a, b, c, u, v, w)
    turn = (
        at(t, a, b, c, u, v, w, 6),
        at(t, a, b, c, u, v, w, 7),
        at(t, a, b, c, u, v, w, 8),
        at(t, a, b, c, u, v, w, 9),
    )
    return foot, normal, turn


@inlined
def _turned_by_joints(t: F32, a: int, b: int, c: int, u: Scalar, v: Scalar, w: Scalar) -> Quat:
    """Quaternion of the polar factor of the corners' skin matrices, summed."""
    m = (
        at(t, a, b, c, u, v, w, 6),
        at(t, a, b, c, u, v, w, 7),
        at(t, a, b, c, u, v, w, 8),
        at(t, a, b, c, u, v, w, 9),
        at(t, a, b, c, u, v, w, 10),
        at(t, a, b, c, u, v, w, 11),
        at(t, a, b, c, u, v, w, 12),
        at(t, a, b, c, u, v, w, 13),
        at(t, a, b, c, u, v, w, 14),
    )
    for _ in range(POLAR_STEPS):
        m = newton_step(m)
    return quat_from_matrix(m, ONE)


@inlined
def by_joints(on_mesh: OnMesh) -> bool:
    """Whether the turn is that of skin matrices, which has no gradient."""
    rigged: bool = on_mesh.table.shape[1] > 10
    return rigged


@inlined
def at(table: F32, a: int, b: int, c: int, u: Scalar, v: Scalar, w: Scalar, k: int) -> Scalar:
    """Number k of the vertices' rows at a barycentric point."""
    return u * table[a, k] + v * table[b, k] + w * table[c, k]


@inlined
def _raised(normal: Vector, unit_normal: bool) -> tuple[Vector, Scalar]:
    """(normal, what it was divided by): made unit, or as it is."""
    x, y, z = normal
    length = max(math.sqrt(x * x + y * y + z * z), NONE) if unit_normal else ONE
    return (x / length, y / length, z / length), length


@inlined
def _embed_row(i: int, on_mesh: OnMesh, unit_normal: bool, given: Values, out: Out, frame: F32) -> None:
    foot, normal, turn = _under(i, on_mesh, given)
    up, _ = _raised(normal, unit_normal)
    d = given.displacement[i]
    out.mean[i, 0], out.mean[i, 1], out.mean[i, 2] = (
        foot[0] + d * up[0],
        foot[1] + d * up[1],
        foot[2] + d * up[2],
    )
    for k in range(3):
        out.scale[i, k] = math.exp(given.log_scale[i, k] * on_mesh.factor[i] + on_mesh.shift[i])
    unit, _ = divided(turn, NONE)
    quat, _ = divided(quat_multiply(unit, quat_at(i, given.local_quat_wxyz)), LEAST)
    store_quat(quat, i, out.quat_wxyz)
    out.opacity[i] = sigmoid(given.opacity_logit[i])
    to = frame[i]
    to[0], to[1], to[2], to[3], to[4], to[5], to[6], to[7], to[8] = matrix_from_quat(unit, ONE)


@inlined
def _embed_row_backward(
    i: int, on_mesh: OnMesh, unit_normal: bool, given: Values, out: Out, gradient: Out, back: Values
) -> None:
    _, normal, turn = _under(i, on_mesh, given)
    up, height = _raised(normal, unit_normal)
    d = given.displacement[i]
    x, y, z = gradient.mean[i, 0], gradient.mean[i, 1], gradient.mean[i, 2]
    along = x * up[0] + y * up[1] + z * up[2]
    back.displacement[i] = along
    inward = along if unit_normal and height > NONE else ONE - ONE
    nx, ny, nz = (
        d * (x - up[0] * inward) / height,
        d * (y - up[1] * inward) / height,
        d * (z - up[2] * inward) / height,
    )
    unit, length = divided(turn, NONE)
    local = quat_at(i, given.local_quat_wxyz)
    _, turned_length = divided(quat_multiply(unit, local), LEAST)
    turned = undivided(quat_at(i, gradient.quat_wxyz), quat_at(i, out.quat_wxyz), turned_length, LEAST)
    store_quat(quat_multiply(conjugate(unit), turned), i, back.local_quat_wxyz)
    qw, qx, qy, qz = undivided(quat_multiply(turned, conjugate(local)), unit, length, NONE)
    for k in range(3):
        v = on_mesh.table[on_mesh.vertices[i, k]]
        at_corner = x * v[0] + y * v[1] + z * v[2] + nx * v[3] + ny * v[4] + nz * v[5]
        if not by_joints(on_mesh):
            at_corner += qw * v[6] + qx * v[7] + qy * v[8] + qz * v[9]
        back.barycentric[i, k] = at_corner
        back.log_scale[i, k] = gradient.scale[i, k] * out.scale[i, k] * on_mesh.factor[i]
    opacity = out.opacity[i]
    back.opacity_logit[i] = gradient.opacity[i] * opacity * (ONE - opacity)
