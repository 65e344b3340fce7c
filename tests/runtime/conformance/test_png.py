"""PNG of reference pictures, crossed with Pillow."""

from __future__ import annotations

import io
import zlib

import numpy as np
import pytest
from PIL import Image

from avatar_runtime.conformance import png
from avatar_runtime.errors import AvatarError

PICTURES = [(5, 7), (5, 7, 3), (1, 1), (1, 1, 3), (40, 33, 3)]


def picture(shape: tuple[int, ...]) -> np.ndarray:
    """Smooth in x, in y, and noise: rows that take every filter."""
    rng = np.random.default_rng(sum(shape))
    y, x = np.mgrid[: shape[0], : shape[1]]
    smooth = (7 * x + 3 * y * (x > 2) + rng.integers(0, 256, x.shape) * (y % 3 == 0)).astype(np.uint8)
    return smooth if len(shape) == 2 else np.stack([smooth, smooth * 3, 255 - smooth], axis=-1)


@pytest.mark.parametrize("shape", PICTURES)
def test_pillow_reads_what_is_written(shape: tuple[int, ...]) -> None:
    want = picture(shape)
    with Image.open(io.BytesIO(png.encode(want))) as image:
        assert image.mode == ("L" if len(shape) == 2 else "RGB")
        np.testing.assert_array_equal(np.asarray(image), want)


@pytest.mark.parametrize("shape", PICTURES)
def test_what_is_written_is_read_back(shape: tuple[int, ...]) -> None:
    want = picture(shape)
    np.testing.assert_array_equal(png.decode(png.encode(want), shape, "x.png"), want)


def test_smooth_pictures_become_small() -> None:
    y, x = np.mgrid[:256, :256]
    assert len(png.encode(np.stack([x, y, x], axis=-1).astype(np.uint8))) < 3000


@pytest.mark.parametrize("shape", [(5, 8, 3), (6, 7, 3), (5, 7)])
def test_another_size_or_kind_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(AvatarError, match=r"x\.png: is no 8-bit"):
        png.decode(png.encode(picture((5, 7, 3))), shape, "x.png")


def chunk(kind: bytes, body: bytes) -> bytes:
    return len(body).to_bytes(4, "big") + kind + body + zlib.crc32(kind + body).to_bytes(4, "big")


def with_rows(rows: bytes) -> bytes:
    """A 7x5 grey PNG whose image data is `rows`."""
    whole = png.encode(picture((5, 7)))
    return whole[:33] + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "no PNG"),
        (b"GIF89a", "no PNG"),
        (png.encode(picture((5, 7)))[:-5], "damaged"),
        (png.encode(picture((5, 7))).replace(b"IDAT", b"IDAX"), "damaged"),
        (with_rows(bytes(39)), "39 bytes"),
        (with_rows(bytes(50_000_000)), "41 bytes"),
        (with_rows(bytes([4]) + bytes(39)), "filter"),
        (png.encode(picture((5, 7)))[:33] + chunk(b"IDAT", b"no zlib"), "damaged"),
    ],
)
def test_what_is_damaged_is_refused(data: bytes, said: str) -> None:
    with pytest.raises(AvatarError, match=said):
        png.decode(data, (5, 7), "x.png")
