"""Packs that every reader must refuse, and which field it must name: tests/data/hostile_packs.json, and broken files.

A row changes one thing of the golden pack `pack` (joints). In its document: what stands `at` a path is set `to` a
value, updated `with` others, appended `again`, `turned` round, or else taken away; a list is entered by index or by
name. In an `array`: an `element` is set. Python, the web player, the C# core and the native player read the same files.
"""

from __future__ import annotations

import gzip
import json
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

Change = Callable[[Any], object]
TABLE = Path(__file__).parents[2] / "data" / "hostile_packs.json"

# What the web player says in other words, since its host reads JSON and gzip, and what it takes: it reads no triangles.
WEB: dict[str, dict[str, str | bool]] = {
    "cut": {"message": ""},  # some end too early
    "header is no UTF-8": {"message": "not valid for encoding"},
    "header with an overlong letter": {"message": "not valid for encoding"},
    "header with a byte order mark": {"message": "no document 'pack'"},
    "header with a name twice": {"field": "$.asset", "message": "is missing"},
    "header too deep": {"message": "its header is not JSON"},
    "header of many values": {"field": "header", "message": "is a list"},
    "a wrong checksum of the header": {"message": "header crc mismatch"},
    "an unknown kind of block": {"message": "invalid block type"},
    "another member": {"message": "goes on after its last tensor"},
    "the same member again": {"message": "goes on after its last tensor"},
    "expression lost": {"message": "is Float32Array [4, 5, 3]"},
    "type": {"message": "is Uint32Array"},
    "triangles": {"taken": True},
    "a far pose": {"field": "pose", "message": "floats"},
    "a corner of no vertex": {"taken": True},
}


class Parts:
    """A pack in parts: the header's JSON, the document, the bytes of the tensors."""

    def __init__(self, file: bytes) -> None:
        data = gzip.decompress(file)
        end = 8 + int.from_bytes(data[:8], "little")
        self.header = json.loads(data[8:end])
        self.document = json.loads(self.header["__metadata__"]["pack"])
        self.body = bytearray(data[end:])

    def file(self) -> bytes:
        """The file of these parts."""
        header = {**self.header, "__metadata__": {"pack": json.dumps(self.document)}}
        return wrapped(json.dumps(header).encode(), bytes(self.body))


def wrapped(header: bytes, body: bytes = b"") -> bytes:
    """A pack of a header and a body."""
    return gzip.compress(len(header).to_bytes(8, "little") + header + body, 9, mtime=0)


def write_hostile(files: dict[str, bytes], folder: Path) -> None:
    """Packs that are refused, with field and part of the message; and unusual ones that are not."""
    told = []
    for number, (what, file, where) in enumerate(unsound(files)):
        (folder / f"{number}.avatar").write_bytes(file)
        told.append(
            {"what": what, "file": f"{number}.avatar", **where, "web": WEB.get(what.partition(" at ")[0], {})}
        )
    (folder / "hostile.json").write_text(json.dumps(told))
    for name, file in sound(files["joints"]).items():
        (folder / f"{name}.avatar").write_bytes(file)
    (folder / "sound.json").write_text(json.dumps([f"{name}.avatar" for name in sound(files["joints"])]))


def sound(whole: bytes) -> dict[str, bytes]:
    """Packs that a reader must take."""
    shared = {"tensor": "rig.inverse_bind_matrix"}
    return {
        "newer_minor": changed(whole, lambda d: d["asset"].update(version="1.9")),
        "shared_tensor": changed(whole, lambda d: d["arrays"]["rig.rest_local"].update(shared)),
        "unknown_key": changed(whole, lambda d: d.update(later={"a": [1, {}]})),
        **compressions(whole),
    }


