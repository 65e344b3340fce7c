"""Skins at random for the head's texture: tones, brows, lips, stubble, hair and irises that no scan has."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
from samples.capture.extras import HAIRLINE
from samples.capture.eyes import texels
from samples.capture.model import Model

from avatar_trainer.head import smoothstep

Array = npt.NDArray[Any]

DETAIL = 14.0  # texels of blur between a skin's tone and its detail
BROW, BROW_HALF = (
    (0.034, 0.048),
    (0.030, 0.013),
)  # metres: middle (x of the left one, y) and half size of its box
STUBBLE = (-0.018, -0.095)  # heights between which stubble grows
LIPS, LIPS_HALF = (0.0, -0.042), (0.030, 0.017)
TONES = np.array([[0.93, 0.78, 0.70], [0.82, 0.64, 0.53], [0.66, 0.47, 0.36], [0.42, 0.28, 0.21]])
HAIR = np.array([[0.08, 0.07, 0.07], [0.22, 0.14, 0.09], [0.45, 0.32, 0.20], [0.62, 0.60, 0.58]])


@dataclass(frozen=True)
class Regions:
    """The scan's texture [h, w, 3] in parts; masks [h, w] of 0..1."""

    tone: Array  # [h, w, 3] blurred
    detail: Array  # [h, w, 3] the rest
    skin: Array
    brows: Array
    stubble: Array
    lips: Array
    hair: Array
    eyes: Array


def regions(model: Model) -> Regions:
    """The parts of the texture of the scan's own head."""
    image, uv = model.texture
    size, head = len(image), model.head
    face, bary = np.full(image.shape[:2], -1), np.zeros(image.shape)
    texels(uv.astype(np.float64), size, face, bary)
    place = np.einsum("hwc,hwcx->hwx", bary, head.vertices[head.triangles[face]])
    skin = (face >= 0) & head.triangles_in("face", "head")[face]
    eyes = (face >= 0) & head.triangles_in("left_eye", "right_eye")[face]
    tone = _spread(image, skin, 2 * DETAIL)
    detail = image - tone
    x, y, z = np.moveaxis(place, -1, 0)
    line = np.interp(z, *np.array(HAIRLINE).T)
    front = z > 0.04
    box = _box(np.abs(x) - BROW[0], y - BROW[1], BROW_HALF) * front
    dark = np.clip(-detail.mean(axis=2) / 0.15, 0, 1)
    red = np.clip((image[..., 0] - image[..., 1] - 0.26) / 0.1, 0, 1)
    lips = _box(x - LIPS[0], y - LIPS[1], LIPS_HALF) * front * cv2.GaussianBlur(red, (0, 0), 3)
    stubble = smoothstep(y, *STUBBLE) * (z > 0.0) * (1 - np.clip(lips * 2, 0, 1))
    return Regions(
        tone,
        detail,
        skin.astype(np.float32),
        cv2.GaussianBlur((box * dark).astype(np.float32), (0, 0), 1.5),
        (stubble * skin).astype(np.float32),
        lips.astype(np.float32),
        (smoothstep(y - line, -0.004, 0.004) * skin).astype(np.float32),
        eyes.astype(np.float32),
    )


def _box(x: Array, y: Array, half: tuple[float, float]) -> Array:
    """1 inside a box about the origin, soft at its edge."""
    result: Array = smoothstep(np.maximum(np.abs(x) / half[0], np.abs(y) / half[1]), 1.0, 0.8)
    return result


def _spread(image: Array, mask: Array, blur: float) -> Array:
    """`image` blurred inside `mask` alone; itself elsewhere."""
    weight = cv2.GaussianBlur(mask.astype(np.float32), (0, 0), blur)
    mean = cv2.GaussianBlur(image * mask[..., None], (0, 0), blur) / np.maximum(weight, 1e-3)[..., None]
    return np.where(mask[..., None], mean, image).astype(np.float32)


def skin(parts: Regions, rng: np.random.Generator, plain: bool) -> Array:
    """A texture [h, w, 3]; `plain`: nothing of the scan's but its layout."""
    size = parts.skin.shape
    tone = np.average(TONES, axis=0, weights=rng.dirichlet(np.full(len(TONES), 0.7)))
    own = parts.tone / np.maximum((parts.tone * parts.skin[..., None]).sum((0, 1)) / parts.skin.sum(), 0.1)
    spots = (rng.normal(size=(24, 24, 1)) + 0.4 * rng.normal(size=(24, 24, 3))) * (0.05 if plain else 0.03)
    spots = cv2.resize(spots.astype(np.float32), size, interpolation=cv2.INTER_CUBIC)
    noise = cv2.GaussianBlur(rng.normal(size=size).astype(np.float32), (0, 0), 1.5) * rng.uniform(0, 0.12)
    base = tone * (1 + spots + noise[..., None]) * (1 if plain else own ** rng.uniform(0.3, 1.2))
    fine = 1 - np.clip(parts.brows * 1.5, 0, 1)[..., None]
    base = base + parts.detail * fine * (0.35 if plain else rng.uniform(0.5, 1.3)) * (0.4 + tone.mean())
    hair = np.average(HAIR, axis=0, weights=rng.dirichlet(np.full(len(HAIR), 0.5)))
    base = _mixed(base, parts.stubble * max(rng.uniform(-1, 0.7), 0), hair + 0.3 * tone)
    lips = tone * rng.uniform((0.75, 0.45, 0.45), (1.05, 0.8, 0.85))
    base = _mixed(base, np.clip(parts.lips * rng.uniform(0.3, 1.1), 0, 1), lips + parts.detail * 0.5)
    base = _mixed(base, _brows(parts, rng), hair * rng.uniform(0.6, 1.6))
    if rng.random() < 0.6:
        strands = cv2.GaussianBlur(rng.normal(size=size).astype(np.float32), (0, 0), 1.2)[..., None] * 0.25
        base = _mixed(base, parts.hair, hair * (1 + strands))
    iris = parts.tone * rng.uniform(0.75, 1.05) * rng.uniform((0.6, 0.75, 0.7), (1.4, 1.1, 1.15))
    white = smoothstep(parts.tone[..., 0] - parts.tone[..., 2], -0.02, 0.03)[..., None]
    eyes = white * parts.tone * rng.uniform(0.85, 1.0) + (1 - white) * iris
    image = np.where(parts.skin[..., None] > 0, base, np.where(parts.eyes[..., None] > 0, eyes, parts.tone))
    return np.clip(image, 0, 1).astype(np.float32)


def _mixed(base: Array, share: Array, colour: Array) -> Array:
    share = np.clip(share, 0, 1)[..., None]
    return np.asarray(base * (1 - share) + colour * share)


def _brows(parts: Regions, rng: np.random.Generator) -> Array:
    """The scan's brows, moved, thicker or thinner, denser or lighter."""
    size = len(parts.brows)
    thick = int(rng.integers(0, 4)) * size // 1024
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * thick + 1, 2 * thick + 1))
    share = cv2.dilate(parts.brows, kernel) if rng.random() < 0.7 else parts.brows
    rise = rng.normal() * 6e-3 * size
    move = np.array([[1, 0, 0], [0, 1, rise]], np.float32)
    return np.asarray(cv2.warpAffine(share, move, (size, size)) * rng.uniform(0.3, 1.2))
