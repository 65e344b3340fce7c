"""The background that a still camera filmed is taken out of the person's edge."""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
import numpy.typing as npt
import pytest

from avatar_trainer.film.plate import FRAMES, Plate

Pictures = list[npt.NDArray[Any]]

SIZE, WALL, HAIR = 128, (200.0, 190.0, 170.0), (30.0, 20.0, 10.0)


def filmed(light: float = 0.0) -> tuple[Pictures, Pictures, Pictures]:
    """(images, masks, true shares): dark hair before a bright wall with a stripe, moved from frame to frame.

    The masks are wider than the hair by half a pixel, and too soft; `light`: grey levels that the wall changes by.
    """
    noise, y, x = np.random.default_rng(0), *np.mgrid[:SIZE, :SIZE] + 0.5
    images, masks, shares = [], [], []
    for k in range(FRAMES):
        away = 22 - np.hypot(x - 64 - 30 * np.sin(k), y - 70)
        wall = np.where(x < 40, 0.6, 1.0)[..., None] * WALL + light * noise.uniform(-1, 1)
        share = np.clip(away / 4 + 0.5, 0, 1)
        mixed = share[..., None] * HAIR + (1 - share[..., None]) * wall + noise.normal(0, 1, wall.shape)
        images.append(np.rint(np.clip(mixed, 0, 255)).astype(np.uint8))
        masks.append(np.rint(np.clip((away + 1) / 8 + 0.5, 0, 1) * 255).astype(np.uint8))
        shares.append(share)
    return images, masks, shares


def faults(images: Pictures, masks: Pictures, shares: Pictures) -> tuple[float, float]:
    """Root mean square of what is wrong in the edges before black (grey levels), and of the shares."""
    seen, share = np.stack(masks) / 255, np.stack(shares)
    window = np.ones((9, 9), np.uint8)
    inner = np.stack([cv2.erode((one > 0.5).astype(np.uint8), window) for one in shares])
    edge = (inner == 0) & np.stack([cv2.dilate((one > 0.5).astype(np.uint8), window) > 0 for one in shares])
    wrong = np.stack(images) * seen[..., None] - share[..., None] * HAIR
    return float(np.sqrt(np.square(wrong[edge]).mean())), float(np.sqrt(np.square(seen - share)[edge].mean()))


def test_the_wall_is_taken_out_of_the_edge() -> None:
    images, masks, shares = filmed()
    plate = Plate.of(images, masks)
    for x, light in ((100, 1.0), (8, 0.6)):
        assert np.abs(plate.colour[8, x] - np.multiply(WALL, light)).max() < 2
    mended = [plate.mended(image, mask) for image, mask in zip(images, masks, strict=True)]
    cleaned = [image for image, _ in mended], [mask for _, mask in mended]
    before, after = faults(images, masks, shares), faults(*cleaned, shares)
    assert after[0] < 0.4 * before[0] and after[1] < 0.7 * before[1]
    inner = np.stack([cv2.erode(one, np.ones((3, 3), np.uint8)) for one in masks]) == 255
    for mine, other in zip(cleaned, (images, masks), strict=True):
        assert (np.stack(mine)[inner] == np.stack(other)[inner]).all()


@pytest.mark.parametrize(("light", "frames"), [(60, FRAMES), (0, 2)], ids=["light moves", "too few frames"])
def test_a_background_that_is_not_known_is_left_alone(light: float, frames: int) -> None:
    images, masks, _ = (part[:frames] for part in filmed(light))
    plate = Plate.of(images, masks)
    assert not plate.known.any()
    image, mask = plate.mended(images[0], masks[0])
    assert (image == images[0]).all() and (mask == masks[0]).all()