def compressions(whole: bytes) -> dict[str, bytes]:
    """The same pack in all that gzip and deflate allow: kinds of blocks, fields of the header."""
    data = gzip.decompress(whole)
    tail = whole[-8:]
    plain = b"\x1f\x8b\x08\0\0\0\0\0\0\0"
    fields = b"\x1f\x8b\x08\x1e\0\0\0\0\0\0" + b"\x03\0abc" + b"name\0" + b"a comment\0"
    fields += (zlib.crc32(fields) & 0xFFFF).to_bytes(2, "little")
    made = {}
    for name, level, memory, strategy in (
        ("stored", 0, 8, zlib.Z_DEFAULT_STRATEGY),
        ("fixed", 9, 8, zlib.Z_FIXED),
        ("huffman", 9, 8, zlib.Z_HUFFMAN_ONLY),
        ("runs", 9, 8, zlib.Z_RLE),
        ("small_blocks", 9, 1, zlib.Z_DEFAULT_STRATEGY),
    ):
        deflate = zlib.compressobj(level, zlib.DEFLATED, -15, memory, strategy)
        made[name] = plain + deflate.compress(data) + deflate.flush() + tail
    deflate = zlib.compressobj(6, zlib.DEFLATED, -15)
    parts = [
        deflate.compress(data[at : at + 999]) + deflate.flush(zlib.Z_FULL_FLUSH)
        for at in range(0, len(data), 999)
    ]
    made["flushed"] = plain + b"".join(parts) + deflate.flush() + tail
    made["fields"] = fields + whole[10:]
    return made


def unsound(files: dict[str, bytes]) -> Iterator[tuple[str, bytes, dict[str, str | None]]]:
    """(what, file, field and message) of every hostile pack; `python` if Python names another field."""
    for what, (file, message) in whole_files(files["joints"]).items():
        yield what, file, {"message": message}
    for what, file, message in broken(files["joints"]):
        yield what, file, {"message": message}
    for row in json.loads(TABLE.read_text("utf-8")):
        whole = files[row.get("pack", "joints")]
        if "array" in row:
            file = written(whole, row["array"], row["element"], float(row["to"]))
        else:
            file = changed(whole, lambda document, row=row: apply(row, document))
        said = {key: row[key] for key in ("field", "python") if key in row}
        yield row["what"], file, {**said, "message": row.get("message", "")}


def broken(whole: bytes) -> Iterator[tuple[str, bytes, str]]:
    """The file cut off anywhere, going on, and with a byte of its last eight damaged."""
    for length in range(2, len(whole), 97):
        yield f"cut at {length}", whole[:length], "cut off"
    for more in (b"\7", bytes(300), b"trailing bytes"):
        yield f"{len(more)} bytes more", whole + more, ""
    for at in range(len(whole) - 8, len(whole)):
        yield f"damaged at {at}", whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :], ""


def apply(row: dict[str, Any], document: Any) -> None:
    """The change of a row of the table."""
    *path, last = row["at"]
    for step in path:
        document = inside(document, step)
    if "to" in row:
        document[last] = row["to"]
    elif "with" in row:
        document[last].update(row["with"])
    elif "again" in row:
        document[last].append(document[last][row["again"]])
    elif "turned" in row:
        document[last].reverse()
    else:
        del document[last]


def inside(value: Any, step: str | int) -> Any:
    """An item of an object or a list; of a list also the one of that name."""
    if isinstance(value, list) and isinstance(step, str):
        (found,) = (one for one in value if one["name"] == step)
        return found
    return value[step]


def changed(file: bytes, change: Change) -> bytes:
    """The pack with a changed document."""
    parts = Parts(file)
    change(parts.document)
    return parts.file()


