"""Many ASM faces of one template at once, without gradients: `systems.asm_model.posed`, float32.

Vertices are processed in tiles of neighbours in the uv plane. A mixture's component is left out of a tile if its
density is nowhere more than exp(-FAINT) of another's, a share that float32 hardly holds. One thread computes a whole
tile of a face, so the result does not depend on the number of threads.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numba
import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F32, F64, I64
from avatar_runtime.backends.cpu import inlined, kernel
from avatar_trainer.asm.kernels.closest import nearest
from avatar_trainer.asm.model import Face, TemplateTensors
from avatar_trainer.kernels.arrays import plain

TILE = 32  # vertices
FAINT = np.float32(16)
HALF, ONE, ZERO = np.float32(0.5), np.float32(1), np.float32(0)
CELLS = 1024  # of the curve by which vertices are sorted, in each direction


class Tiles(NamedTuple):
    """A template's vertices in the order in which they are processed."""

    row: I64  # [V] of the template
    uv: F32  # [V, 2]
    vertices: F32  # [V, 3] metres
    middle: F32  # [B, 2] of each tile's box in the plane
    radius: F32  # [B]


class Mixtures(NamedTuple):
    """The components of N faces, G = J K per face."""

    centre: F32  # [N, G, 2] uv
    whiten: F32  # [N, G, 3] of L^-1: 1 / L_00, 1 / L_11, L_10
    height: F32  # [N, G] log of the density at the centre, with its weight pi
    matrix: F32  # [N, J, 12] skin matrices


def tiles(template: TemplateTensors) -> Tiles:
    """Tiles of a template, made once."""
    uv = template.uv.float().numpy()
    low, high = uv.min(axis=0), uv.max(axis=0)
    cell = ((uv - low) / np.maximum(high - low, 1e-12) * (CELLS - 1)).astype(np.int64)
    key = np.zeros(len(uv), np.int64)
    for bit in range(int(math.log2(CELLS))):  # of u and v in turn: Morton's order
        for axis in range(2):
            key |= ((cell[:, axis] >> bit) & 1) << (2 * bit + axis)
    row = np.argsort(key, kind="stable")
    parts = [uv[row[at : at + TILE]] for at in range(0, len(uv), TILE)]
    middle = np.stack([0.5 * (part.min(axis=0) + part.max(axis=0)) for part in parts])
    radius = [np.linalg.norm(part - m, axis=1).max() for part, m in zip(parts, middle, strict=True)]
    rest = template.vertices.float().numpy()[row]
    return Tiles(row, uv[row], rest, middle.astype(np.float32), np.array(radius, np.float32))


class Faces(NamedTuple):
    """`asm_model.Face` of N faces, as arrays."""

    pi_logit: F32  # [N, J, K]
    mu: F32  # [N, J, K, 2]
    scale_tril: F32  # [N, J, K, 3]
    zeta: F32  # [N, J, 2]
    rotation_vector: F32  # [N, J, 3]
    translation: F32  # [N, J, 3]
    log_scale: F32  # [N, J, 3]


class Bones(NamedTuple):
    """A template's bones."""

    parents: I64  # [J]
    linear: F64  # [J, 3, 3] R^0 S^0
    inverse: F64  # [J, 3, 3] of linear


def posed_cpu(template: TemplateTensors, face: Face, of: Tiles) -> Tensor:
    """Vertices [N, V, 3] metres of faces whose tensors all have one leading axis of N; float32, normalised weights.

    Within float32's rounding of `asm_model.posed`. Raises ValueError for another weight rule, type or shape.
    """
    if template.softplus:
        raise ValueError("posed_cpu has the rule `normalised` alone; asm_model.posed has both")
    count, joints, components = face.pi_logit.shape
    wide = {"pi_logit": (components,), "mu": (components, 2), "scale_tril": (components, 3), "zeta": (2,)}
    faces = Faces(
        *(plain(getattr(face, name), count, joints, *wide.get(name, (3,))) for name in Faces._fields)
    )
    each = joints * components
    shapes = (each, 2), (each, 3), (each,), (joints, 12)
    mixtures = Mixtures(*(np.empty((count, *shape), np.float32) for shape in shapes))
    parents = np.array(template.parents, np.int64)
    bones = Bones(parents, template.rest_linear.double().numpy(), template.rest_inverse.double().numpy())
    _mix(faces, mixtures)
    _move(bones, faces, _bone_positions(template, faces.zeta), mixtures.matrix)
    posed = np.empty((count, len(of.row), 3), np.float32)
    _pose(of, mixtures, components, posed)
    return torch.from_numpy(posed)


