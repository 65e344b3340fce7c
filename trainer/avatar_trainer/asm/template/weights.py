"""Skinning weights before any fit: heat that spreads over the skin from the vertices nearest to a bone.

Stands in for Blender's automatic weights, with which ASM (arXiv 2304.09423, section 3.3) begins. Source: Baran and
Popovic 2007, "Automatic rigging and animation of 3D characters", section 4. For each bone (-Laplace + H) w = H p is
solved, where p is 1 if the bone is the nearest one, and H = CONDUCTED / distance^2. Weights are smooth, between 0 and
1, and add up to 1. Bones here are points; obstacles between bone and skin are ignored.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import prange

from avatar_runtime import F64, I64
from avatar_runtime.backends.cpu import kernel
from avatar_trainer.asm.template.unwrap import Welded, cotangent_edges, weld

CONDUCTED = 4.0  # 1 spreads a bone over a face: its four largest weights of a vertex then miss a sixth
NEAREST = 1e-3  # metres; a nearer bone heats like one at this distance
SOLVED = 1e-8  # residual relative to the right-hand side, of the worst bone
STEPS = 2000
LEAST = 1e-4  # smaller weights are dropped

Array = npt.NDArray[Any]


def initial_weights(vertices: Array, triangles: Array, bones: Array) -> F64:
    """Weights [V, J] of a mesh [V, 3] metres, triangles [F, 3], for bones at points [J, 3].

    Vertices at the same place have the same weights.
    """
    mesh = weld(vertices, triangles)
    apart, nearest = _nearest(mesh.vertices, bones.astype(np.float64))
    conducted = vertex_areas(mesh) * CONDUCTED / np.square(np.maximum(apart, NEAREST))
    source = np.zeros((len(mesh.vertices), len(bones)))
    source[np.arange(len(source)), nearest] = conducted
    heat = np.maximum(_balance(mesh, conducted, source), 0)
    heat /= heat.sum(axis=1, keepdims=True)
    heat[heat < LEAST] = 0
    heat /= heat.sum(axis=1, keepdims=True)
    return heat[mesh.row]


def vertex_areas(mesh: Welded) -> F64:
    """[W] square metres: a third of the triangles around; at least a millionth of the mean."""
    corner = mesh.vertices[mesh.triangles]
    third = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1) / 6
    area = np.bincount(mesh.triangles.reshape(-1), np.repeat(third, 3), len(mesh.vertices))
    result: F64 = np.maximum(area, 1e-6 * area.mean())
    return result


def _nearest(vertices: F64, bones: F64) -> tuple[F64, I64]:
    """(distance, bone) [W] of the nearest bone; of equally near ones the first."""
    apart = np.stack([np.linalg.norm(vertices - bone, axis=1) for bone in bones], axis=1)
    nearest = apart.argmin(axis=1)
    return apart[np.arange(len(apart)), nearest], nearest.astype(np.int64)


def _balance(mesh: Welded, conducted: F64, source: F64) -> F64:
    """(L + diag(conducted))^-1 source [W, J] with L the mesh's cotangent Laplacian: conjugate gradients."""
    edges, weight = cotangent_edges(mesh)
    both = np.concatenate([edges, edges[:, ::-1]])
    order = np.argsort(both[:, 0], kind="stable")
    ptr = np.searchsorted(both[order, 0], np.arange(len(source) + 1))
    neighbour, pull = both[order, 1], np.tile(weight, 2)[order]
    diagonal = conducted + np.bincount(both[:, 0], np.tile(weight, 2), len(source))
    x = source / conducted[:, None]
    image = np.empty_like(x)
    _apply(ptr, neighbour, pull, diagonal, x, image)
    residual = source - image
    search = residual / diagonal[:, None]
    energy = np.sum(residual * search, axis=0)
    limit = SOLVED * np.maximum(np.linalg.norm(source, axis=0), 1e-300)
    for _ in range(STEPS):
        if np.all(np.linalg.norm(residual, axis=0) <= limit):
            break
        _apply(ptr, neighbour, pull, diagonal, search, image)
        step = energy / np.maximum(np.sum(search * image, axis=0), 1e-300)
        x += step * search
        residual -= step * image
        ready = residual / diagonal[:, None]
        fresh = np.sum(residual * ready, axis=0)
        search = ready + fresh / np.maximum(energy, 1e-300) * search
        energy = fresh
    result: F64 = x
    return result


@kernel(parallel=True)
def _apply(ptr: I64, neighbour: I64, pull: F64, diagonal: F64, x: F64, out: F64) -> None:
    """out = (diag(diagonal) - pull) x [W, J]."""
    for v in prange(len(out)):
        for j in range(x.shape[1]):
            out[v, j] = diagonal[v] * x[v, j]
        for e in range(ptr[v], ptr[v + 1]):
            u = neighbour[e]
            for j in range(x.shape[1]):
                out[v, j] -= pull[e] * x[u, j]
