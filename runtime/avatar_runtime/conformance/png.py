"""PNG of 8-bit grey and RGB images, both directions, without interlacing, palettes and alpha."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from avatar_runtime.conformance.model import U8
from avatar_runtime.io.errors import AvatarError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
COLOUR_TYPE = {1: 0, 3: 2}  # channels: grey, RGB
NONE, SUB, UP, AVERAGE, PAETH = range(5)  # row filters; the last two are read and not written


def encode(image: U8) -> bytes:
    """PNG of [H, W] or [H, W, 3]; every row uses the filter that leaves the smallest differences."""
    height, width = image.shape[:2]
    rows = image.reshape(height, width, -1)
    filtered = np.repeat(rows[None], 3, axis=0)
    filtered[SUB, :, 1:] -= rows[:, :-1]
    filtered[UP, 1:] -= rows[:-1]
    flat = filtered.reshape(3, height, -1)
    best = np.argmin(np.abs(flat.view(np.int8).astype(np.int64)).sum(axis=2), axis=0)
    lines = np.concatenate([best[:, None].astype(np.uint8), flat[best, np.arange(height)]], axis=1)
    header = struct.pack(">IIBBBBB", width, height, 8, COLOUR_TYPE[rows.shape[2]], 0, 0, 0)
    parts = ((b"IHDR", header), (b"IDAT", zlib.compress(lines.tobytes(), 9)), (b"IEND", b""))
    return SIGNATURE + b"".join(
        struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        for kind, body in parts
    )


def decode(data: bytes | memoryview, shape: tuple[int, ...], file: str) -> U8:
    """The image of `shape` ([H, W] or [H, W, 3]) of an 8-bit PNG without interlacing.

    Raises AvatarError for any other size or kind of PNG, and for a damaged one. Source: PNG, third edition, section 9.
    """
    height, width, channels = shape[0], shape[1], (*shape, 1)[2]
    want = struct.pack(">IIBBBBB", width, height, 8, COLOUR_TYPE[channels], 0, 0, 0)
    chunks = list(_chunks(bytes(data), file))
    if not chunks or chunks[0] != (b"IHDR", want):
        kind = "grey" if channels == 1 else "RGB"
        raise AvatarError(f"is not an 8-bit {kind} PNG of {width}x{height} pixels", file=file)
    packed = b"".join(body for kind, body in chunks if kind == b"IDAT")
    size = height * (1 + width * channels)
    try:
        lines = zlib.decompressobj().decompress(packed, size + 1)
    except zlib.error as error:
        raise AvatarError(f"is damaged ({error})", file=file) from None
    if len(lines) != size:
        raise AvatarError(f"holds {len(lines)} bytes of rows, expected {size}", file=file)
    rows = np.frombuffer(lines, np.uint8).reshape(height, -1)
    return _unfiltered(rows[:, 0], rows[:, 1:].reshape(height, width, channels), file).reshape(shape)


def _chunks(data: bytes, file: str) -> Iterator[tuple[bytes, bytes]]:
    if not data.startswith(SIGNATURE):
        raise AvatarError("is not a PNG", file=file)
    at = len(SIGNATURE)
    while at < len(data):
        size = int.from_bytes(data[at : at + 4], "big")
        kind, body, check = data[at + 4 : at + 8], data[at + 8 : at + 8 + size], data[at + 8 + size :][:4]
        if len(check) != 4 or int.from_bytes(check, "big") != zlib.crc32(kind + body):
            raise AvatarError("is cut off or damaged", file=file)
        yield kind, body
        at += 12 + size


def _unfiltered(filters: U8, rows: U8, file: str) -> U8:
    if (filters > PAETH).any():
        raise AvatarError(f"uses row filter {filters.max()}, which no PNG has", file=file)
    image = np.zeros_like(rows)
    above = np.zeros_like(rows[0])
    for y, (kind, row) in enumerate(zip(filters, rows, strict=True)):
        if kind == SUB:
            image[y] = np.cumsum(row, axis=0, dtype=np.uint8)
        elif kind in PREDICTED:
            image[y] = _predicted(row, above, PREDICTED[kind])
        else:
            image[y] = row + above if kind == UP else row
        above = image[y]
    return image


def _predicted(row: U8, above: U8, predict: Callable[[int, int, int], int]) -> U8:
    """A row [W, channels] whose filter needs the byte before, channel by channel."""
    result = np.empty_like(row)
    for channel in range(row.shape[1]):
        left = corner = 0  # before and above before
        bytes_ = []
        for byte, up in zip(row[:, channel].tolist(), above[:, channel].tolist(), strict=True):
            left = (byte + predict(left, up, corner)) & 255
            corner = up
            bytes_.append(left)
        result[:, channel] = bytes_
    return result


def _average(left: int, up: int, corner: int) -> int:
    return (left + up) // 2


def _paeth(left: int, up: int, corner: int) -> int:
    """Which of the three lies nearest to left + up - corner; of equally near ones, the first."""
    by_left, by_up, by_corner = abs(up - corner), abs(left - corner), abs(left + up - 2 * corner)
    if by_left <= by_up and by_left <= by_corner:
        return left
    return up if by_up <= by_corner else corner


PREDICTED: Mapping[int, Callable[[int, int, int], int]] = {AVERAGE: _average, PAETH: _paeth}
