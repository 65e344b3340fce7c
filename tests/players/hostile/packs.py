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
from random import Random
from typing import Any

import numpy as np

Change = Callable[[Any], object]
TABLE = Path(__file__).parents[2] / "data" / "hostile_packs.json"

# What the web player says in other words, since its host inflates, and a number that its checks of `pose` find.
WEB: dict[str, dict[str, str]] = {
    "an unknown kind of block": {"message": "invalid block type"},
    "another member": {"message": "goes on after its last tensor"},
    "the same member again": {"message": "goes on after its last tensor"},
    "a far pose": {"field": "pose", "message": "floats"},
}
# Letters that move or hide what a terminal or a page shows, and how a message has them.
HOSTILE, SHOWN = "\x1b[2J\u202e\n\x9b", "\\u001b[2J\\u202e\\u000a\\u009b"


ROOM = {"at": ["program", "buffers", "Splats.0", "bytes"], "to": (1 << 31) - 1}
CHUNKS = ("Splats", "Sh", "Projected")  # buffers that a chunk writes

# Text that no reader takes for a value in a document, and text that each takes, four lists and objects deep.
NO_JSON = (
    "1e400", "9007199254740993", "-9007199254740993", "01", "1.", ".5", "+1", "NaN", "[1,]", "[1 2]", "[1[2]]",
    "[,1]", '{"a":1,}', '{"a" 1}', "{1:1}", '{"a":1,"\\u0061":2}', '{"__proto__":1,"__proto__":1}',
    r'"\ud800"', r'"\ude00\ud83d"', r'"\ud83dx"', r'"\x"', r'"\u12g4"', '"\t"', "'a'", "tru", "nullx", "\v1", "\u00a01",
    "/**/1", "", '"', "[" * 62 + "]" * 62, "1" * 400, "123456789012345678", "-1e400", "-", "1e", "truth", "[true",
    "[] []", "[[1] [2]]", '"a', '"\x01"', r'"\ud83d\u0041"', "\ufeff1", "\f1",
    r'"a\u0000"', r'{"\\\u0000":1}',
)  # fmt: skip
UNUSUAL = (
    "9007199254740992", "-9007199254740992.0", "1e22", "-0", "1e-400", "123456789012345678901234567890e-20", '"\u007f"',
    r'"\ud83d\ude00\u0001\/"', '{"__proto__":1,"constructor":{"0":1}, "":2}', "\r\n\t 1 ", "[" * 60 + "]" * 60,
)  # fmt: skip


class Parts:
    """A pack in parts: the header's JSON, the document, the bytes of the tensors."""

    def __init__(self, file: bytes) -> None:
        data = gzip.decompress(file)
        end = 8 + int.from_bytes(data[:8], "little")
        self.header = json.loads(data[8:end])
        self.document = json.loads(self.header["__metadata__"]["pack"])
        self.body = bytearray(data[end:])

    def tensor(self, name: str, data: bytes) -> str:
        """Adds a tensor."""
        begin = len(self.body)
        self.body += data
        self.header[name] = {"dtype": "U8", "shape": [len(data)], "data_offsets": [begin, begin + len(data)]}
        return name

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
        told.append({"what": what, "file": f"{number}.avatar", **where, "web": WEB.get(what, {})})
    (folder / "hostile.json").write_text(json.dumps(told))
    for name, file in sound(files).items():
        (folder / f"{name}.avatar").write_bytes(file)
    (folder / "sound.json").write_text(json.dumps([f"{name}.avatar" for name in sound(files)]))


