"""Blending of screen-space Gaussians as nested loops over pixels and splats; Python floats (float64).

Two rules: `engine` draws a splat wherever its alpha reaches 1/255; `trainer` draws it inside the 16-pixel
tiles that the square of its radius touches, and ends a pixel before its transmittance falls below 1e-4.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Splat:
    x: float
    y: float
    depth: float
    a: float  # conic xx, xy, yy
    b: float
    c: float
    opacity: float
    rgb: tuple[float, float, float]
    radius: int


def image(splats: list[Splat], width: int, height: int, background: Array, rule: str) -> tuple[Array, Array]:
    """(colour [H, W, 3], transmittance [H, W])."""
    near_first = sorted(range(len(splats)), key=lambda i: (splats[i].depth, i))
    colour, left = np.zeros((height, width, 3)), np.zeros((height, width))
    for row in range(height):
        for column in range(width):
            sum_, t = [0.0, 0.0, 0.0], 1.0
            for i in near_first:
                s = splats[i]
                if s.radius == 0 or (rule == "trainer" and not in_tiles(s, column, row)):
                    continue
                dx, dy = s.x - column, s.y - row
                exponent = -0.5 * (s.a * dx * dx + 2 * s.b * dx * dy + s.c * dy * dy)
                if exponent > 0:
                    continue
                alpha = min(0.99, s.opacity * math.exp(exponent))
                if alpha < 1 / 255:
                    continue
                if rule == "trainer" and t * (1 - alpha) < 1e-4:
                    break
                for k in range(3):
                    sum_[k] += t * alpha * s.rgb[k]
                t *= 1 - alpha
            colour[row, column] = sum_ + t * np.asarray(background, np.float64)
            left[row, column] = t
    return colour, left


def in_tiles(s: Splat, column: int, row: int) -> bool:
    """Whether the pixel lies in the tiles of the splat's square, as truncated divisions give them."""
    for centre, pixel in ((s.x, column), (s.y, row)):
        low = math.trunc((centre - s.radius) / 16)
        high = math.trunc((centre + s.radius + 15) / 16)
        if not low <= pixel // 16 < high:
            return False
    return True


def tile_members(rects: Array, order: Array, columns: int, rows: int) -> list[list[int]]:
    """Ids in each tile's list, tiles row by row; rects [N, 4] are x0, y0, x1, y1 with ends excluded."""
    return [
        [int(i) for i in order if rects[i][0] <= x < rects[i][2] and rects[i][1] <= y < rects[i][3]]
        for y in range(rows)
        for x in range(columns)
    ]
