"""Band-passed, locally normalised pictures, so that light and colour hardly count, and looking pixels up in them."""

from __future__ import annotations

import cv2
import numpy as np
import numpy.typing as npt

from avatar_runtime import F32, F64

FLAT = 3.0  # grey levels (of 255) of contrast that count as none


def bands(grey: npt.NDArray[np.uint8], fine: float, wide: float) -> F32:
    """[3, H, W] of a grey picture [H, W]: details between two blurs (deviations in pixels) over their local strength,
    and the derivatives of that by x and y."""
    small = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), fine, borderType=cv2.BORDER_REPLICATE)
    detail = small - cv2.GaussianBlur(small, (0, 0), wide, borderType=cv2.BORDER_REPLICATE)
    strength = cv2.GaussianBlur(detail * detail, (0, 0), wide, borderType=cv2.BORDER_REPLICATE)
    detail /= np.sqrt(strength + FLAT**2)
    result = np.zeros((3, *grey.shape), np.float32)
    result[0] = detail
    result[1, :, 1:-1] = (detail[:, 2:] - detail[:, :-2]) / 2
    result[2, 1:-1] = (detail[2:] - detail[:-2]) / 2
    return result


def looked_up(image: F32, places: F64) -> F32:
    """[C, P] bilinear, of an image [C, H, W] at places [P, 2] in pixels, centres at half integers."""
    height, width = image.shape[1:]
    x = np.clip(places[:, 0] - 0.5, 0, width - 1.001).astype(np.float32)
    y = np.clip(places[:, 1] - 0.5, 0, height - 1.001).astype(np.float32)
    left, top = x.astype(np.int64), y.astype(np.int64)
    u, v = x - left, y - top
    at = top * width + left
    flat = image.reshape(len(image), -1)
    above = flat[:, at] * (1 - u) + flat[:, at + 1] * u
    below = flat[:, at + width] * (1 - u) + flat[:, at + width + 1] * u
    found: F32 = above * (1 - v) + below * v
    return found
