"""Stage `bind` of Gaussians embedded in a triangle mesh: triangles, then vertices, then Gaussians.

Sums are float64 as in stages/surface.py, which gives the reason and the sources.
"""

from __future__ import annotations

import math

import numpy as np

from avatar_runtime.avatar import F32, F64
from avatar_runtime.backends.cpu.arrays import BLOCK, Array, Embedded, Mesh, PosedMesh
from avatar_runtime.backends.cpu.deform.planes import MEAN, set_quat, set_turn
from avatar_runtime.backends.cpu.jit import Scalar, inlined, kernel
from avatar_runtime.backends.cpu.rotation import (
    matrix_from_quat,
    matrix_multiply,
    newton_step,
    quat_from_matrix,
    quat_multiply,
)
from avatar_runtime.rules import code
from avatar_runtime.stages.surface import TINY
from avatar_schema import constants

Vector = tuple[Scalar, Scalar, Scalar]
ZERO, ONE, HALF = 0.0, 1.0, 0.5
UNIT_NORMAL, IN_TRIANGLE = code("position", "normal"), code("position", "triangle_frame")
BY_TRIANGLE, MEAN_BY_AREA = code("rotation", "triangle_frame"), code("rotation", "vertex_quaternion_mean")
W_POSITIVE = code("quaternion_sign", "w_positive")
LARGEST_MIRRORED = code("quaternion_sign", "largest_positive_mirrored")

# Planes of float64. Of triangles:
EDGES = 0  # 6: two edges from corner 0
CANONICAL = 6 * BLOCK  # 9, row-major: the canonical frame
CANONICAL_SIZE = 15 * BLOCK
SIZE = 16 * BLOCK
RESULT = 17 * BLOCK  # 13: what `PosedMesh.triangle` holds
TRIANGLE_PLANES = 30 * BLOCK
# Of Gaussians:
FOOT = 0  # 3
RISE = 3 * BLOCK  # 3: from the foot to the mean
SWING = 6 * BLOCK  # 4: the mesh's turn, any length
LOCAL = 10 * BLOCK  # 4: quaternion before the mesh turns it
HEIGHT = 14 * BLOCK
MATRIX = 15 * BLOCK  # 9: the linear part of the mesh's skin matrices, row-major, for bary_vertex_lbs
GAUSSIAN_PLANES = 24 * BLOCK
POLAR_STEPS = int(constants()["polar_steps"])


