"""The background of a film whose camera stands still, and what it gives to the edge of the person: the network's mask
is coarse there, and the wall's colour is mixed into hair and skin.

A pixel of the edge is I = a F + (1 - a) B (Porter and Duff 1984): B is known wherever the person once stood elsewhere,
F is nearly that of the person beside it; so a follows, and then what was mixed in is taken out.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import numpy.typing as npt

from avatar_runtime import F32

FRAMES = 24  # of which the background is the median
FAR, CLEAR = 7, 8  # pixels from the person, and grey levels of a mask, where a frame shows background
FEWEST = 3  # frames that show it
STEADY = 16  # grey levels between the quarters of these frames: more, and the camera or the light moved
REACH, ENOUGH = 1 / 20, 0.02  # of the image's width: how far around it is guessed from what is known
NEAR = 1 / 64  # of the image's width: the person beside an edge
RIM = 1 / 16  # of the width: how far from the background an edge may be; a hole in an open mouth is none
SURE = 0.98  # of the mask: the person alone
LIKELY = 0.3  # share of the background: from there on the network doubts enough for the colours to decide
TELLS = 25.0  # grey levels, root of the summed squares: person and background differ enough
THIN, FULL = 0.2, 0.7  # share of the person: below, a pixel's own colour says nothing; above, all
BANDS = 16  # of the image, of which one at a time is sorted

U8 = npt.NDArray[np.uint8]


@dataclass(frozen=True)
class Plate:
    """The background of all frames."""

    colour: F32  # [H, W, 3] grey levels
    known: npt.NDArray[np.bool_]  # [H, W]

    @staticmethod
    def of(images: list[U8], masks: list[U8]) -> Plate:
        """Of some frames [H, W, 3] spread over the film and their masks [H, W]."""
        window = np.ones((FAR, FAR), np.uint8)
        clear = np.stack([cv2.erode((mask < CLEAR).astype(np.uint8), window) > 0 for mask in masks])
        counts, bands = clear.sum(axis=0), []
        for rows in np.array_split(np.arange(counts.shape[0]), BANDS):
            shown = np.where(clear[:, rows, :, None], np.stack([one[rows] for one in images]), np.inf)
            last = np.maximum(counts[rows] - 1, 0)
            places = np.stack([last // 4, last // 2, last * 3 // 4])[..., None]
            bands.append(np.take_along_axis(np.sort(shown, axis=0), places, axis=0))
        low, middle, high = np.concatenate(bands, axis=1)
        seen = counts >= FEWEST
        seen &= (np.where(seen[..., None], high, 0) - np.where(seen[..., None], low, 0)).max(axis=2) < STEADY
        colour = np.where(seen[..., None], middle, 0).astype(np.float32)
        around, amount = _beside(colour, seen.astype(np.float32), REACH)
        return Plate(np.where(seen[..., None], colour, around), seen | (amount > ENOUGH))

    def mended(self, image: U8, mask: U8) -> tuple[U8, U8]:
        """(image [H, W, 3], mask [H, W]) with the background taken out of the edge; unchanged where it is not known."""
        pixels, share = image.astype(np.float32), mask.astype(np.float32) / 255
        window = np.ones((3, 3), np.uint8)
        sure = (cv2.erode(share, window) > SURE).astype(np.float32)
        front, near = _beside(pixels, sure, NEAR)
        contrast = front - self.colour
        square = np.maximum((contrast**2).sum(axis=2), 1)
        seen = np.clip(((pixels - self.colour) * contrast).sum(axis=2) / square, 0, 1)
        near_wall = np.ones((2 * round(RIM * image.shape[1]) + 1,) * 2, np.uint8)
        outer = cv2.dilate((mask < CLEAR).astype(np.uint8), near_wall) > 0
        edge = outer & self.known & (sure == 0) & (cv2.dilate(share, window) > 1 - SURE) & (near > 1e-4)
        trust = np.where(
            edge, np.clip(square / TELLS**2 - 0.5, 0, 1) * np.clip((1 - share) / LIKELY, 0, 1), 0
        )
        # The network and the colours each err elsewhere.
        alpha = share + trust * (seen - share) / 2
        taken = self.colour + (pixels - self.colour) / np.maximum(alpha, THIN)[..., None]
        own = np.clip((alpha - THIN) / (FULL - THIN), 0, 1)[..., None]
        clean = np.where(edge[..., None], own * taken + (1 - own) * front, pixels)
        return np.rint(np.clip(clean, 0, 255)).astype(np.uint8), np.rint(alpha * 255).astype(np.uint8)


def _beside(pixels: F32, weight: F32, reach: float) -> tuple[F32, F32]:
    """(the mean colour [H, W, 3] around each pixel of those with a weight, how much of that there is [H, W]).

    `reach`: of the width, the deviation of a Gaussian; on half as many pixels a side, as it is smooth.
    """
    size = weight.shape[::-1]
    both = np.dstack([pixels * weight[..., None], weight])
    half = cv2.resize(both, (size[0] // 2, size[1] // 2), interpolation=cv2.INTER_AREA)
    blurred = np.asarray(cv2.resize(cv2.GaussianBlur(half, (0, 0), reach * size[0] / 2), size))
    amount = blurred[..., 3].astype(np.float32)
    return (blurred[..., :3] / np.maximum(amount, 1e-6)[..., None]).astype(np.float32), amount
