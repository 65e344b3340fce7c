"""Hostile copies of files: each kind of file is changed in its own structure, or byte by byte.

`mutated` knows a file by its name. Everything is drawn from the generator that it is given: the same generator, the
same bytes.
"""

from __future__ import annotations

import gzip
import io
import json
import re
import struct
import warnings
import zipfile
from collections.abc import Callable, Iterator
from random import Random
from typing import Any

FLOATS = [
    struct.pack("<f", value)
    for value in (0.0, -0.0, 1e-45, -1e-30, 1e15, 1e19, -1e30, 3.4e38, float("inf"), float("-inf"), float("nan"))
]  # fmt: skip
# Signalling NaN, whose casts warn: a float32, and the upper half of a float64.
FLOATS += [b"\1\0\x80\x7f", b"\1\0\xf0\x7f"]
WHOLE = [
    struct.pack("<I", value)
    for value in (0, 1, 2, 255, 65535, 1 << 20, (1 << 31) - 1, 1 << 31, (1 << 32) - 1)
]
NUMBERS: list[Any] = [
    0, 1, -1, 2, 7, 255, 65536, (1 << 31) - 1, 1 << 31, (1 << 32) - 1, 1 << 40, 1 << 63, 10**400,
    0.5, -0.0, 1e-300, 1e30, 1e308, float("nan"), float("inf"),
]  # fmt: skip
VALUES: list[Any] = [
    None, True, "", "x" * 5000, "\x1b[2J\u202e", "\ud800", "../../etc/passwd", "/dev/zero", "count", "joint", "polar3",
    [], {}, [[]], {"a": 1}, [0, 0, 0, 0], [1e29] * 3, "world_row0", "group_matrix_row0[9]",
]  # fmt: skip
WORDS = [b"nan", b"inf", b"1e999", b"-1", b"0", b"", b"9" * 20, b"0x10", b"1.5", b"\xff\xfe", b"1_0", b"\0"]
OPCODES = b"(.0123]}Rbtqhju\x81\x85\x88\x8a\x8e\x93\x94\x95"  # of pickles
BYTES = [0, 1, 0x7F, 0x80, 0xFF, *OPCODES]
LARGEST = 1 << 22  # bytes of a mutated file
Change = Callable[[bytes, Random], bytes]


def mutated(name: str, data: bytes, rng: Random) -> bytes:
    """`data` of the file `name`, changed once to three times."""
    change = CHANGES.get(name.rpartition(".")[2].lower(), wounded)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        try:
            data = (wounded if rng.random() < 0.15 else change)(data, rng)
        except Exception:  # an earlier change has left no structure; libraries say so in many ways
            data = wounded(data, rng)
    return data[:LARGEST]


def wounded(data: bytes, rng: Random) -> bytes:
    """Bytes cut off, flipped, overwritten, copied, inserted or dropped, mostly near the ends, where headers are."""
    out = bytearray(data)
    at = _spot(len(out), rng)
    kind = rng.randrange(7)
    if kind == 0:
        del out[at:]
    elif kind == 1 and out:
        out[at] ^= 1 << rng.randrange(8)
    elif kind == 2:
        out[at : at + 1] = bytes([rng.choice(BYTES)])
    elif kind == 3:
        count = rng.randrange(1, 10)
        out[at : at + count] = bytes([rng.choice(BYTES)]) * count
    elif kind == 4:
        start, count = _spot(len(out), rng), rng.randrange(1, 65)
        out[at : at + count] = out[start : start + count]
    elif kind == 5:
        out[at:at] = rng.randbytes(rng.randrange(1, 10))
    else:
        del out[at : at + rng.randrange(1, 65)]
    return bytes(out)


def _spot(size: int, rng: Random) -> int:
    if not size:
        return 0
    near = min(200, size)
    return rng.choice((rng.randrange(size), rng.randrange(near), size - 1 - rng.randrange(near)))


def json_text(data: bytes, rng: Random) -> bytes:
    """A JSON document, one value, key or entry of which is another."""
    return json.dumps(changed(json.loads(data), rng)).encode()


def changed(document: Any, rng: Random) -> Any:
    """A JSON document, changed in place in one spot."""
    spots = list(places(document))
    if not spots:
        return rng.choice(VALUES)
    holder, key = rng.choice(spots)
    kind = rng.randrange(10)
    if kind == 0 and isinstance(holder, dict):
        holder[rng.choice([*(str(name) for _, name in spots), "extra"])] = holder.pop(key)
    elif kind == 1:
        del holder[key]
    elif kind == 2 and isinstance(holder, list):
        holder.insert(key, json.loads(json.dumps(holder[key])))
    elif kind == 3:
        source, name = rng.choice(spots)
        holder[key] = json.loads(json.dumps(source[name]))
    elif kind == 4:
        for _ in range(rng.choice((3, 40, 1200))):
            holder[key] = [holder[key]]
    else:
        holder[key] = other(holder[key], rng)
    return document


def places(value: Any) -> Iterator[tuple[Any, Any]]:
    """(holder, key) of every value inside a JSON document."""
    items = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, inner in items:
        yield value, key
        yield from places(inner)