@inlined
def cross(a: Vector, b: Vector) -> Vector:
    """a x b."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@inlined
def norm(a: Vector) -> Scalar:
    """|a|."""
    return math.sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2])


@inlined
def unit(a: Vector) -> Vector:
    """a / |a|; finite for a of length 0."""
    length = norm(a)
    if length < TINY:
        length = TINY
    return a[0] / length, a[1] / length, a[2] / length


@kernel()
def triangle_turns(
    vertices: F32,  # [V, 3] posed
    mesh: Mesh,
    rotation_rule: int,
    sign_rule: int,
    posed_mesh: PosedMesh,
) -> None:
    """The values of the posed triangles that the rules read. Quaternions have the signs of `turns_from_canonical`."""
    p = np.empty(TRIANGLE_PLANES, np.float64)
    by_vertex = rotation_rule != BY_TRIANGLE
    for first in range(0, len(mesh.triangles), BLOCK):
        count = min(BLOCK, len(mesh.triangles) - first)
        for lane in range(count):
            load_triangle(first + lane, lane, vertices, mesh, p)
        if by_vertex:
            turns_from_canonical(count, sign_rule, p)
        else:
            frames(count, p)
        for lane in range(count):
            posed_mesh.size[first + lane] = p[SIZE + lane]
            for k in range(7 if by_vertex else 13):
                posed_mesh.triangle[first + lane, k] = p[RESULT + k * BLOCK + lane]


@inlined
def load_triangle(triangle: int, lane: int, vertices: F32, mesh: Mesh, p: F64) -> None:
    """EDGES and CANONICAL of one lane."""
    a, b, c = mesh.triangles[triangle, 0], mesh.triangles[triangle, 1], mesh.triangles[triangle, 2]
    for k in range(3):
        origin = np.float64(vertices[a, k])
        p[EDGES + k * BLOCK + lane] = np.float64(vertices[b, k]) - origin
        p[EDGES + (k + 3) * BLOCK + lane] = np.float64(vertices[c, k]) - origin
    for k in range(9):
        p[CANONICAL + k * BLOCK + lane] = mesh.frame[triangle, k]
    p[CANONICAL_SIZE + lane] = mesh.size[triangle]


@inlined
def turns_from_canonical(count: int, sign_rule: int, p: F64) -> None:
    """SIZE (area) and RESULT: edge cross edge; posed frame times inverse canonical frame as a quaternion, by area."""
    mirror = (
        -ONE if sign_rule == LARGEST_MIRRORED else ONE
    )  # the sign is chosen in the frame mirrored in x, or here
    for lane in range(count):
        at = EDGES + lane
        e = (p[at], p[at + BLOCK], p[at + 2 * BLOCK])
        f = (p[at + 3 * BLOCK], p[at + 4 * BLOCK], p[at + 5 * BLOCK])
        across = cross(e, f)
        x = unit(cross(e, unit(across)))
        y, z = unit(cross(e, x)), unit(e)
        posed = (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])
        at = CANONICAL + lane
        inverse = (
            p[at],
            p[at + 3 * BLOCK],
            p[at + 6 * BLOCK],
            p[at + BLOCK],
            p[at + 4 * BLOCK],
            p[at + 7 * BLOCK],
            p[at + 2 * BLOCK],
            p[at + 5 * BLOCK],
            p[at + 8 * BLOCK],
        )
        m00, m01, m02, m10, m11, m12, m20, m21, m22 = matrix_multiply(posed, inverse)
        seen = (m00, m01 * mirror, m02 * mirror, m10 * mirror, m11, m12, m20 * mirror, m21, m22)
        w, i, j, k = quat_from_matrix(seen, ONE)
        area = p[CANONICAL_SIZE + lane]
        if sign_rule == W_POSITIVE and w < ZERO:
            area = -area
        p[SIZE + lane] = norm(across) / 2.0
        values = (
            across[0],
            across[1],
            across[2],
            area * w,
            area * i,
            area * (mirror * j),
            area * (mirror * k),
        )
        for row in range(7):
            p[RESULT + row * BLOCK + lane] = values[row]


@inlined
def frames(count: int, p: F64) -> None:
    """SIZE (edge length) and RESULT: frame by rule triangle_frame, and its quaternion."""
    for lane in range(count):
        at = EDGES + lane
        e = (p[at], p[at + BLOCK], p[at + 2 * BLOCK])
        f = (p[at + 3 * BLOCK], p[at + 4 * BLOCK], p[at + 5 * BLOCK])
        x = unit(e)
        y = unit(cross(x, f))
        across = unit(cross(y, x))
        z = (-across[0], -across[1], -across[2])
        frame = (x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2])
        p[SIZE + lane] = (norm(e) + abs(z[0] * f[0] + z[1] * f[1] + z[2] * f[2])) / 2.0
        quat = quat_from_matrix(frame, ONE)
        for k in range(9):
            p[RESULT + k * BLOCK + lane] = frame[k]
        for k in range(4):
            p[RESULT + (9 + k) * BLOCK + lane] = quat[k]


@kernel()
def vertex_sums(
    mesh: Mesh,
    normal_floor: float,
    quaternion_floor: float,
    rotation_rule: int,
    posed_mesh: PosedMesh,
) -> None:
    """Normals and quaternions of vertices: sums over their triangles, divided by their length or the floor.

    Under rotation rule vertex_quaternion_mean quaternions instead by the sum of canonical areas.
    """
    for v in range(len(posed_mesh.vertex)):
        nx = ny = nz = qw = qx = qy = qz = area = ZERO
        for at in range(mesh.vertex_triangle_ptr[v], mesh.vertex_triangle_ptr[v + 1]):
            t = mesh.vertex_triangle[at]
            nx += posed_mesh.triangle[t, 0]
            ny += posed_mesh.triangle[t, 1]
            nz += posed_mesh.triangle[t, 2]
            qw += posed_mesh.triangle[t, 3]
            qx += posed_mesh.triangle[t, 4]
            qy += posed_mesh.triangle[t, 5]
            qz += posed_mesh.triangle[t, 6]
            area += mesh.size[t]
        length = max(math.sqrt(nx * nx + ny * ny + nz * nz), normal_floor)
        posed_mesh.vertex[v, 0] = nx / length
        posed_mesh.vertex[v, 1] = ny / length
        posed_mesh.vertex[v, 2] = nz / length
        length = max(math.sqrt(qw * qw + qx * qx + qy * qy + qz * qz), quaternion_floor)
        if rotation_rule == MEAN_BY_AREA:
            length = max(area, TINY)
        posed_mesh.vertex[v, 3] = qw / length
        posed_mesh.vertex[v, 4] = qx / length
        posed_mesh.vertex[v, 5] = qy / length
        posed_mesh.vertex[v, 6] = qz / length


@inlined
def bind_embedded_block(
    first: int,
    count: int,
    embedded: Embedded,
    position_rule: int,
    vertices: F32,
    posed_mesh: PosedMesh,
    p: F64,
    planes: F32,
) -> None:
    """MEAN, QUAT and TURN of `count` Gaussians from `first` on the posed mesh; `p` is room."""
    for lane in range(count):
        at_corners(first + lane, lane, embedded, vertices, 3, FOOT, p)
        for k in range(4):
            p[LOCAL + k * BLOCK + lane] = embedded.local_quat_wxyz[first + lane, k]
    if position_rule != IN_TRIANGLE:
        for lane in range(count):
            p[HEIGHT + lane] = embedded.displacement[first + lane]
            at_corners(first + lane, lane, embedded, posed_mesh.vertex, 7, RISE, p)  # SWING follows RISE
        rise(count, position_rule == UNIT_NORMAL, p)
    else:
        for lane in range(count):
            in_triangle(first + lane, lane, embedded, posed_mesh, p)
    if len(posed_mesh.matrix):
        for lane in range(count):
            at_corners(first + lane, lane, embedded, posed_mesh.matrix, 9, MATRIX, p)
        swing_by_joints(count, p)
    swing(count, p, planes)


@inlined
def at_corners(i: int, lane: int, embedded: Embedded, by_vertex: Array, size: int, to: int, p: F64) -> None:
    """The `size` vertex quantities at the foot of Gaussian `i`, in the planes from `to`."""
    a, b, c = embedded.vertex[i, 0], embedded.vertex[i, 1], embedded.vertex[i, 2]
    u = np.float64(embedded.barycentric[i, 0])
    v = np.float64(embedded.barycentric[i, 1])
    w = np.float64(embedded.barycentric[i, 2])
    for k in range(size):
        p[to + k * BLOCK + lane] = u * by_vertex[a, k] + v * by_vertex[b, k] + w * by_vertex[c, k]


@inlined
def in_triangle(i: int, lane: int, embedded: Embedded, posed_mesh: PosedMesh, p: F64) -> None:
    """RISE and SWING of Gaussian `i` by its triangle's frame."""
    t = embedded.triangle[i]
    x = np.float64(embedded.local_offset[i, 0])
    y = np.float64(embedded.local_offset[i, 1])
    z = np.float64(embedded.local_offset[i, 2])
    for k in range(3):
        along = posed_mesh.triangle[t, 3 * k] * x + posed_mesh.triangle[t, 3 * k + 1] * y
        along += posed_mesh.triangle[t, 3 * k + 2] * z
        p[RISE + k * BLOCK + lane] = posed_mesh.size[t] * along
    for k in range(4):
        p[SWING + k * BLOCK + lane] = posed_mesh.triangle[t, 9 + k]


