"""Packs that a reader must refuse, and which field it must name."""

from __future__ import annotations

import gzip
import json
import math
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

Change = Callable[[Any], object]


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
        told.append({"what": what, "file": f"{number}.avatar", **where})
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
    """(what, file, field and message) of every hostile pack."""
    for what, (file, message) in whole_files(files["joints"]).items():
        yield what, file, {"message": message}
    for what, (change, field, message) in DOCUMENTS.items():
        yield what, changed(files["joints"], change), {"field": field, "message": message}
    for array, at, value, field in NUMBERS:
        yield (
            f"{array}[{at}] = {value}",
            written(files["joints"], array, at, value),
            {"field": field, "message": ""},
        )
    for what, (name, change, field) in OTHERS.items():
        yield what, changed(files[name], change), {"field": field, "message": ""}


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


def _section(document: Any, buffer: str, name: str) -> Any:
    (held,) = (one for one in document["program"]["buffers"] if one["name"] == buffer)
    (found,) = (one for one in held["sections"] if one["name"] == name)
    return found


def _pass(document: Any) -> Any:
    return document["program"]["levels"][0]["deform"][0]


DOCUMENTS: dict[str, tuple[Change, str, str]] = {
    "version": (
        lambda d: d["asset"].update(version="2.0"),
        "$.asset.version",
        "update com.avatar-export.player",
    ),
    "minVersion": (lambda d: d["asset"].update(minVersion="1.7"), "$.asset.version", "needs a reader of 1.7"),
    "version text": (lambda d: d["asset"].update(version="1.0\n"), "$.asset.version", "MAJOR.MINOR"),
    "shaders": (lambda d: d.update(shaders=2), "$.shaders", "needs kernels of version 2; this player has 1"),
    "extension": (
        lambda d: d.update(extensionsRequired=["hair"]),
        "$.extensionsRequired",
        "'hair' is not known",
    ),
    "format": (lambda d: d.update(format="avatar-export"), "$.format", "knows avatar-pack"),
    "entry": (
        lambda d: _pass(d).update(entry="blend2"),
        "level 0, deform pass 0 (blend2)",
        "a newer version may know it",
    ),
    "entry of no program": (
        lambda d: _pass(d).update(entry="sort_keys"),
        "level 0, deform pass 0 (sort_keys)",
        "",
    ),
    "codec": (
        lambda d: d["program"]["buffers"][2]["sections"][0].update(codec="rans"),
        "$.program.buffers[2].sections[0].codec",
        "'rans' is unknown to this reader",
    ),
    "name": (lambda d: d["avatar"].update(name=7), "$.avatar.name", "is 7; a name is needed"),
    "expression lost": (lambda d: d["avatar"]["expressions"].pop(), "array rig.joint_basis", "f32 ["),
    "expression twice": (
        lambda d: d["avatar"]["expressions"][1].update(name="jawOpen"),
        "$.avatar.expressions",
        "twice",
    ),
    "range": (
        lambda d: d["avatar"]["expressions"][1].update(range=[0, "1"]),
        "$.avatar.expressions[1].range[1]",
        "is '1'; a finite number is needed",
    ),
    "late morphs": (lambda d: d["avatar"].update(late_morphs=["left"]), "$.program.pose.late", "need 1"),
    "handedness": (
        lambda d: d["avatar"]["frame"].update(handedness="both"),
        "$.avatar.frame.handedness",
        "both",
    ),
    "head joint": (
        lambda d: d["avatar"]["driving"].update(head_joint="nek"),
        "driving.head_joint",
        "'nek' is not a joint of this avatar; did you mean neck?",
    ),
    "output": (
        lambda d: d["avatar"]["driving"]["outputs"].__setitem__(0, "expression/none"),
        "driving.outputs",
        "'expression/none' is no expression/NAME",
    ),
    "matrix": (lambda d: d["avatar"]["driving"]["matrix"][0].pop(), "$.avatar.driving.matrix[0]", "items"),
    "rotation joint": (
        lambda d: d["avatar"]["rules"].update(rotation_joint="tail"),
        "$.avatar.rules.rotation_joint",
        "tail",
    ),
    "head bone": (
        lambda d: d["avatar"]["rules"].update(rotation="head_bone", rotation_joint=None),
        "$.avatar.rules.rotation_joint",
        "needs a rotation_joint",
    ),
    "group": (
        lambda d: d["levels"][0]["groups"][0].update(count=23),
        "$.levels[0].groups[1]",
        "row 23 comes next",
    ),
    "groups": (lambda d: d["levels"][0]["groups"][3].update(count=9), "$.levels[0].groups", "cover"),
    "joint mix": (
        lambda d: d["levels"][0]["groups"][2].update(joint_mix={"tail": 1}),
        "group lower_teeth, joint_mix",
        "tail",
    ),
    "no joint mix": (
        lambda d: d["levels"][0]["groups"][2].update(joint_mix={}),
        "group lower_teeth",
        "joint_mix",
    ),
    "binding": (
        lambda d: d["levels"][0]["groups"][0].update(binding="glue"),
        "$.levels[0].groups[0].binding",
        "glue",
    ),
    "level": (lambda d: d["levels"].append(d["levels"][0]), "$.program.levels", "another number of levels"),
    "fps": (lambda d: d["avatar"]["clips"][0].update(fps=0), "$.avatar.clips[0].fps", "0.001 to 10000"),
    "frames": (
        lambda d: d["avatar"]["clips"][0].update(frames=6),
        "array clips.0.expression_weights.codes",
        "is missing, or is not uint16",
    ),
    "a long clip": (
        lambda d: d["avatar"]["clips"][0].update(frames=(1 << 31) - 1),
        "$.avatar.clips[0]",
        "with it the clips take more than",
    ),
    "no scale": (
        lambda d: d["arrays"].pop("clips.1.late_weights.scale"),
        "array clips.1.late_weights.scale",
        "is missing",
    ),
    "no parents": (lambda d: d["arrays"].pop("rig.parents"), "array rig.parents", "is missing"),
    "no tensor": (
        lambda d: d["arrays"]["rig.parents"].update(tensor="toString"),
        "array rig.parents",
        "tensor 'toString' is missing",
    ),
    "shape": (lambda d: d["arrays"]["rig.joint_basis"].update(shape=[1]), "array rig.joint_basis", "stores"),
    "a vast shape": (
        lambda d: d["arrays"]["rig.joint_basis"].update(shape=[(1 << 32) - 1] * 4),
        "array rig.joint_basis",
        "are the most",
    ),
    "a large shape": (
        lambda d: d["arrays"]["rig.joint_basis"].update(shape=[(1 << 32) - 1]),
        "array rig.joint_basis",
        "with it the pack takes more than",
    ),
    "type": (lambda d: d["arrays"]["rig.parents"].update(type="u32"), "array rig.parents", "is u32"),
    "triangles": (
        lambda d: d["arrays"]["rig.triangles"].update(shape=[d["arrays"]["rig.triangles"]["shape"][1], 3]),
        "array rig.triangles",
        "not u32 [3, -1]",
    ),
    "pose": (lambda d: d["program"]["pose"].update(joints=25), "pose", "floats"),
    "a far pose": (
        lambda d: d["program"]["pose"].update(joints=1 << 31),
        "$.program.pose.joints",
        "2147483647",
    ),
    "buffer twice": (
        lambda d: d["program"]["buffers"].append(d["program"]["buffers"][0]),
        "buffer Pose",
        "is named twice",
    ),
    "no view": (
        lambda d: d["program"]["levels"][0].pop("view"),
        "$.program.levels[0].view",
        "is missing; a list is needed",
    ),
    "rows": (lambda d: _pass(d).update(rows="48"), "$.program.levels[0].deform[0].rows", "is '48'"),
    "a constant of another language": (
        lambda d: _pass(d)["constants"].update(constructor=1),
        "level 0, deform pass 0 (blend), constants",
        "'constructor' is not known",
    ),
    "count": (
        lambda d: _section(d, "MorphStatic.0", "morph_ptr").update(count=(1 << 32) - 1),
        "buffer MorphStatic.0, section morph_ptr",
        "",
    ),
    "bits": (
        lambda d: _section(d, "MorphStatic.0", "morph_ptr").update(bits=24),
        "$.program.buffers[2].sections[2].bits",
        "8, 16 or 32 is needed",
    ),
}
NUMBERS: tuple[tuple[str, int, float, str], ...] = (
    ("rig.parents", 1, 1, "array rig.parents"),
    ("rig.parents", 1, -2, "array rig.parents"),
    ("rig.rest_local", 12, 1, "array rig.rest_local[0]"),
    ("rig.rest_local", 3, math.nan, "array rig.rest_local"),
    ("rig.corrective_joints", 0, 5, "array rig.corrective_joints"),
    ("rig.anchor_vertices", 0, 20, "array rig.anchor_vertices"),
    ("rig.triangles", 0, 20, "array rig.triangles"),
    ("clips.0.world_from_avatar.scale", 0, 2, "$.avatar.clips[0]"),
    ("clips.0.joint_delta.scale", 0, math.inf, "array clips.0.joint_delta"),
)


def _vertices(document: Any) -> None:
    _section(document, "SurfaceStatic", "vertex_triangle_ptr").update(count=(1 << 32) - 1)


def _corners(document: Any) -> None:
    _section(document, "SurfaceStatic", "vertex_triangle_ptr").update(count=3)


OTHERS: dict[str, tuple[str, Change, str]] = {
    "many vertices around few triangles": (
        "surface",
        _vertices,
        "$.program.buffers[4].sections[3].count",
    ),
    "corners beyond the vertices": ("surface", _corners, "buffer SurfaceStatic, section vertex_triangle_ptr"),
}