def written(file: bytes, array: str, at: int, value: float) -> bytes:
    """The pack with one other number in an array, which is stored by planes of bytes."""
    parts = Parts(file)
    told = parts.document["arrays"][array]
    begin, end = parts.header[told["tensor"]]["data_offsets"]
    data = np.array(value, {"f32": "<f4", "i32": "<i4", "u32": "<u4"}[told["type"]]).tobytes()
    for plane, byte in enumerate(data):
        parts.body[begin + plane * (end - begin) // 4 + at] = byte
    return parts.file()


def whole_files(whole: bytes) -> dict[str, tuple[bytes, str]]:
    """What is wrong -> (the file, part of the message)."""
    parts = Parts(whole)
    longer, damaged = Parts(whole), bytearray(whole)
    longer.body += b"\0"
    damaged[-6] ^= 1  # the checksum
    giant = {"dtype": "U8", "shape": [1 << 30], "data_offsets": [0, 1 << 30]}
    twice = json.dumps(parts.header)[:-1] + ', "__metadata__": {"pack": "{}"}}'
    return {
        "empty": (b"", "a.avatar: is not a pack: it does not begin as a gzip file"),
        "a page": (b"<!doctype html><title>404</title>", "is not a pack"),
        "one byte": (b"\x1f", "is not a pack"),
        "inflated": (
            gzip.decompress(whole),
            "was inflated on its way: the server must send packs as they are",
        ),
        "only the head of gzip": (whole[:10], "cut off"),
        "too short": (gzip.compress(b"hello"), "cut off"),
        "zeros": (gzip.compress(bytes(100)), "its header is not JSON"),
        "no header": (wrapped(b"{}"), "has no document 'pack'"),
        "header is a list": (wrapped(b"[]"), "header: is a list; a JSON object is needed"),
        "header is no UTF-8": (wrapped(b'{"\xff":1}'), "its header is not JSON (it is not UTF-8)"),
        "header with an overlong letter": (wrapped(b'{"\xc0\xaf":1}'), "it is not UTF-8"),
        "header with a byte order mark": (wrapped(b"\xef\xbb\xbf{}"), "its header is not JSON"),
        "header with a name twice": (wrapped(twice.encode(), bytes(parts.body)), "a name stands twice"),
        "header too deep": (wrapped(b'{"a":' + b"[" * 100000), "values inside each other"),
        "header of many values": (wrapped(b"[" + b"0," * (1 << 22) + b"0]"), "more than 2097152 values"),
        "a tensor of floats": (
            wrapped(b'{"a":{"dtype":"F32","shape":[1],"data_offsets":[0,4]}}', bytes(4)),
            "header.a: is not the entry of a tensor of bytes",
        ),
        "document is no JSON": (
            wrapped(b'{"__metadata__":{"pack":"[}"}}'),
            "its document 'pack' is not JSON",
        ),
        "document is a list": (
            wrapped(b'{"__metadata__":{"pack":"[]"}}'),
            "$: is a list; a JSON object is needed",
        ),
        "a byte too many": (longer.file(), "goes on after its last tensor"),
        "a wrong checksum": (bytes(damaged), "damaged"),
        "a wrong checksum of the header": (
            b"\x1f\x8b\x08\x02\0\0\0\0\0\0\0\0" + whole[10:],
            "the checksum of its header differs",
        ),
        "a field of the header without end": (whole[:3] + b"\x08" + b"\1" * 99, "cut off"),
        "an unknown kind of block": (whole[:10] + b"\x07" + whole[11:], "an unknown kind of block"),
        "another member": (whole + gzip.compress(b"more"), "other bytes follow"),
        "the same member again": (whole + whole, "other bytes follow"),
        "a bomb": (
            wrapped(json.dumps({"__metadata__": {"pack": "{}"}, "giant": giant}).encode(), bytes(4 << 20)),
            "claims 1073741824 bytes in a file of",
        ),
        "a long header": (
            gzip.compress((1 << 40).to_bytes(8, "little")),
            "claims a header of 1099511627776 bytes",
        ),
        "a header of 2^64 - 1 bytes": (
            gzip.compress(b"\xff" * 8),
            "claims a header of 18446744073709551615 bytes",
        ),
        "a header without end": (gzip.compress((16 << 20).to_bytes(8, "little")), "too early"),
    }