def sound(files: dict[str, bytes]) -> dict[str, bytes]:
    """Packs that a reader must take."""
    whole = files["joints"]
    other = {"tensor": "rig.inverse_bind_matrix"}
    return {
        "newer_minor": changed(whole, lambda d: d["asset"].update(version="1.9")),
        "shared_tensor": changed(whole, lambda d: d["arrays"]["rig.rest_local"].update(other)),
        "wide_name": changed(
            whole, lambda d: d["program"]["buffers"].append({"name": "\U0001f600" * 96, "bytes": 0})
        ),
        "shared_by_30": shared(whole, 30),
        "unknown_key": changed(whole, lambda d: d.update(later={"a": [1, {}]})),
        "a_list_of_no_joint": without_joints(files["surface_without_rig"]),
        "nothing_in_odd_shapes": changed(whole, odd_nothing),
        "a_prefix_that_hides": changed(whole, lambda d: prefixed(d, "\1")),
        "unusual_json": spelled(whole, f"[{', '.join(UNUSUAL)}]"),
        **compressions(whole),
    }


def odd_nothing(document: Any) -> None:
    """Adds an array without elements in a shape that NumPy has not, and a pointer that claims elements of 8 bits."""
    sections = [section for one in document["program"]["buffers"] for section in one.get("sections", ())]
    next(one for one in sections if one["codec"] == "pointer")["bits"] = 8
    empty = next(one["tensor"] for one in sections if one["count"] == 0)
    document["arrays"]["y"] = {
        "tensor": empty,
        "type": "u8",
        "shape": [*[(1 << 32) - 1] * 3, 0],
        "codec": "raw",
    }


def prefixed(document: Any, prefix: str) -> None:
    """Begins the names of what a chunk writes with `prefix`."""
    (level,) = document["program"]["levels"]
    level["prefix"] = prefix
    for one in document["program"]["buffers"]:
        one["name"] = prefix * one["name"].startswith(CHUNKS) + one["name"]
    for one in level["deform"] + level["view"]:
        one["buffers"] |= {kind: prefix + name for kind, name in one["buffers"].items() if kind in CHUNKS}


def without_joints(whole: bytes) -> bytes:
    """An avatar without a rig as one whose list of joints is empty."""
    parts = Parts(whole)
    parts.document["avatar"]["joints"] = []
    parts.tensor("none", b"")
    expressions = len(parts.document["avatar"]["expressions"])
    for name, kind, shape in (
        ("parents", "i32", [0]), ("corrective_joints", "i32", [0]), ("anchor_vertices", "u32", [0]),
        ("rest_local", "f32", [0, 4, 4]), ("inverse_bind_matrix", "f32", [0, 4, 4]),
        ("joint_basis", "f32", [expressions, 0, 3]),
    ):  # fmt: skip
        told = {"tensor": "none", "type": kind, "shape": shape, "codec": "raw"}
        parts.document["arrays"][f"rig.{name}"] = told
    return parts.file()


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
    for text in NO_JSON:
        yield (
            f"no JSON: {text[:30]}",
            spelled(files["joints"], text),
            {"message": "its document 'pack' is not JSON"},
        )
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
    for more in (b"\7", bytes(300), b"trailing bytes", b"last as it is" + whole[-4:]):
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


def spelled(file: bytes, text: str) -> bytes:
    """The pack with a text for an unknown value of its document."""
    parts = Parts(file)
    parts.document["avatar"]["extras"] = {"x": "@"}
    document = json.dumps(parts.document).replace('"@"', text)
    header = {**parts.header, "__metadata__": {"pack": document}}
    return wrapped(json.dumps(header).encode(), bytes(parts.body))


