"""Comparisons of two versions of a derived file; each returns None, or a phrase that names a difference."""

from __future__ import annotations

import io
import warnings

import numpy as np
from PIL import Image

from avatar_runtime.io.errors import AvatarError

PIXEL_TOLERANCE = 2  # of 255; another libm rounds exponentials differently
MAX_PIXELS = 64 << 20


def same_bytes(old: bytes, new: bytes) -> str | None:
    """None for equal bytes, else the sizes and the first difference."""
    if old == new:
        return None
    count = min(len(old), len(new))
    differs = np.frombuffer(old, np.uint8, count) != np.frombuffer(new, np.uint8, count)
    at = int(np.argmax(differs)) if differs.any() else count
    return f"{len(old)} bytes, expected {len(new)}; the first difference is at byte {at}"


def same_image(old: bytes, new: bytes) -> str | None:
    """None if two PNGs are equal within `PIXEL_TOLERANCE`. Raises AvatarError if `old` is not an image."""
    if old == new:
        return None
    a, b = (_pixels(data) for data in (old, new))
    if a.shape != b.shape:
        return f"{a.shape[1]}x{a.shape[0]} pixels, expected {b.shape[1]}x{b.shape[0]}"
    difference = int(np.abs(a.astype(np.int16) - b).max(initial=0))
    return None if difference <= PIXEL_TOLERANCE else f"pixels differ by up to {difference} of 255"


def _pixels(data: bytes) -> np.ndarray[tuple[int, ...], np.dtype[np.uint8]]:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with Image.open(io.BytesIO(data), formats=("PNG",)) as image:
                if image.width * image.height > MAX_PIXELS:
                    raise AvatarError(f"has {image.width}x{image.height} pixels, which is too large")
                return np.asarray(image.convert("RGB"))
    except (OSError, ValueError, SyntaxError, Warning, Image.DecompressionBombError) as error:
        raise AvatarError(f"is not a PNG that can be read ({type(error).__name__})") from None
