"""Points on and off a trained mesh: x = sum_k b_k (v_k + r n_k) (PSAvatar Eqs. 7 to 9), and their rotation.

Vertex normals n_k are sums of edge x edge over a vertex's triangles, divided by their length or by a floor, as in
`stages.surface.pose_mesh`; summed in float64. The gradient reaches the vertices through both the feet and the normals.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numba
import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F32, F64, I64
from avatar_runtime.backends.cpu import Mesh, Scalar, inlined, kernel, newton_step, quat_from_matrix
from avatar_schema import constants
from avatar_trainer.kernels.activation import ONE, store_quat
from avatar_trainer.kernels.arrays import plain
from avatar_trainer.kernels.mesh import KernelMesh

POLAR_STEPS = int(constants()["polar_steps"])
Vector = tuple[Scalar, Scalar, Scalar]


class Rows(NamedTuple):
    """The places of N points, and for each vertex the points that depend on it."""

    vertices: I64  # [N, 3]
    barycentric: F32  # [N, 3]
    ptr: I64  # [V + 1]
    corner: I64  # [3 N] 3 i + k, by vertex, rising


@dataclass(frozen=True)
class Placed:
    """N points of a mesh. Made by `placed`."""

    mesh: KernelMesh
    rows: Rows
    normal_floor: float


def placed(mesh: KernelMesh, triangle: Tensor, barycentric: Tensor) -> Placed:
    """Points in `triangle` [N] int64 at `barycentric` [N, 3]. ValueError for a triangle that does not exist."""
    n, surface = len(triangle), mesh.definition
    if n and not 0 <= int(triangle.min()) <= int(triangle.max()) < len(surface.triangles):
        raise ValueError(f"triangle does not name one of {len(surface.triangles)} triangles")
    vertices = surface.triangles[triangle].numpy()
    count = np.bincount(vertices.reshape(-1), minlength=surface.vertices)
    ptr = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    corner = np.argsort(vertices.reshape(-1), kind="stable")
    floor = float(constants()["normal_floor"]) / surface.training_per_bundle**2
    return Placed(mesh, Rows(vertices, plain(barycentric, n, 3), ptr, corner), floor)


def mesh_points_cpu(vertices: Tensor, displacement: Tensor, at: Placed) -> Tensor:
    """[N, 3] the points on posed `vertices` [V, 3], at `displacement` [N] along the normals; differentiable in both."""
    result: Tensor = _MeshPoints.apply(vertices, displacement, at)  # type: ignore[no-untyped-call]
    return result


def turns_cpu(vertex_matrix: Tensor, at: Placed) -> tuple[Tensor, Tensor]:
    """(rotation [N, 3, 3], quat_wxyz [N, 4]) of `stages.surface.bary_vertex_rotation`, without gradients.

    `vertex_matrix` [V, 3, 4] of skinning.
    """
    n = len(at.rows.vertices)
    rotation, quat = torch.empty(n, 3, 3), torch.empty(n, 4)
    _turn(
        plain(vertex_matrix, at.mesh.definition.vertices, 12),
        at.rows,
        plain(rotation, n, 9),
        plain(quat, n, 4),
    )
    return rotation, quat


class _MeshPoints(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, vertices: Tensor, displacement: Tensor, at: Placed) -> Tensor:
        v, n = at.mesh.definition.vertices, len(at.rows.vertices)
        position, raised = plain(vertices, v, 3), plain(displacement, n)
        across, normal, length = (
            np.empty((len(at.mesh.definition.triangles), 3)),
            np.empty((v, 3)),
            np.empty(v),
        )
        _across(position, at.mesh.arrays, across)
        _normals(across, at.mesh.arrays, at.normal_floor, normal, length)
        mean = torch.empty(n, 3)
        _place(position, normal, raised, at.rows, plain(mean, n, 3))
        ctx.at, ctx.kept = at, (position, raised, normal, length)
        return mean

    @staticmethod
    def backward(ctx: Any, gradient: Tensor) -> tuple[Tensor | None, ...]:
        at: Placed = ctx.at
        position, raised, normal, length = ctx.kept
        v, n = at.mesh.definition.vertices, len(raised)
        grad_mean = plain(gradient, n, 3)
        grad_raised = torch.empty(n)
        _displacement_back(grad_mean, normal, at.rows, plain(grad_raised, n))
        if not ctx.needs_input_grad[0]:
            return None, grad_raised, None
        grad_vertex, grad_sum = np.empty((v, 3)), np.empty((v, 3))
        _vertices_back(
            grad_mean, raised, normal, length, at.normal_floor, at.rows, at.mesh.arrays, grad_vertex, grad_sum
        )
        grad_position = torch.empty(v, 3)
        _normals_back(position, grad_sum, at.mesh.arrays, grad_vertex, plain(grad_position, v, 3))
        return grad_position, grad_raised, None


@kernel(parallel=True)
def _across(vertices: F32, mesh: Mesh, across: F64) -> None:
    for f in numba.prange(len(across)):
        a, b, c = _corner(vertices, mesh, f, 0), _corner(vertices, mesh, f, 1), _corner(vertices, mesh, f, 2)
        across[f, 0], across[f, 1], across[f, 2] = _cross(_minus(b, a), _minus(c, a))


@kernel(parallel=True)
def _normals(across: F64, mesh: Mesh, floor: float, normal: F64, length: F64) -> None:
    """Vertex normals, and the length of each sum."""
    for v in numba.prange(len(length)):
        x, y, z = 0.0, 0.0, 0.0
        for e in range(mesh.vertex_triangle_ptr[v], mesh.vertex_triangle_ptr[v + 1]):
            f = mesh.vertex_triangle[e]
            x, y, z = x + across[f, 0], y + across[f, 1], z + across[f, 2]
        length[v] = math.sqrt(x * x + y * y + z * z)
        by = max(length[v], floor)
        normal[v, 0], normal[v, 1], normal[v, 2] = x / by, y / by, z / by


@kernel(parallel=True)
def _place(vertices: F32, normal: F64, raised: F32, rows: Rows, mean: F32) -> None:
    for i in numba.prange(len(mean)):
        for x in range(3):
            total = 0.0
            for k in range(3):
                v = rows.vertices[i, k]
                total += rows.barycentric[i, k] * (vertices[v, x] + raised[i] * normal[v, x])
            mean[i, x] = total


@kernel(parallel=True)
def _displacement_back(gradient: F32, normal: F64, rows: Rows, out: F32) -> None:
    for i in numba.prange(len(out)):
        total = 0.0
        for k in range(3):
            v = rows.vertices[i, k]
            along = (
                gradient[i, 0] * normal[v, 0] + gradient[i, 1] * normal[v, 1] + gradient[i, 2] * normal[v, 2]
            )
            total += rows.barycentric[i, k] * along
        out[i] = total


@kernel(parallel=True)
def _vertices_back(
    gradient: F32,
    raised: F32,
    normal: F64,
    length: F64,
    floor: float,
    rows: Rows,
    mesh: Mesh,
    grad_vertex: F64,
    grad_sum: F64,
) -> None:
    """The gradient of each vertex through the feet, and of the sum of its normal."""
    for v in numba.prange(len(length)):
        gx, gy, gz = 0.0, 0.0, 0.0
        nx, ny, nz = 0.0, 0.0, 0.0
        for e in range(rows.ptr[v], rows.ptr[v + 1]):
            i, k = rows.corner[e] // 3, rows.corner[e] % 3
            weight = rows.barycentric[i, k] + 0.0 * length[v]
            x, y, z = weight * gradient[i, 0], weight * gradient[i, 1], weight * gradient[i, 2]
            gx, gy, gz = gx + x, gy + y, gz + z
            nx, ny, nz = nx + raised[i] * x, ny + raised[i] * y, nz + raised[i] * z
        grad_vertex[v, 0], grad_vertex[v, 1], grad_vertex[v, 2] = gx, gy, gz
        ux, uy, uz = normal[v, 0], normal[v, 1], normal[v, 2]
        by = max(length[v], floor)
        along = nx * ux + ny * uy + nz * uz if length[v] > floor else 0.0
        grad_sum[v, 0] = (nx - ux * along) / by
        grad_sum[v, 1] = (ny - uy * along) / by
        grad_sum[v, 2] = (nz - uz * along) / by


@kernel(parallel=True)
def _normals_back(vertices: F32, grad_sum: F64, mesh: Mesh, grad_vertex: F64, out: F32) -> None:
    """Through edge x edge: of corner k it is (what follows it - what precedes it) x the triangle's gradient."""
    for v in numba.prange(len(out)):
        x, y, z = grad_vertex[v, 0], grad_vertex[v, 1], grad_vertex[v, 2]
        for e in range(mesh.vertex_triangle_ptr[v], mesh.vertex_triangle_ptr[v + 1]):
            f = mesh.vertex_triangle[e]
            a, b, c = mesh.triangles[f, 0], mesh.triangles[f, 1], mesh.triangles[f, 2]
            after, before = 1, 2
            if b == v:
                after, before = 2, 0
            elif c == v:
                after, before = 0, 1
            g = (
                grad_sum[a, 0] + grad_sum[b, 0] + grad_sum[c, 0],
                grad_sum[a, 1] + grad_sum[b, 1] + grad_sum[c, 1],
                grad_sum[a, 2] + grad_sum[b, 2] + grad_sum[c, 2],
            )
            edge = _minus(_corner(vertices, mesh, f, after), _corner(vertices, mesh, f, before))
            dx, dy, dz = _cross(edge, g)
            x, y, z = x + dx, y + dy, z + dz
        out[v, 0], out[v, 1], out[v, 2] = x, y, z