@inlined
def rise(count: int, unit_normal: bool, p: F64) -> None:
    """RISE is multiplied by HEIGHT, after being made unit if the rule says so."""
    for lane in range(count):
        at, height = RISE + lane, p[HEIGHT + lane]
        x, y, z = p[at], p[at + BLOCK], p[at + 2 * BLOCK]
        if unit_normal:
            x, y, z = unit((x, y, z))
        p[at] = height * x
        p[at + BLOCK] = height * y
        p[at + 2 * BLOCK] = height * z


@inlined
def swing_by_joints(count: int, p: F64) -> None:
    """SWING becomes the quaternion of the polar factor of MATRIX."""
    for lane in range(count):
        at = MATRIX + lane
        m = (
            p[at],
            p[at + BLOCK],
            p[at + 2 * BLOCK],
            p[at + 3 * BLOCK],
            p[at + 4 * BLOCK],
            p[at + 5 * BLOCK],
            p[at + 6 * BLOCK],
            p[at + 7 * BLOCK],
            p[at + 8 * BLOCK],
        )
        for _ in range(POLAR_STEPS):
            m = newton_step(m)
        quat = quat_from_matrix(m, ONE)
        for k in range(4):
            p[SWING + k * BLOCK + lane] = quat[k]


@inlined
def swing(count: int, p: F64, planes: F32) -> None:
    """MEAN is FOOT + RISE, QUAT the LOCAL one after the unit SWING, TURN the matrix of that swing; in float32."""
    for lane in range(count):
        for k in range(3):
            planes[MEAN + k * BLOCK + lane] = p[FOOT + k * BLOCK + lane] + p[RISE + k * BLOCK + lane]
        at = SWING + lane
        w, x, y, z = p[at], p[at + BLOCK], p[at + 2 * BLOCK], p[at + 3 * BLOCK]
        length = math.sqrt(w * w + x * x + y * y + z * z)
        if length < TINY:
            length = TINY
        turn = (w / length, x / length, y / length, z / length)
        at = LOCAL + lane
        local = (p[at], p[at + BLOCK], p[at + 2 * BLOCK], p[at + 3 * BLOCK])
        set_quat(lane, quat_multiply(turn, local), planes)
        set_turn(lane, matrix_from_quat(turn, ONE), planes)