def _bone_positions(template: TemplateTensors, zeta: F32) -> F64:
    """psi [N, J, 3] of Eq. 7."""
    points = np.pad(zeta.reshape(-1, 2).astype(np.float64), ((0, 0), (0, 1)))
    found = nearest(points, template.plane, template.plane_tree)
    vertices = template.vertices.double().numpy()
    corner = vertices[template.plane_tree.triangles[found.triangle]]
    place = (found.barycentric[:, :, None] * corner).sum(axis=1).reshape(*zeta.shape[:2], 3)
    psi: F64 = place - vertices[template.anchor_vertex.numpy()] + template.rest_position.double().numpy()
    return psi


@kernel(parallel=True)
def _mix(faces: Faces, mixtures: Mixtures) -> None:
    """Centres, whitening and heights of all components."""
    for n in numba.prange(len(faces.zeta)):
        _mix_face(faces, mixtures, n)


@inlined
def _mix_face(faces: Faces, mixtures: Mixtures, n: int) -> None:
    components = faces.pi_logit.shape[2]
    for j in range(faces.zeta.shape[1]):
        most = faces.pi_logit[n, j].max()
        total = 0.0
        for k in range(components):
            total += math.exp(faces.pi_logit[n, j, k] - most)
        for k in range(components):
            g = j * components + k
            log_a, log_b = faces.scale_tril[n, j, k, 0], faces.scale_tril[n, j, k, 1]
            mixtures.whiten[n, g, 0], mixtures.whiten[n, g, 1] = math.exp(-log_a), math.exp(-log_b)
            mixtures.whiten[n, g, 2] = faces.scale_tril[n, j, k, 2]
            log_pi = faces.pi_logit[n, j, k] - most - math.log(total)
            mixtures.height[n, g] = log_pi - log_a - log_b
            for axis in range(2):
                mixtures.centre[n, g, axis] = faces.zeta[n, j, axis] + faces.mu[n, j, k, axis]


@kernel(parallel=True)
def _move(bones: Bones, faces: Faces, position: F64, matrix: F32) -> None:
    """Skin matrices `matrix` [N, J, 12] of bones at `position` [N, J, 3], in float64."""
    joints = len(bones.parents)
    for n in numba.prange(len(position)):
        done = np.empty((joints, 3, 4))
        for j in range(joints):
            own = np.empty((3, 4))
            _own_motion(bones, faces, position[n, j], n, j, own)
            parent = bones.parents[j]
            for row in range(3):
                for column in range(4):
                    if parent < 0:
                        done[j, row, column] = own[row, column]
                    else:
                        above = done[parent, row]
                        moved = (
                            above[0] * own[0, column] + above[1] * own[1, column] + above[2] * own[2, column]
                        )
                        done[j, row, column] = moved + (above[3] if column == 3 else 0.0)
                    matrix[n, j, 4 * row + column] = done[j, row, column]


@inlined
def _own_motion(bones: Bones, faces: Faces, position: F64, n: int, j: int, own: F64) -> None:
    """B M(tau) B^-1 of bone j, `own` [3, 4]."""
    x, y, z = faces.rotation_vector[n, j]
    x, y, z = float(x), float(y), float(z)
    squared = x * x + y * y + z * z
    angle = math.sqrt(squared)
    sine = math.sin(angle) / angle if squared > 1e-12 else 1.0 - squared / 6
    half = math.sin(0.5 * angle)
    cosine = 2 * half * half / squared if squared > 1e-12 else 0.5 - squared / 24
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    local = np.zeros((3, 3))
    for r in range(3):
        for c in range(3):
            twice = cross[r, 0] * cross[0, c] + cross[r, 1] * cross[1, c] + cross[r, 2] * cross[2, c]
            entry = (1.0 if r == c else 0.0) + sine * cross[r, c] + cosine * twice
            local[r, c] = entry * math.exp(faces.log_scale[n, j, c])
    for r in range(3):
        pushed = 0.0
        for c in range(3):
            pushed += bones.linear[j, r, c] * faces.translation[n, j, c]
            total = 0.0
            for a in range(3):
                for b in range(3):
                    total += bones.linear[j, r, a] * local[a, b] * bones.inverse[j, b, c]
            own[r, c] = total
        moved = own[r, 0] * position[0] + own[r, 1] * position[1] + own[r, 2] * position[2]
        own[r, 3] = position[r] + pushed - moved