@kernel(parallel=True)
def _turn(matrix: F32, rows: Rows, rotation: F32, quat: F32) -> None:
    for i in numba.prange(len(quat)):
        m = _linear(i, matrix, rows)
        for _ in range(POLAR_STEPS):
            m = newton_step(m)
        to = rotation[i]
        to[0], to[1], to[2], to[3], to[4], to[5], to[6], to[7], to[8] = m
        store_quat(quat_from_matrix(m, ONE), i, quat)


@inlined
def _linear(i: int, matrix: F32, rows: Rows) -> tuple[Scalar, ...]:
    """The barycentric sum of the linear parts of three vertices' matrices."""
    a = matrix[rows.vertices[i, 0]]
    b = matrix[rows.vertices[i, 1]]
    c = matrix[rows.vertices[i, 2]]
    u, v, w = rows.barycentric[i, 0], rows.barycentric[i, 1], rows.barycentric[i, 2]
    return (
        u * a[0] + v * b[0] + w * c[0],
        u * a[1] + v * b[1] + w * c[1],
        u * a[2] + v * b[2] + w * c[2],
        u * a[4] + v * b[4] + w * c[4],
        u * a[5] + v * b[5] + w * c[5],
        u * a[6] + v * b[6] + w * c[6],
        u * a[8] + v * b[8] + w * c[8],
        u * a[9] + v * b[9] + w * c[9],
        u * a[10] + v * b[10] + w * c[10],
    )


@inlined
def _corner(vertices: F32, mesh: Mesh, f: int, k: int) -> Vector:
    v = mesh.triangles[f, k]
    return vertices[v, 0] + 0.0, vertices[v, 1] + 0.0, vertices[v, 2] + 0.0


@inlined
def _minus(a: Vector, b: Vector) -> Vector:
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@inlined
def _cross(a: Vector, b: Vector) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
