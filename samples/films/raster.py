"""A rasteriser of its own: it shares nothing with the trainers', and is fast where all lies before the camera."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from numba import prange

from avatar_runtime.backends.cpu.jit import inlined, kernel

Array = npt.NDArray[Any]


@kernel(parallel=True)
def exposed(
    vertices: Array,  # [V, 3] in the middle of the exposure
    speed: Array,  # [V, 3] how far they move while it lasts
    turn: Array,  # [3, 3] and
    shift: Array,  # [3]: a point x is at turn x + shift before the camera, z forward
    triangles: Array,  # [F, 3]
    uv: Array,  # f32 [F, 3, 2]
    texture: Array,  # f32 [h, w, 3]
    gain: Array,  # [V] factor on the texture's colour
    gloss: Array,  # [V] added to it
    focal: float,
    parts: Array,  # [P, 3] time in the exposure from its middle; pixels of the optical axis
    image: Array,  # [P, H, W, 4] zeros; changed: colour and 1 where a triangle is seen
) -> None:
    """Draw each part: one ray through the middle of each pixel, the nearest triangle, both sides seen."""
    for part in prange(len(parts)):
        height, width = image.shape[1:3]
        time, middle_x, middle_y = parts[part, 0], parts[part, 1], parts[part, 2]
        flat = np.empty((len(vertices), 3))
        for v in range(len(flat)):
            x, y, z = (
                vertices[v, 0] + time * speed[v, 0],
                vertices[v, 1] + time * speed[v, 1],
                vertices[v, 2] + time * speed[v, 2],
            )
            depth = turn[2, 0] * x + turn[2, 1] * y + turn[2, 2] * z + shift[2]
            flat[v, 0] = (
                focal * (turn[0, 0] * x + turn[0, 1] * y + turn[0, 2] * z + shift[0]) / depth + middle_x
            )
            flat[v, 1] = (
                focal * (turn[1, 0] * x + turn[1, 1] * y + turn[1, 2] * z + shift[1]) / depth + middle_y
            )
            flat[v, 2] = 1 / depth
        near, face = np.zeros((height, width)), np.full((height, width), -1, np.int32)
        for f in range(len(triangles)):
            a, b, c = triangles[f, 0], triangles[f, 1], triangles[f, 2]
            _cover(
                f, flat[a, 0], flat[a, 1], flat[a, 2], flat[b, 0], flat[b, 1], flat[b, 2],
                flat[c, 0], flat[c, 1], flat[c, 2], near, face,
            )  # fmt: skip
        for y in range(height):
            for x in range(width):
                f = face[y, x]
                if f >= 0:
                    _shade(
                        x + 0.5,
                        y + 0.5,
                        f,
                        flat,
                        triangles[f],
                        uv[f],
                        texture,
                        gain,
                        gloss,
                        image[part, y, x],
                    )


@inlined
def _cover(
    f: int, ax: float, ay: float, az: float, bx: float, by: float, bz: float, cx: float, cy: float, cz: float,
    near: Array, face: Array,
) -> None:  # fmt: skip
    """Enter triangle `f` where it is the nearest: its 1/z the largest."""
    height, width = near.shape
    left = max(int(np.ceil(min(ax, bx, cx) - 0.5)), 0)
    right = min(int(np.floor(max(ax, bx, cx) - 0.5)), width - 1)
    top = max(int(np.ceil(min(ay, by, cy) - 0.5)), 0)
    bottom = min(int(np.floor(max(ay, by, cy) - 0.5)), height - 1)
    area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    if left > right or top > bottom or area == 0:
        return
    for y in range(top, bottom + 1):
        for x in range(left, right + 1):
            p, q = x + 0.5, y + 0.5
            v = ((p - ax) * (cy - ay) - (q - ay) * (cx - ax)) / area
            w = ((bx - ax) * (q - ay) - (by - ay) * (p - ax)) / area
            u = 1 - v - w
            if u >= 0 and v >= 0 and w >= 0:
                depth = u * az + v * bz + w * cz
                if depth > near[y, x]:
                    near[y, x], face[y, x] = depth, f


@inlined
def _shade(
    p: float,
    q: float,
    f: int,
    flat: Array,
    corner: Array,
    uv: Array,
    texture: Array,
    gain: Array,
    gloss: Array,
    pixel: Array,
) -> None:
    """The colour of a triangle at a pixel; places in it are correct in perspective."""
    a, b, c = flat[corner[0]], flat[corner[1]], flat[corner[2]]
    area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
    v = ((p - a[0]) * (c[1] - a[1]) - (q - a[1]) * (c[0] - a[0])) / area
    w = ((b[0] - a[0]) * (q - a[1]) - (b[1] - a[1]) * (p - a[0])) / area
    i, j, k = (1 - v - w) * a[2], v * b[2], w * c[2]
    total = i + j + k
    i, j, k = i / total, j / total, k / total
    h, wide = texture.shape[:2]
    tx = min(max((i * uv[0, 0] + j * uv[1, 0] + k * uv[2, 0]) * wide - 0.5, 0.0), wide - 1.0)
    ty = min(max((i * uv[0, 1] + j * uv[1, 1] + k * uv[2, 1]) * h - 0.5, 0.0), h - 1.0)
    left, top = int(tx), int(ty)
    right, bottom = min(left + 1, wide - 1), min(top + 1, h - 1)
    sx, sy = tx - left, ty - top
    light = i * gain[corner[0]] + j * gain[corner[1]] + k * gain[corner[2]]
    shine = i * gloss[corner[0]] + j * gloss[corner[1]] + k * gloss[corner[2]]
    for n in range(3):
        above = texture[top, left, n] * (1 - sx) + texture[top, right, n] * sx
        below = texture[bottom, left, n] * (1 - sx) + texture[bottom, right, n] * sx
        pixel[n] = min(max((above * (1 - sy) + below * sy) * light + shine, 0.0), 1.0)
    pixel[3] = 1.0
