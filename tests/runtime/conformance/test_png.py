"""PNG of reference images, crossed with Pillow."""

from __future__ import annotations

import io
import zlib
from itertools import pairwise

import numpy as np
import pytest
from PIL import Image

from avatar_runtime.conformance import png
from avatar_runtime.io.errors import AvatarError

SHAPES = [(5, 7), (5, 7, 3), (1, 1), (1, 1, 3), (40, 33, 3)]


def pixels(shape: tuple[int, ...]) -> np.ndarray:
    """Smooth in x, in y, and noise: rows that take every filter."""
    rng = np.random.default_rng(sum(shape))
    y, x = np.mgrid[: shape[0], : shape[1]]
    smooth = (7 * x + 3 * y * (x > 2) + rng.integers(0, 256, x.shape) * (y % 3 == 0)).astype(np.uint8)
    return smooth if len(shape) == 2 else np.stack([smooth, smooth * 3, 255 - smooth], axis=-1)


@pytest.mark.parametrize("shape", SHAPES)
def test_pillow_reads_what_is_written(shape: tuple[int, ...]) -> None:
    want = pixels(shape)
    with Image.open(io.BytesIO(png.encode(want))) as image:
        assert image.mode == ("L" if len(shape) == 2 else "RGB")
        np.testing.assert_array_equal(np.asarray(image), want)


def with_filters(want: np.ndarray) -> bytes:
    """A PNG whose rows take the five filters in turn, by the standard's own words and byte by byte."""
    channels = want.shape[2] if want.ndim == 3 else 1
    rows = [bytes(channels * want.shape[1]), *(row.tobytes() for row in want)]
    body = bytearray()
    for y, (above, row) in enumerate(pairwise(rows)):
        body.append(y % 5)
        for x, byte in enumerate(row):
            a, c = (row[x - channels], above[x - channels]) if x >= channels else (0, 0)
            b = above[x]
            nearest = min((abs(b - c), 0, a), (abs(a - c), 1, b), (abs(a + b - 2 * c), 2, c))[2]
            body.append((byte - (0, a, b, (a + b) // 2, nearest)[y % 5]) % 256)
    return png.encode(want)[:33] + chunk(b"IDAT", zlib.compress(bytes(body))) + chunk(b"IEND", b"")


@pytest.mark.parametrize("shape", [(15, 7), (15, 7, 3)])
def test_every_filter_is_read(shape: tuple[int, ...]) -> None:
    want = np.random.default_rng(1).integers(0, 256, shape).astype(np.uint8)
    data = with_filters(want)
    with Image.open(io.BytesIO(data)) as image:
        np.testing.assert_array_equal(np.asarray(image), want)
    np.testing.assert_array_equal(png.decode(data, shape, "x.png"), want)


def chunk(kind: bytes, body: bytes) -> bytes:
    return len(body).to_bytes(4, "big") + kind + body + zlib.crc32(kind + body).to_bytes(4, "big")


def with_rows(rows: bytes) -> bytes:
    """A 7x5 grey PNG whose image data is `rows`."""
    whole = png.encode(pixels((5, 7)))
    return whole[:33] + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "is not a PNG"),
        (b"GIF89a", "is not a PNG"),
        (png.encode(pixels((5, 7)))[:-5], "damaged"),
        (png.encode(pixels((5, 7))).replace(b"IDAT", b"IDAX"), "damaged"),
        (with_rows(bytes(39)), "39 bytes"),
        (with_rows(bytes(50_000_000)), "41 bytes"),
        (with_rows(bytes([5]) + bytes(39)), "row filter 5"),
        (png.encode(pixels((5, 7)))[:33] + chunk(b"IDAT", b"no zlib"), "damaged"),
    ],
)
def test_what_is_damaged_is_refused(data: bytes, said: str) -> None:
    with pytest.raises(AvatarError, match=said):
        png.decode(data, (5, 7), "x.png")
