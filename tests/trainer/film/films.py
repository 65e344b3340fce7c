"""Small films, and films whose boxes are changed by hand."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from pathlib import Path

import cv2
import numpy as np

from avatar_trainer.film.source import Picture

INSIDE = {b"stsd": 8, b"mp4v": 78}  # bytes before the boxes within a box
TRACK = (b"moov", b"trak")
TABLE = (*TRACK, b"mdia", b"minf", b"stbl")
LENS = b"com.apple.quicktime.camera.focal_length.35mm_equivalent"


def picture(level: int, width: int = 64, height: int = 32) -> Picture:
    """A grey picture whose upper left quarter is red."""
    pixels = np.full((height, width, 3), level, np.uint8)
    pixels[: height // 2, : width // 2] = (200, 30, 30)
    return pixels


def write(path: Path, pictures: Sequence[Picture], fps: float = 25, code: str = "mp4v") -> Path:
    """A film of RGB pictures."""
    height, width = pictures[0].shape[:2]
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*code), fps, (width, height))
    assert writer.isOpened()
    for one in pictures:
        writer.write(one[:, :, ::-1])
    writer.release()
    return path


def box(kind: bytes, payload: bytes) -> bytes:
    return struct.pack(">I4s", 8 + len(payload), kind) + payload


def edited(data: bytes, path: Sequence[bytes], change: Callable[[bytes], bytes]) -> bytes:
    """A film with what the first box at `path` holds changed; the index stands last, so nothing else moves."""
    made, at, left = b"", 0, list(path)
    while at + 8 <= len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        inner, at = data[at + 8 : at + size], at + size
        if left and kind == left[0]:
            skip, left = INSIDE.get(kind, 0), []
            inner = change(inner) if len(path) == 1 else inner[:skip] + edited(inner[skip:], path[1:], change)
        made += box(kind, inner)
    assert not left, path
    return made


def turned(data: bytes, matrix: Sequence[int]) -> bytes:
    """The film with a, b, c, d of its matrix."""
    a, b, c, d = (value * 65536 for value in matrix)
    new = struct.pack(">9i", a, b, 0, c, d, 0, 0, 0, 1 << 30)
    return edited(data, (*TRACK, b"tkhd"), lambda old: old[:40] + new + old[76:])


def timed(data: bytes, runs: Sequence[tuple[int, int]]) -> bytes:
    """The film with (frames, units of its clock) as its times, and without an edit list."""
    table = struct.pack(">II", 0, len(runs)) + b"".join(struct.pack(">II", *run) for run in runs)
    data = edited(data, (*TABLE, b"stts"), lambda _: table)
    return edited(data, TRACK, lambda old: old.replace(b"edts", b"free", 1))


def coloured(data: bytes, transfer: int) -> bytes:
    """The film with BT.2020 primaries and a transfer function stated."""
    colr = box(b"colr", b"nclx" + struct.pack(">3HB", 9, transfer, 1, 0))
    entry = (*TABLE, b"stsd", b"mp4v")
    return edited(data, entry, lambda old: old + colr)


def lensed(data: bytes, kind: int, value: bytes, where: Sequence[bytes]) -> bytes:
    """The film with QuickTime metadata about the lens: of a well-known type, in `where` (`moov` or `moov`, `trak`)."""
    keys = struct.pack(">II", 0, 2) + box(b"mdta", b"com.apple.quicktime.make") + box(b"mdta", LENS)
    item = box(struct.pack(">I", 2), box(b"data", struct.pack(">II", kind, 0) + value))
    header = box(b"hdlr", bytes(8) + b"mdta" + bytes(13))
    meta = box(b"meta", header + box(b"keys", keys) + box(b"ilst", item))
    return edited(data, where, lambda old: old + meta)