def written(file: bytes, array: str, at: int, value: float) -> bytes:
    """The pack with one other number in an array, which is stored by planes of bytes."""
    parts = Parts(file)
    told = parts.document["arrays"][array]
    begin, end = parts.header[told["tensor"]]["data_offsets"]
    data = np.array(value, {"f32": "<f4", "i32": "<i4", "u32": "<u4"}[told["type"]]).tobytes()
    for plane, byte in enumerate(data):
        parts.body[begin + plane * (end - begin) // 4 + at] = byte
    return parts.file()


def around(whole: bytes) -> bytes:
    """Triangles around -1 vertices."""
    empty = {"bits": 8, "count": 0, "codec": "raw", "tensor": "none"}
    of = {"corners": {}, "vertex_triangle_ptr": {}, "vertex_triangle": {"codec": "incidence"}}
    sections = [{"name": name, **empty, **more} for name, more in of.items()]
    parts = Parts(whole)
    parts.tensor("none", b"")
    parts.document["program"]["buffers"].append({"name": "X", "sections": sections})
    return parts.file()


def with_entries(parts: Parts, a_row: int) -> None:
    """Gives every Gaussian as many entries of codes of no width."""
    (level,) = parts.document["program"]["levels"]
    (blend,) = (one for one in level["deform"] if one["entry"] == "blend")
    rows, constants, at = blend["rows"], blend["constants"], 0
    for section in inside(parts.document["program"]["buffers"], "BlendStatic.0")["sections"]:
        if section["name"] == "appearance_ptr":
            counts = np.full(rows, a_row, np.uint32).view(np.uint8).reshape(rows, 4)
            section["tensor"] = parts.tensor("counts", counts.T.tobytes())
        elif section["name"] == "appearance_column":
            section |= {"count": rows * a_row, "tensor": parts.tensor("columns", bytes(rows * a_row))}
        constants[section["name"]] = at
        at += -(-section["count"] * section["bits"] // 32)
    constants |= {f"appearance_{name}_width": 0 for name in ("log_scale", "opacity", "sh")}


def busy(whole: bytes) -> bytes:
    """Much work for a small file."""
    parts = Parts(whole)
    with_entries(parts, 6000)
    return parts.file()


def scaled(whole: bytes) -> bytes:
    """The float32 nearest to 1e30, which is larger, for a scale."""
    parts = Parts(whole)
    sections = inside(parts.document["program"]["buffers"], "BlendStatic.0")["sections"]
    section = inside(sections, "base_mean_scale")
    begin, end = parts.header[section["tensor"]]["data_offsets"]
    section["codec"] = "raw"
    parts.body[begin:end] = np.full((end - begin) // 4, 1e30, "<f4").tobytes()
    return parts.file()


def shared(whole: bytes, count: int = 64) -> bytes:
    """Arrays that share one tensor of zeros; 64: 8 MiB of some kilobytes."""
    parts = Parts(whole)
    size = 1 << 17
    told = {"tensor": parts.tensor("zeros", bytes(size)), "type": "u8", "shape": [size], "codec": "raw"}
    parts.document["arrays"] |= {f"zeros {i}": told for i in range(count)}
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
        "header too deep": (wrapped(b'{"a":' + b"[" * 60000), "values inside each other"),
        "header of many values": (
            wrapped(b"[" + b"0," * (1 << 21) + b"0]", Random(1).randbytes(1 << 18)),
            "more than 2097152 values",
        ),
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
        "a reserved flag of gzip": (whole[:3] + b"\x20" + whole[4:], ""),
        "pointers of no vertex": (around(whole), "codec incidence needs"),
        "more entries than a file has": (busy(whole), "rows and entries a frame"),
        "a buffer for no file": (
            changed(whole, lambda d: apply(ROOM, d)),
            "with it the pack takes more than",
        ),
        "a scale beyond 1e30": (scaled(whole), "exceeds 1e+30"),
        "an empty member before it": (gzip.compress(b"", mtime=0) + whole, ""),
        "one tensor for many arrays": (shared(whole), "with it the pack takes more than"),
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
        "a long header in a small file": (wrapped(b"{}" + b" " * 100_000), "claims a header of 100002 bytes"),
        "a header of 2^64 - 1 bytes": (
            gzip.compress(b"\xff" * 8),
            "claims a header of 18446744073709551615 bytes",
        ),
        "a header without end": (gzip.compress((1 << 16).to_bytes(8, "little")), "too early"),
    }
