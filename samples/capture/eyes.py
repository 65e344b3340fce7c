"""The eyes of the synthetic head: lids that close evenly, painted irises, the shade that lids cast on the eyeballs."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import prange
from PIL import Image

from avatar_runtime.backends.cpu.jit import inlined, kernel
from avatar_trainer.head import Head, Mesh, smooth_over_mesh
from samples.subjects.colour import iris_colour
from samples.subjects.surface import Samples

Array = npt.NDArray[Any]

EYES = ("left_eye", "right_eye")
PAINTED = 2  # texels of the eyes' painting along a texel of the scan's texture
# What keeps light from an eyeball: skin within REACH of a point, in RAYS directions about its normal.
RAYS, REACH, LIFTED, NEARBY = 28, 0.02, 0.0006, 0.022  # metres
# Share of free directions that counts as full light; factor where none is free; rounds of smoothing, as the eyeballs'
# vertices are 2 mm apart.
OPEN_SKY, DARKEST, ROUNDS = 0.75, 0.5, 3


def painted_eyes(head: Head, image: Array, uv: Array) -> Array:
    """The texture [h, w, 3], PAINTED times as large, with the eyeballs of `samples.subjects.colour` painted on it."""
    height, width = (PAINTED * n for n in image.shape[:2])
    small = Image.fromarray(np.round(image * 255).astype(np.uint8))
    large = np.asarray(small.resize((width, height), Image.Resampling.BICUBIC), np.float32) / 255
    own = np.flatnonzero(head.triangles_in(*EYES))
    face, bary = np.full((height, width), -1), np.zeros((height, width, 3))
    texels(uv[own].astype(np.float64), width, face, bary)
    y, x = np.nonzero(face >= 0)
    f, b = own[face[y, x]], bary[y, x]
    position = np.einsum("nc,ncx->nx", b, head.vertices[head.triangles[f]])
    samples = Samples(f, b, position, np.zeros((len(f), 3, 3)), np.zeros(len(f)))
    large[y, x] = np.clip(iris_colour(head, samples, np.zeros((len(f), 3))), 0, 1)
    return large


@kernel()
def texels(corner: Array, size: int, face: Array, bary: Array) -> None:
    """The triangle under each texel's centre (face [size, size], unchanged for none), and the position in it."""
    for f in range(len(corner)):
        a, b, c = corner[f] * size - 0.5
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area == 0:
            continue
        low = np.minimum(np.minimum(a, b), c)
        high = np.maximum(np.maximum(a, b), c)
        for y in range(max(int(np.ceil(low[1])), 0), min(int(np.floor(high[1])) + 1, size)):
            for x in range(max(int(np.ceil(low[0])), 0), min(int(np.floor(high[0])) + 1, size)):
                v = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
                w = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
                if v >= 0 and w >= 0 and v + w <= 1:
                    face[y, x] = f
                    bary[y, x, 0], bary[y, x, 1], bary[y, x, 2] = 1 - v - w, v, w


def lid_shade(head: Head, posed: Mesh) -> Array:
    """Factor [V] on the light of the eyeballs of a posed head: what its lids leave free; 1 elsewhere."""
    shade = np.ones(len(head.vertices))
    skin = posed.triangles[head.triangles_in("face")]
    middle = posed.vertices[skin].mean(axis=1)
    for side, name in enumerate(EYES):
        rows = np.flatnonzero(head.in_part(name) & (head.vertices[:, 2] > head.eye_centres[side, 2]))
        near = skin[np.linalg.norm(middle - posed.vertices[rows].mean(axis=0), axis=1) < NEARBY]
        normal = posed.vertex_normals[rows]
        free = _free_share(
            posed.vertices[rows] + LIFTED * normal, normal, posed.vertices[near], _directions(RAYS), REACH
        )
        shade[rows] = DARKEST + (1 - DARKEST) * np.minimum(free / OPEN_SKY, 1)
    return smooth_over_mesh(head, shade, ROUNDS)


def _directions(count: int) -> Array:
    """Unit vectors [count, 3] about +z, evenly by the cosine of their angle to it (a spiral on the disk)."""
    k = np.arange(count) + 0.5
    r, angle = np.sqrt(k / count), k * np.pi * (3 - np.sqrt(5))
    return np.stack([r * np.cos(angle), r * np.sin(angle), np.sqrt(1 - r * r)], axis=1)


@kernel(parallel=True)
def _free_share(points: Array, normal: Array, corner: Array, around: Array, reach: float) -> Array:
    """[N] share of the directions `around` +z, turned about `normal`, in which no triangle [F, 3, 3] is in reach."""
    share = np.zeros(len(points))
    for p in prange(len(points)):
        nx, ny, nz = normal[p]
        # Two axes across the normal, which never is -z here (Duff et al. 2017, JCGT 6(1)).
        a = -1.0 / (1.0 + nz)
        b = nx * ny * a
        free = 0
        for i in range(len(around)):
            dx, dy, dz = around[i]
            wx = dx * (1.0 + nx * nx * a) + dy * b + dz * nx
            wy = dx * b + dy * (1.0 + ny * ny * a) + dz * ny
            wz = -dx * nx - dy * ny + dz * nz
            hit = False
            for f in range(len(corner)):
                if _meets(points[p], wx, wy, wz, corner[f], reach):
                    hit = True
                    break
            free += not hit
        share[p] = free / len(around)
    return share


@inlined
def _meets(origin: Array, wx: float, wy: float, wz: float, corner: Array, reach: float) -> bool:
    """Whether the ray along w meets the triangle [3, 3] within reach (Moeller and Trumbore)."""
    ax, ay, az = corner[1, 0] - corner[0, 0], corner[1, 1] - corner[0, 1], corner[1, 2] - corner[0, 2]
    bx, by, bz = corner[2, 0] - corner[0, 0], corner[2, 1] - corner[0, 1], corner[2, 2] - corner[0, 2]
    hx, hy, hz = wy * bz - wz * by, wz * bx - wx * bz, wx * by - wy * bx
    det = ax * hx + ay * hy + az * hz
    if abs(det) < 1e-18:
        return False
    sx, sy, sz = origin[0] - corner[0, 0], origin[1] - corner[0, 1], origin[2] - corner[0, 2]
    u = (sx * hx + sy * hy + sz * hz) / det
    if u < 0 or u > 1:
        return False
    qx, qy, qz = sy * az - sz * ay, sz * ax - sx * az, sx * ay - sy * ax
    v = (wx * qx + wy * qy + wz * qz) / det
    t = (bx * qx + by * qy + bz * qz) / det
    return v >= 0 and u + v <= 1 and 0 < t < reach