@kernel(parallel=True)
def _pose(of: Tiles, mixtures: Mixtures, components: int, posed: F32) -> None:
    blocks = len(of.radius)
    for task in numba.prange(len(posed) * blocks):
        _pose_tile(of, mixtures, components, posed, task // blocks, task % blocks)


@inlined
def _pose_tile(of: Tiles, mixtures: Mixtures, components: int, posed: F32, face: int, tile: int) -> None:
    first = tile * TILE
    size = min(TILE, len(of.row) - first)
    kept = np.empty(mixtures.height.shape[1], np.int64)
    count = _components_of(of, mixtures, face, tile, kept)
    share = np.empty((count, TILE), np.float32)
    top = np.full(TILE, -np.inf, np.float32)
    u, v = np.zeros(TILE, np.float32), np.zeros(TILE, np.float32)
    for i in range(size):
        u[i], v[i] = of.uv[first + i, 0], of.uv[first + i, 1]
    for k in range(count):
        g = kept[k]
        x0, y0 = mixtures.centre[face, g, 0], mixtures.centre[face, g, 1]
        a, b, c = mixtures.whiten[face, g, 0], mixtures.whiten[face, g, 1], mixtures.whiten[face, g, 2]
        height = mixtures.height[face, g]
        for i in range(TILE):
            x = (u[i] - x0) * a
            y = (v[i] - y0 - c * x) * b
            share[k, i] = height - HALF * (x * x + y * y)
            top[i] = max(top[i], share[k, i])
    total, held = np.zeros(TILE, np.float32), np.zeros(TILE, np.float32)
    blended = np.zeros((12, TILE), np.float32)
    for k in range(count):
        for i in range(TILE):
            weight = _exp(share[k, i] - top[i])
            held[i] += weight
            total[i] += weight
        bone = kept[k] // components
        if k + 1 < count and kept[k + 1] // components == bone:
            continue  # its next component
        for entry in range(12):
            m = mixtures.matrix[face, bone, entry]
            for i in range(TILE):
                blended[entry, i] += held[i] * m
        held[:] = 0
    for i in range(size):
        x, y, z = of.vertices[first + i, 0], of.vertices[first + i, 1], of.vertices[first + i, 2]
        to, scale = of.row[first + i], ONE / total[i]
        for axis in range(3):
            row = 4 * axis
            moved = blended[row, i] * x + blended[row + 1, i] * y + blended[row + 2, i] * z
            posed[face, to, axis] = (moved + blended[row + 3, i]) * scale


@inlined
def _components_of(of: Tiles, mixtures: Mixtures, face: int, tile: int, kept: I64) -> int:
    """The number of components that count somewhere in the tile; their rows in `kept`."""
    most = np.empty(len(kept), np.float32)
    floor = np.float32(-np.inf)
    radius = of.radius[tile]
    for g in range(len(kept)):
        a, b, c = mixtures.whiten[face, g, 0], mixtures.whiten[face, g, 1], mixtures.whiten[face, g, 2]
        x = (of.middle[tile, 0] - mixtures.centre[face, g, 0]) * a
        y = (of.middle[tile, 1] - mixtures.centre[face, g, 1] - c * x) * b
        apart = np.float32(math.sqrt(x * x + y * y))
        slant = c * a * b
        reach = radius * np.float32(math.sqrt(a * a + b * b + slant * slant))
        near, far = max(apart - reach, ZERO), apart + reach
        most[g] = mixtures.height[face, g] - HALF * near * near
        floor = max(floor, mixtures.height[face, g] - HALF * far * far)
    count = 0
    for g in range(len(kept)):
        if most[g] >= floor - FAINT:
            kept[count] = g
            count += 1
    return count


POWERS = np.exp2(np.arange(-127, 1)).astype(np.float32)
LOG2_E = np.float32(1.44269504088896341)
LN2_HIGH, LN2_LOW = np.float32(0.693359375), np.float32(-2.12194440e-4)
LEAST = np.float32(-87)


@inlined
def _exp(x: np.float32) -> np.float32:
    """exp of x <= 0 within 2 units in the last place (Cephes' expf); written out so that it is vectorised."""
    x = max(x, LEAST)
    n = np.float32(math.floor(x * LOG2_E + HALF))
    r = x - n * LN2_HIGH - n * LN2_LOW
    p = np.float32(1.9875691500e-4)
    p = p * r + np.float32(1.3981999507e-3)
    p = p * r + np.float32(8.3334519073e-3)
    p = p * r + np.float32(4.1665795894e-2)
    p = p * r + np.float32(1.6666665459e-1)
    p = p * r + np.float32(5.0000001201e-1)
    found: np.float32 = (p * r * r + r + ONE) * POWERS[np.int32(n) + 127]
    return found
