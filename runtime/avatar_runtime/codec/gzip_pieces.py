"""gzip, written piece by piece, each piece in the way of deflate that makes it smallest. Any gzip reader reads it.

Quantised numbers have few repeats, and looking for them costs bytes: pieces of noise are coded with Huffman codes
alone, pieces with long repeats are not.
"""

from __future__ import annotations

import zlib

PIECE = 16384  # bytes; each piece has Huffman codes of its own
WINDOW = 32768  # bytes that a repeat may lie back
RAW = -zlib.MAX_WBITS
HEADER = b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x02\xff"  # no name, no time stamp: the same input, the same bytes
LAST_BLOCK = b"\x03\x00"  # empty
WAYS = (  # level, memory level (smaller: shorter blocks), strategy
    (6, 9, zlib.Z_HUFFMAN_ONLY),
    (6, 7, zlib.Z_FILTERED),
    (6, 8, zlib.Z_DEFAULT_STRATEGY),
)


class GzipWriter:
    """A gzip file in the making."""

    def __init__(self) -> None:
        self._parts, self._window = [HEADER], b""
        self._crc, self._size = 0, 0

    def add(self, data: bytes) -> int:
        """Appends `data`; returns the bytes that it takes in the file."""
        self._crc, self._size = zlib.crc32(data, self._crc), self._size + len(data)
        taken, at = 0, 0
        while at < len(data):
            end = len(data) if len(data) - at <= PIECE * 3 // 2 else at + PIECE
            piece = data[at:end]
            best = min((_deflated(piece, self._window, *way) for way in WAYS), key=len)
            self._parts.append(best)
            self._window = (self._window + piece)[-WINDOW:]
            taken, at = taken + len(best), end
        return taken

    def done(self) -> bytes:
        """The file."""
        sums = self._crc.to_bytes(4, "little") + (self._size % (1 << 32)).to_bytes(4, "little")
        return b"".join([*self._parts, LAST_BLOCK, sums])


def _deflated(data: bytes, window: bytes, level: int, memory: int, strategy: int) -> bytes:
    """Whole deflate blocks for `data`, which follows `window`."""
    stream = zlib.compressobj(level, zlib.DEFLATED, RAW, memory, strategy, window)
    return stream.compress(data) + stream.flush(zlib.Z_SYNC_FLUSH)