def other(value: Any, rng: Random) -> Any:
    """Another JSON value, mostly of the same kind."""
    if isinstance(value, int | float) and not isinstance(value, bool) and rng.random() < 0.8:
        return rng.choice([value + 1, value - 1, -value, value * 2, *NUMBERS])
    return rng.choice([*VALUES, *NUMBERS, [value], str(value), f"{value}x"])


def numbers(data: bytes, rng: Random) -> bytes:
    """Some aligned numbers of four bytes become extreme ones, or lie elsewhere."""
    out, count = bytearray(data), len(data) // 4
    for _ in range(rng.randrange(1, 5) if count else 0):
        at = 4 * rng.randrange(count)
        first = 4 * rng.randrange(count)
        kinds = (rng.choice(FLOATS), rng.choice(WHOLE), bytes(out[first : first + 4]), rng.randbytes(4))
        out[at : at + 4] = rng.choice(kinds)
    return bytes(out)


def safetensors(data: bytes, rng: Random) -> bytes:
    """Header or numbers of a safetensors file."""
    end = 8 + int.from_bytes(data[:8], "little")
    if rng.random() < 0.5:
        return data[:end] + numbers(data[end:], rng)
    text = json_text(data[8:end], rng)
    return len(text).to_bytes(8, "little") + text + data[end:]


def ply(data: bytes, rng: Random) -> bytes:
    """Header or numbers of a PLY file."""
    end = data.index(b"end_header\n") + len(b"end_header\n")
    return (
        lines(data[:end], rng) + data[end:] if rng.random() < 0.5 else data[:end] + numbers(data[end:], rng)
    )


def npy(data: bytes, rng: Random) -> bytes:
    """Header or numbers of an .npy file, version 1."""
    end = 10 + int.from_bytes(data[8:10], "little")
    if rng.random() < 0.6:
        return data[:end] + numbers(data[end:], rng)
    text = lines(data[10:end], rng)
    return data[:8] + (len(text) & 0xFFFF).to_bytes(2, "little") + text + data[end:]


def glb(data: bytes, rng: Random) -> bytes:
    """Document or numbers of a .glb."""
    size = int.from_bytes(data[12:16], "little")
    text, rest = data[20 : 20 + size], data[20 + size :]
    if rng.random() < 0.7:
        text = json_text(text, rng)
        text += b" " * (-len(text) % 4)
    else:
        rest = rest[:8] + numbers(rest[8:], rng)
    return b"glTF" + struct.pack("<IIII", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest


def archive(data: bytes, rng: Random) -> bytes:
    """A zip, one member of which is changed as its name asks, renamed, dropped, written twice or compressed."""
    with zipfile.ZipFile(io.BytesIO(data)) as stored:
        members = [(info.filename, info.compress_type, stored.read(info)) for info in stored.infolist()]
    at, kind = rng.randrange(len(members)), rng.randrange(10)
    name, compression, content = members[at]
    if kind == 0:
        members[at] = (
            rng.choice([f"{name}x", f"../{name}", f"/{name}", "", name.upper()]),
            compression,
            content,
        )
    elif kind == 1:
        del members[at]
    elif kind == 2:
        members.append(members[at])
    elif kind == 3:
        members[at] = (name, zipfile.ZIP_DEFLATED, content)
    else:
        members[at] = (name, compression, _member(name, content, rng))
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as made, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of a name that is written twice
        for name, compression, content in members:
            info = zipfile.ZipInfo(name or "x")
            info.compress_type = compression
            made.writestr(info, content)
    return stream.getvalue()


def _member(name: str, content: bytes, rng: Random) -> bytes:
    if re.search(r"(^|/)data/[0-9]+$", name):
        return numbers(content, rng)  # a storage of torch
    return mutated(name, content, rng)


def compressed(data: bytes, rng: Random) -> bytes:
    """A gzip file whose contents are changed."""
    return gzip.compress(wounded(gzip.decompress(data), rng), 1)


def lines(data: bytes, rng: Random) -> bytes:
    """A text: a word becomes another, a line is dropped, doubled or exchanged."""
    kind = rng.randrange(6)
    if kind < 4:
        words = re.split(rb"([\s,;:/()\[\]{}=]+)", data)
        at = 2 * rng.randrange((len(words) + 1) // 2)
        words[at] = rng.choice([*WORDS, words[2 * rng.randrange((len(words) + 1) // 2)]])
        return b"".join(words)
    rows = data.splitlines(keepends=True)
    at, other = rng.randrange(len(rows)), rng.randrange(len(rows))
    if kind == 4:
        del rows[at]
    else:
        rows.insert(at, rows[other])
    return b"".join(rows)


CHANGES: dict[str, Change] = {
    "json": json_text, "safetensors": safetensors, "ply": ply, "npy": npy, "npz": archive, "zip": archive,
    "pth": archive, "glb": glb, "gz": compressed, "csv": lines, "obj": lines, "yaml": lines,
    "txt": lines, "cfg_args": lines,
}  # fmt: skip
