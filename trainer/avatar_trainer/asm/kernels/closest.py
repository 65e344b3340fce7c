"""The nearest point of a triangle mesh to many points: exact, by a tree of boxes that is built once for a topology.

float64 inside. The tree only leaves out triangles that lie farther away, so the result depends on points, vertices
and triangles alone: neither the tree nor a guess nor the number of threads changes a bit of it.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numba
import numpy as np
import numpy.typing as npt
import torch
from torch import Tensor

from avatar_runtime import F64, I64
from avatar_runtime.backends.cpu import inlined, kernel

IN_A_LEAF = 6  # triangles at most
DEEPEST = 64  # boxes that may wait while a tree is walked; a tree of 2^40 triangles needs 42

Floats = npt.NDArray[np.floating[Any]]
Integers = npt.NDArray[np.integer[Any]]


class Nearest(NamedTuple):
    """The point of a mesh that is nearest to each of N points."""

    triangle: I64  # [N] of equally near ones the first
    barycentric: F64  # [N, 3] its corners' weights, each in 0..1
    squared_distance: F64  # [N]


class TriangleTree(NamedTuple):
    """Which triangles share a box: a balanced binary tree, stored as an array (the children of i are 2i+1 and 2i+2)."""

    triangles: I64  # [F, 3]
    order: I64  # [F] row of `triangles` at each place; a leaf is a run of places
    levels: int  # 2^levels leaves


def triangle_tree(vertices: Floats, triangles: Integers) -> TriangleTree:
    """The tree of a mesh; it also serves other positions of the vertices, but more slowly.

    vertices [V, 3], triangles [F, 3]. Raises ValueError for no triangles, other shapes, and rows beyond the vertices.
    """
    kept = np.ascontiguousarray(triangles, np.int64)
    places = np.ascontiguousarray(vertices, np.float64)
    if places.ndim != 2 or places.shape[1] != 3 or kept.ndim != 2 or kept.shape[1] != 3 or not len(kept):
        raise ValueError(
            f"vertices {places.shape} and triangles {kept.shape}; [V, 3] and [F, 3] are needed, F > 0"
        )
    if not 0 <= kept.min() <= kept.max() < len(places):
        raise ValueError(f"triangles name vertices beyond the {len(places)} there are")
    levels = max(0, int(np.ceil(np.log2(len(kept) / IN_A_LEAF))))
    order = np.arange(len(kept))
    _split(places[kept].mean(axis=1), levels, order)
    return TriangleTree(kept, order, levels)


def nearest(points: Floats, vertices: Floats, tree: TriangleTree, guess: I64 | None = None) -> Nearest:
    """The nearest point of the mesh to each of `points` [N, 3].

    vertices [V, 3] at their present positions. `guess` [N] names a triangle that may be near, such as the last result:
    it saves time and does not change the result. Raises ValueError for another shape, a guess beyond the triangles, and
    coordinates that are not finite.
    """
    wanted, places = np.ascontiguousarray(points, np.float64), np.ascontiguousarray(vertices, np.float64)
    if wanted.ndim != 2 or wanted.shape[1] != 3 or places.shape[1:] != (3,):
        raise ValueError(f"points {wanted.shape} and vertices {places.shape}; [N, 3] and [V, 3] are needed")
    if tree.triangles.max() >= len(places):
        raise ValueError(f"triangles name vertices beyond the {len(places)} there are")
    if not (np.isfinite(wanted).all() and np.isfinite(places).all()):
        raise ValueError("points and vertices must be finite")
    start = (
        np.broadcast_to(tree.order[:1], len(wanted)) if guess is None else np.asarray(guess, dtype=np.int64)
    )
    if start.shape != (len(wanted),) or (
        len(start) and not 0 <= start.min() <= start.max() < len(tree.triangles)
    ):
        raise ValueError(f"guess does not name one of {len(tree.triangles)} triangles for each point")
    found = Nearest(np.array(start), np.empty((len(wanted), 3)), np.empty(len(wanted)))
    box = np.empty((2 ** (tree.levels + 1) - 1, 6))
    _fit_boxes(places, tree, box)
    _find(wanted, places, tree, box, found)
    return found


def point_to_surface(
    points: Tensor,  # [N, 3]
    vertices: Tensor,  # [V, 3]
    tree: TriangleTree,
    guess: I64 | None = None,
) -> tuple[Tensor, Nearest]:
    """(squared distance [N] of each point to the mesh, where it was found); differentiable in points and vertices.

    The nearest point's barycentric coordinates are held fixed. That gives the exact gradient wherever it exists: at the
    nearest point the distance does not change to first order with them. float32 or float64 on the CPU; the
    gradient of the vertices is summed in the order of the points. Raises ValueError as `nearest` does.
    """
    if points.device.type != "cpu" or points.dtype != vertices.dtype:
        raise ValueError(
            f"points {points.dtype} on {points.device} and vertices {vertices.dtype} do not go together"
        )
    found = nearest(points.detach().numpy(), vertices.detach().numpy(), tree, guess)
    squared: Tensor = _Squared.apply(points, vertices, tree, found)  # type: ignore[no-untyped-call]
    return squared, found


class _Squared(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, points: Tensor, vertices: Tensor, tree: TriangleTree, found: Nearest) -> Tensor:
        ctx.save_for_backward(points, vertices)
        ctx.tree, ctx.found = tree, found
        return torch.from_numpy(found.squared_distance).to(points.dtype)

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor | None, ...]:
        points, vertices = (t.detach().double().numpy() for t in ctx.saved_tensors)
        to_points, to_vertices = np.empty_like(points), np.zeros_like(vertices)
        outer = gradients[0].double().numpy()
        _spread(np.ascontiguousarray(outer), points, vertices, ctx.tree, ctx.found, to_points, to_vertices)
        kind = ctx.saved_tensors[0].dtype
        return torch.from_numpy(to_points).to(kind), torch.from_numpy(to_vertices).to(kind), None, None


@kernel()
def _split(middle: F64, levels: int, order: I64) -> None:
    """Sort `order` so that each node's run is its parent's, halved across the longest side of its middles [F, 3]."""
    count = len(order)
    for level in range(levels):
        for k in range(1 << level):
            first, last = (count * k) >> level, (count * (k + 1)) >> level
            run = order[first:last].copy()
            widest, axis = -1.0, 0
            for i in range(3):
                side = middle[run, i].max() - middle[run, i].min() if len(run) else 0.0
                if side > widest:
                    widest, axis = side, i
            order[first:last] = run[np.argsort(middle[run, axis], kind="mergesort")]


@kernel()
def _fit_boxes(vertices: F64, tree: TriangleTree, box: F64) -> None:
    """`box` [nodes, 6]: least corner, largest corner of all triangles below each node."""
    count, leaves = len(tree.order), 1 << tree.levels
    for k in range(leaves):
        to = box[leaves - 1 + k]
        to[:3], to[3:] = np.inf, -np.inf
        for place in range((count * k) >> tree.levels, (count * (k + 1)) >> tree.levels):
            for corner in tree.triangles[tree.order[place]]:
                for i in range(3):
                    to[i] = min(to[i], vertices[corner, i])
                    to[3 + i] = max(to[3 + i], vertices[corner, i])
    for node in range(leaves - 2, -1, -1):
        left, right = box[2 * node + 1], box[2 * node + 2]
        for i in range(3):
            box[node, i] = min(left[i], right[i])
            box[node, 3 + i] = max(left[3 + i], right[3 + i])


@inlined
def _gap(x: float, y: float, z: float, box: F64, node: int) -> float:
    """Squared distance of a point to a box; infinite to one that holds nothing."""
    dx = max(box[node, 0] - x, x - box[node, 3], 0.0)
    dy = max(box[node, 1] - y, y - box[node, 4], 0.0)
    dz = max(box[node, 2] - z, z - box[node, 5], 0.0)
    squared: float = dx * dx + dy * dy + dz * dz
    return squared


@kernel(parallel=True)
def _find(points: F64, vertices: F64, tree: TriangleTree, box: F64, found: Nearest) -> None:
    for n in numba.prange(len(points)):
        _find_one(n, points, vertices, tree, box, found)


@inlined
def _find_one(n: int, points: F64, vertices: F64, tree: TriangleTree, box: F64, found: Nearest) -> None:
    """The nearest triangle of point n, beginning with the one that stands in `found`."""
    x, y, z = points[n, 0], points[n, 1], points[n, 2]
    count, first_leaf = len(tree.order), (1 << tree.levels) - 1
    best = found.triangle[n]
    least, v, w = _to_triangle(points[n], vertices, tree.triangles[best])
    waiting, gaps = np.empty(DEEPEST, np.int64), np.empty(DEEPEST)
    waiting[0], gaps[0], top = 0, _gap(x, y, z, box, 0), 1
    while top > 0:
        top -= 1
        node = waiting[top]
        # What is as near as the nearest so far is looked at, too: of equals the first row counts.
        if gaps[top] > least:
            continue
        if node < first_leaf:
            left, right = _gap(x, y, z, box, 2 * node + 1), _gap(x, y, z, box, 2 * node + 2)
            near, far = (2 * node + 1, 2 * node + 2) if left <= right else (2 * node + 2, 2 * node + 1)
            waiting[top], gaps[top] = far, max(left, right)
            waiting[top + 1], gaps[top + 1] = near, min(left, right)
            top += 2
            continue
        k = node - first_leaf
        for place in range((count * k) >> tree.levels, (count * (k + 1)) >> tree.levels):
            row = tree.order[place]
            distance, dv, dw = _to_triangle(points[n], vertices, tree.triangles[row])
            if distance < least or (distance == least and row < best):
                least, v, w, best = distance, dv, dw, row
    found.triangle[n], found.squared_distance[n] = best, least
    found.barycentric[n, 0], found.barycentric[n, 1], found.barycentric[n, 2] = max(1 - v - w, 0.0), v, w


@inlined
def _to_triangle(point: F64, vertices: F64, corners: I64) -> tuple[float, float, float]:
    """(squared distance, weight of the second corner, of the third) of the triangle's nearest point.

    The foot of the perpendicular where it falls inside, or the nearest of the edges; both are tried, as the foot is
    badly known in a sliver.
    """
    a, b, c = vertices[corners[0]], vertices[corners[1]], vertices[corners[2]]
    aa, bb, cc, d, e = 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        ab, ac, ap = b[i] - a[i], c[i] - a[i], point[i] - a[i]
        aa, bb, cc = aa + ab * ab, bb + ab * ac, cc + ac * ac
        d, e = d + ab * ap, e + ac * ap
    side = aa - 2 * bb + cc  # squared, of the edge from b to c
    t = min(max(d / aa, 0.0), 1.0) if aa > 0 else 0.0
    best, v, w = _off(point, a, b, c, t, 0.0), t, 0.0
    t = min(max(e / cc, 0.0), 1.0) if cc > 0 else 0.0
    off = _off(point, a, b, c, 0.0, t)
    if off < best:
        best, v, w = off, 0.0, t
    t = min(max((aa - bb - d + e) / side, 0.0), 1.0) if side > 0 else 0.0
    off = _off(point, a, b, c, 1 - t, t)
    if off < best:
        best, v, w = off, 1 - t, t
    area = aa * cc - bb * bb
    if area > 0:
        fv, fw = (cc * d - bb * e) / area, (aa * e - bb * d) / area
        if fv > 0 and fw > 0 and fv + fw < 1:
            off = _off(point, a, b, c, fv, fw)
            if off < best:
                best, v, w = off, fv, fw
    return best, v, w


@inlined
def _off(point: F64, a: F64, b: F64, c: F64, v: float, w: float) -> float:
    """Squared distance of a point to a point of a triangle."""
    total = 0.0
    for i in range(3):
        gap = point[i] - a[i] - v * (b[i] - a[i]) - w * (c[i] - a[i])
        total += gap * gap
    return total


@kernel()
def _spread(
    outer: F64,
    points: F64,
    vertices: F64,
    tree: TriangleTree,
    found: Nearest,
    to_points: F64,
    to_vertices: F64,
) -> None:
    for n in range(len(points)):
        corners, weight = tree.triangles[found.triangle[n]], found.barycentric[n]
        for i in range(3):
            foot = 0.0
            for k in range(3):
                foot += weight[k] * vertices[corners[k], i]
            pull = 2 * outer[n] * (points[n, i] - foot)
            to_points[n, i] = pull
            for k in range(3):
                to_vertices[corners[k], i] -= weight[k] * pull
