"""The room: lights that stay where they are, and a background that is out of focus."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image, ImageDraw, ImageFilter

from avatar_trainer.head import unit

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Light:
    """Lamps from the camera's side, in the axes of a head that faces the camera."""

    around: float  # what comes from everywhere
    lamps: tuple[tuple[tuple[float, float, float], float, float], ...]  # direction, strength, how soft (0..1)


LIGHTS = {
    "front": Light(0.50, (((0.15, 0.45, 0.9), 0.52, 0.5), ((-0.7, 0.2, 0.5), 0.08, 0.3))),
    "side": Light(0.40, (((0.85, 0.35, 0.45), 0.58, 0.25), ((-0.5, 0.3, 0.8), 0.16, 0.5))),
}


def lit(light: Light, normal: Array, view: Array, strength: Array, exponent: Array) -> tuple[Array, Array]:
    """(factor on the colour [V], what shines [V]) for normals [V, 3]; `view` [V, 3] points to the camera."""
    gain, shine = np.full(len(normal), light.around), np.zeros(len(normal))
    gain += 0.06 * normal[:, 1]  # the ceiling is brighter than the floor
    for direction, power, soft in light.lamps:
        way = unit(np.array(direction))
        gain += power * np.clip((normal @ way + soft) / (1 + soft), 0, 1)
        half = unit(way + view)
        shine += 1.6 * power * strength * np.clip(np.sum(half * normal, axis=1), 0, 1) ** exponent
    return gain, shine


def background(width: int, height: int, seed: int) -> Array:
    """[height, width, 3] 0..1: a wall with a gradient, a window or a lamp, shelves and pictures, all blurred."""
    rng = np.random.default_rng(seed)
    y, x = np.mgrid[0:height, 0:width] / max(width, height)
    wall = rng.uniform(0.35, 0.72) * (1 + rng.uniform(-0.06, 0.06, 3))
    tilt = rng.uniform(-0.35, 0.35, 2)
    shade = 1 + tilt[0] * (x - 0.5) + tilt[1] * (y - 0.5)
    canvas = Image.fromarray(np.uint8(np.clip(wall * shade[..., None], 0, 1) * 255))
    pen = ImageDraw.Draw(canvas)
    for _ in range(int(rng.integers(5, 10))):
        left, top = rng.uniform(-0.2, 1.0) * width, rng.uniform(-0.1, 0.9) * height
        wide, high = rng.uniform(0.06, 0.32) * width, rng.uniform(0.08, 0.45) * height
        tone = np.clip(rng.uniform(0.12, 0.85) * (1 + rng.uniform(-0.3, 0.3, 3)), 0, 1)
        pen.rectangle([left, top, left + wide, top + high], fill=tuple(int(255 * c) for c in tone))
    blurred = canvas.filter(ImageFilter.GaussianBlur(max(width, height) * float(rng.uniform(0.018, 0.035))))
    return np.asarray(blurred, np.float32) / 255
