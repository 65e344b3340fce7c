"""Gaussians embedded in a mesh: which triangle, where on it, and by which rules it moves them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from avatar_export.distill.planes import aligned
from avatar_export.fit.closest import Triangles
from avatar_export.ops.rings import rings
from avatar_runtime.avatar import F32, F64, I64, U32, Embedding, Rules
from avatar_runtime.rotation import quat_multiply
from avatar_runtime.stages.surface import (
    TURNS,
    Surface,
    TriangleShape,
    prepare,
    triangle_shape,
    vertex_normals,
)

TRIED = 10  # frames in which places are settled
SEARCHED = 3  # frames in which the nearest triangle is looked for
WIDER = (48, 192, 2048)  # triangles tried for a Gaussian that still wanders
MOST_PAIRS = 1 << 18  # of Gaussians and triangles that are tried so
SETTLED = 1e-6  # metres: a Gaussian that wanders less has its triangle
AT_ONCE = 16384  # Gaussians and triangles
STEPS = 6  # of Gauss and Newton
FEW = 4  # frames in which triangles are compared
BEYOND = 9e-4  # how far below 0 a weight may be: an avatar has none below -1e-3


@dataclass(frozen=True)
class Place:
    """Where each Gaussian sits."""

    triangle: I64  # [n]
    barycentric: F64  # [n, 3]
    displacement: F64  # [n]
    cost: F64  # [n] mean square of what it wanders on the mesh, metres^2


@dataclass(frozen=True)
class Posed:
    """A mesh in some frames."""

    triangles: U32  # [T, 3]
    vertices: Sequence[F32]  # of each frame, [V, 3]
    normals: Sequence[F64]  # of each frame, [V, 3]


def posed_meshes(
    canonical: F32, triangles: U32, vertices: Sequence[F32], training_per_bundle: float
) -> Posed:
    """The mesh in frames, with its normals as the player makes them."""
    still = surface_of(
        canonical, triangles, np.zeros(0, np.int64), Rules(rotation="vertex_quaternion"), training_per_bundle
    )
    return Posed(triangles, vertices, [vertex_normals(still, one) for one in vertices])


def surface_of(
    canonical: F32,
    triangles: U32,
    triangle: I64,
    rules: Rules,
    training_per_bundle: float,
    place: Place | None = None,
) -> Surface:
    """A prepared embedding of the Gaussians at `place`, without rotations of their own."""
    n = len(triangle)
    zero, unit = np.zeros(n, np.float32), np.tile(np.array([1, 0, 0, 0], np.float32), (n, 1))
    embedding = Embedding(
        canonical_vertices=canonical,
        triangles=triangles,
        triangle=triangle.astype(np.uint32),
        barycentric=np.zeros((n, 3), np.float32) if place is None else place.barycentric.astype(np.float32),
        displacement=zero if place is None else place.displacement.astype(np.float32),
        local_offset=np.zeros((0, 3), np.float32),
        local_quat_wxyz=unit,
    )
    return prepare(embedding, rules, training_per_bundle)


def places(mesh: Posed, mean: F32) -> Place:
    """The triangle of each Gaussian that was at `mean` [M, n, 3], on which it wanders least in these frames.

    The nearest triangles and their neighbours are tried first, and more of those about a Gaussian that still wanders.
    """
    near = _nearest(mesh, mean)
    found = _best(
        mesh, mean, np.concatenate([near, rings(mesh.triangles, len(mesh.vertices[0]))[near[:, 0]]], axis=1)
    )
    for count in WIDER:
        restless = np.argsort(-found.cost, kind="stable")[: MOST_PAIRS // count]
        restless = restless[found.cost[restless] > SETTLED**2]
        for first in range(0, len(restless), AT_ONCE // count):
            rows = restless[first : first + AT_ONCE // count]
            again = _best(mesh, mean[:, rows], _around(mesh, mean[:, rows], count))
            better = again.cost < found.cost[rows]
            for name in Place.__dataclass_fields__:
                getattr(found, name)[rows[better]] = getattr(again, name)[better]
    return found


def _around(mesh: Posed, mean: F32, count: int) -> I64:
    """[n, count] the triangles whose centres are nearest in the first frame."""
    centre = mesh.vertices[0].astype(np.float64)[mesh.triangles].mean(axis=1)
    point = mean[0].astype(np.float64)
    apart = np.square(centre).sum(axis=1) - 2 * point @ centre.T
    result: I64 = np.argpartition(apart, min(count, len(centre)) - 1, axis=1)[:, :count]
    return result


def _best(mesh: Posed, mean: F32, tried: I64) -> Place:
    """The best of the triangles `tried` [n, C], found in a few frames and settled in all."""
    n = len(tried)
    ordered = np.sort(tried, axis=1)
    fresh = np.concatenate([np.ones((n, 1), bool), ordered[:, 1:] != ordered[:, :-1]], axis=1)
    row, column = np.nonzero(fresh)
    triangle = ordered[row, column]
    few = np.unique(np.linspace(0, len(mean) - 1, FEW).astype(int))
    cost = np.empty(len(row))
    for first in range(0, len(row), AT_ONCE):
        part = slice(first, first + AT_ONCE)
        cost[part] = _settled(mesh, few, mean[:, row[part]], triangle[part]).cost
    order = np.lexsort((triangle, np.nan_to_num(cost, nan=np.inf), row))
    best = triangle[order[np.searchsorted(row[order], np.arange(n))]]
    return _settled(mesh, np.arange(len(mean)), mean, best)


def _settled(mesh: Posed, frames: I64, mean: F32, triangle: I64) -> Place:
    """The place on `triangle` [P] that fits best in `frames` to positions `mean` [M, P, 3]: Gauss-Newton."""
    at = mesh.triangles[triangle].astype(np.int64)
    count = len(triangle)
    uvd = np.concatenate([np.full((count, 2), 1 / 3), np.zeros((count, 1))], axis=1)
    first = frames[0]
    middle = mesh.normals[first][at].mean(axis=1)
    off = mean[first] - mesh.vertices[first].astype(np.float64)[at].mean(axis=1)
    uvd[:, 2] = np.einsum("pi,pi->p", off, middle) / np.maximum(np.linalg.norm(middle, axis=1), 1e-30)
    corners = [(mesh.vertices[f].astype(np.float64)[at], mesh.normals[f][at], mean[f]) for f in frames]
    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            square, slope, _ = _sums(corners, uvd)
            square += 1e-9 * np.trace(square, axis1=1, axis2=2)[:, None, None] * np.eye(3) + 1e-300 * np.eye(
                3
            )
            uvd -= np.linalg.solve(square, slope[..., None])[..., 0]
            uvd[:, :2] = _inside(uvd[:, :2])[:, 1:]
        cost = _sums(corners, uvd)[2] / len(corners)
    barycentric = _inside(uvd[:, :2])
    return Place(triangle.copy(), barycentric, uvd[:, 2].copy(), np.nan_to_num(cost, nan=np.inf))


def _inside(two: F64) -> F64:
    """[P, 3] barycentric weights of the second and third [P, 2], in the triangle but for BEYOND."""
    weights = np.concatenate([1 - two.sum(axis=1, keepdims=True), two], axis=1)
    weights = np.maximum(np.nan_to_num(weights, nan=1 / 3), -BEYOND)
    result: F64 = weights / weights.sum(axis=1, keepdims=True)
    return result


def _sums(corners: Sequence[tuple[F64, F64, F32]], uvd: F64) -> tuple[F64, F64, F64]:
    """(J^T J [P, 3, 3], J^T r [P, 3], r^T r [P]) over the frames, of r = b V + d n(b) - x by u, v and d."""
    b = np.concatenate([1 - uvd[:, :2].sum(axis=1, keepdims=True), uvd[:, :2]], axis=1)
    square, slope, cost = np.zeros((len(b), 3, 3)), np.zeros((len(b), 3)), np.zeros(len(b))
    height = uvd[:, 2:, None]
    for vertex, normal, point in corners:
        long = np.einsum("pc,pci->pi", b, normal)
        length = np.maximum(np.linalg.norm(long, axis=1, keepdims=True), 1e-30)
        n = long / length
        bend = (normal[:, 1:] - normal[:, :1]) / length[..., None]  # [P, 2, 3]
        bend -= np.einsum("pki,pi->pk", bend, n)[..., None] * n[:, None]
        jacobian = np.concatenate([vertex[:, 1:] - vertex[:, :1] + height * bend, n[:, None]], axis=1)
        off = np.einsum("pc,pci->pi", b, vertex) + uvd[:, 2:] * n - point
        square += jacobian @ jacobian.swapaxes(1, 2)
        slope += np.einsum("pki,pi->pk", jacobian, off)
        cost += np.square(off).sum(axis=1)
    return square, slope, cost


def _nearest(mesh: Posed, mean: F32) -> I64:
    """[n, SEARCHED] the nearest triangles in some frames."""
    some = np.unique(np.linspace(0, len(mean) - 1, SEARCHED).astype(int))
    found = [
        Triangles.of(np.asarray(mesh.vertices[f], np.float64), mesh.triangles).nearest(
            mean[f].astype(np.float64)
        )
        for f in some
    ]
    return np.stack([one.triangle for one in found], axis=1)


@dataclass(frozen=True)
class Turned:
    """Rotations and sizes of the mesh under the Gaussians, frame by frame."""

    quat_wxyz: F32  # [F, n, 4]
    size: F64  # [F, n] of the triangles
    canonical_size: F64  # [n]


def under(surface: Surface, vertices: Sequence[F32]) -> Turned:
    """What the mesh does under each Gaussian of a prepared embedding."""
    quats, sizes = [], []
    at = surface.embedding.triangle
    for one in vertices:
        shape: TriangleShape = triangle_shape(one, surface.embedding.triangles, surface.rules)
        turn = TURNS[surface.rules.rotation](surface, shape, None)
        quats.append(
            (turn / np.maximum(np.linalg.norm(turn, axis=1, keepdims=True), 1e-30)).astype(np.float32)
        )
        sizes.append(shape.size[at])
    return Turned(np.stack(quats), np.stack(sizes), surface.canonical.size[at])


def local_quats(turned: Turned, quat: F32) -> F32:
    """[F, n, 4] the Gaussians' own rotations on the mesh, one sign each."""
    back = turned.quat_wxyz * np.array([1, -1, -1, -1], np.float32)
    return aligned(quat_multiply(back, quat))


def unscaled(rule: str, turned: Turned, log_scale: F32, training_per_bundle: float, damping: float) -> F32:
    """[F, n, 3] log scales before the mesh stretched them by `rule`: the inverse of stages.surface.SCALES."""
    u = training_per_bundle
    if rule == "log_area":
        ratio = (turned.size + damping / u**2) / (turned.canonical_size + damping / u**2)
        result = (log_scale + np.log(u)) / ratio[..., None] - np.log(u)
    elif rule == "linear_area":
        result = log_scale - np.log(np.maximum(turned.size, 1e-30) / turned.canonical_size)[..., None]
    elif rule == "none":
        result = log_scale
    else:
        raise KeyError(f"scale rule {rule} has no inverse here")
    return np.asarray(result, np.float32)


def spread(values: F32) -> float:
    """Mean variance over the frames [F, n, c]."""
    return float(values.var(axis=0, dtype=np.float64).mean())
