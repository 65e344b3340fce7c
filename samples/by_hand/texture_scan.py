"""The head scan brought onto the registered head, and its colour at the points nearest to given ones."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import njit, prange
from PIL import Image

from avatar_runtime.codec.glb import accessor, decode
from samples.subjects.head import unit

Array = npt.NDArray[Any]

# The scan has its own frame and unit: x_head = scale * R x_scan + shift, cm, by point-to-plane fits.
ROUNDS, TRUSTED = 40, 0.75
FAR_LIMIT_CM = 0.7  # a farther scan is not used


@dataclass(frozen=True)
class Scan:
    """The scan in the head's frame, centimetres."""

    vertices: Array  # f64 [V, 3]
    normals: Array  # f64 [V, 3]
    triangles: Array  # i64 [F, 3]
    uv: Array  # f64 [V, 2], v down
    image: Array  # f64 [h, w, 3] display sRGB, 0..1


def load_scan(source: Path, goal: Array) -> Scan:
    """The scan of `source`, brought onto the registered vertices `goal` [V, 3], centimetres."""
    glb = decode((source / "lee_perry_smith.glb").read_bytes())
    primitive = glb.entry("meshes", 0)["primitives"][0]
    vertices, normals, uv = (
        accessor(glb, primitive["attributes"][name]).astype(np.float64)
        for name in ("POSITION", "NORMAL", "TEXCOORD_0")
    )
    triangles = accessor(glb, primitive["indices"]).reshape(-1, 3).astype(np.int64)
    image = np.asarray(Image.open(source / "lee_perry_smith_color.jpg").convert("RGB"), np.float64) / 255
    linear, shift = fitted(vertices, unit(normals), goal)
    uv = np.c_[uv[:, 0], 1 - uv[:, 1]]  # in the file v points up, unlike in glTF
    return Scan(vertices @ linear.T + shift, unit(normals @ linear.T), triangles, uv, image)


def fitted(vertices: Array, normals: Array, goal: Array) -> tuple[Array, Array]:
    """(linear [3, 3], shift [3]): the similarity that brings the scan nearest to `goal` along its normals."""
    linear = 5.0 * np.eye(3)
    shift = goal[goal[:, 2].argmax()] - linear @ vertices[vertices[:, 2].argmax()]
    goal = goal[::3]
    for _ in range(ROUNDS):
        placed, facing = vertices @ linear.T + shift, unit(normals @ linear.T)
        near = nearest_rows(goal, placed)
        a, n = placed[near], facing[near]
        off = np.sum((goal - a) * n, axis=1)
        kept = np.abs(off) <= np.quantile(np.abs(off), TRUSTED)
        system = np.c_[np.cross(a, n), n, np.sum(a * n, axis=1)][kept]
        w, step, grow = np.split(np.linalg.lstsq(system, off[kept], rcond=None)[0], (3, 6))
        turn = np.eye(3) + np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
        u, _, vt = np.linalg.svd(turn)
        linear, shift = (1 + grow) * (u @ vt) @ linear, (1 + grow) * (u @ vt) @ shift + step
    return linear, shift


def nearest_rows(points: Array, among: Array) -> Array:
    """Row of `among` nearest to each point."""
    square = np.sum(among**2, axis=1)
    parts = [
        np.argmin(square - 2 * p @ among.T, axis=1) for p in np.array_split(points, 1 + len(points) // 512)
    ]
    return np.concatenate(parts)


@njit(parallel=True, cache=True)
def nearest_points(
    points: Array,
    facing: Array,
    corner: Array,
    normal: Array,
    limit: float,
    triangle: Array,
    bary: Array,
    far: Array,
) -> None:
    """The nearest point of triangles [F, 3, 3] whose normal is not turned away from `facing`, within `limit`.

    Out: triangle [N] (-1 for none), bary [N, 3], far [N].
    """
    low, high = np.empty((len(corner), 3)), np.empty((len(corner), 3))
    for f in range(len(corner)):
        for i in range(3):
            low[f, i] = min(corner[f, 0, i], corner[f, 1, i], corner[f, 2, i])
            high[f, i] = max(corner[f, 0, i], corner[f, 1, i], corner[f, 2, i])
    for n in prange(len(points)):
        best = limit * limit
        triangle[n] = -1
        p = points[n]
        for f in range(len(corner)):
            gap = 0.0
            for i in range(3):
                g = max(low[f, i] - p[i], p[i] - high[f, i], 0.0)
                gap += g * g
            if gap >= best or np.sum(normal[f] * facing[n]) < 0:
                continue
            v, w = closest(p, corner[f, 0], corner[f, 1], corner[f, 2])
            q = corner[f, 0] * (1 - v - w) + corner[f, 1] * v + corner[f, 2] * w - p
            d = np.sum(q * q)
            if d < best:
                best = d
                triangle[n] = f
                bary[n, 0], bary[n, 1], bary[n, 2] = 1 - v - w, v, w
        far[n] = np.sqrt(best)


@njit(cache=True)
def closest(p: Array, a: Array, b: Array, c: Array) -> tuple[float, float]:
    """Weights of b and c at the point of a triangle nearest to p: in its plane, or on the nearest edge."""
    ab, ac, ap = b - a, c - a, p - a
    aa, bb, cc = np.sum(ab * ab), np.sum(ab * ac), np.sum(ac * ac)
    d, e = np.sum(ab * ap), np.sum(ac * ap)
    det = aa * cc - bb * bb
    if det > 0:
        v, w = (cc * d - bb * e) / det, (aa * e - bb * d) / det
        if v >= 0 and w >= 0 and v + w <= 1:
            return v, w
    best, at = np.inf, (0.0, 0.0)
    bc = c - b
    t = min(max(d / aa, 0.0), 1.0) if aa > 0 else 0.0
    for k in range(3):
        if k == 0:
            v, w = t, 0.0
        elif k == 1:
            s = min(max(e / cc, 0.0), 1.0) if cc > 0 else 0.0
            v, w = 0.0, s
        else:
            length = np.sum(bc * bc)
            s = min(max(np.sum((p - b) * bc) / length, 0.0), 1.0) if length > 0 else 0.0
            v, w = 1 - s, s
        r = ap - v * ab - w * ac
        far = np.sum(r * r)
        if far < best:
            best, at = far, (v, w)
    return at


def bilinear(image: Array, uv: Array) -> Array:
    """Colours [N, 3] of an image at uv [N, 2], 0..1, v down."""
    h, w = image.shape[:2]
    place = np.clip(uv * (w, h) - 0.5, 0, (w - 1.001, h - 1.001))
    low = place.astype(np.int64)
    sx, sy = (place - low).T[:, :, None]
    x, y = low.T
    top = image[y, x] * (1 - sx) + image[y, x + 1] * sx
    bottom = image[y + 1, x] * (1 - sx) + image[y + 1, x + 1] * sx
    result: Array = top * (1 - sy) + bottom * sy
    return result


def scan_colour(scan: Scan, points: Array, facing: Array) -> tuple[Array, Array]:
    """Colours [N, 3] of the scan's points nearest to `points` [N, 3], cm, and how far they are [N], cm."""
    corner = scan.vertices[scan.triangles]
    normal = unit(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    triangle, bary = np.empty(len(points), np.int64), np.zeros((len(points), 3))
    far = np.empty(len(points))
    nearest_points(points, facing, corner, normal, FAR_LIMIT_CM, triangle, bary, far)
    uv = np.einsum("nc,ncx->nx", bary, scan.uv[scan.triangles[triangle]])
    far[triangle < 0] = np.inf
    return bilinear(scan.image, uv), far
