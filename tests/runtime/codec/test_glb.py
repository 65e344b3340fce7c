"""GLB: every kind of accessor against values by hand, a real file against trimesh, bad ones by name."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import pytest
import trimesh

from avatar_runtime.codec import glb
from avatar_runtime.io.errors import AvatarError
from tests.shared_data import shared

CODES = {5120: "b", 5121: "B", 5122: "h", 5123: "H", 5125: "I", 5126: "f"}
JSON, BIN = 0x4E4F534A, 0x004E4942


def pack(document: Any, binary: bytes | None = b"") -> bytes:
    """A GLB of this document (an object, or bytes as they are) and binary chunk."""
    text = document if isinstance(document, bytes) else json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), JSON) + text
    if binary is not None:
        binary += b"\0" * (-len(binary) % 4)
        chunks += struct.pack("<II", len(binary), BIN) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def small(binary: bytes, accessor: dict[str, Any], **view: Any) -> dict[str, Any]:
    """A document with one buffer view over `binary` and one accessor."""
    return {
        "buffers": [{"byteLength": len(binary)}],
        "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(binary)} | view],
        "accessors": [{"bufferView": 0} | accessor],
    }


def read(binary: bytes, accessor: dict[str, Any], **view: Any) -> np.ndarray:
    return glb.accessor(glb.decode(pack(small(binary, accessor, **view), binary), "a.glb"), 0)


@pytest.mark.parametrize("component", CODES)
@pytest.mark.parametrize(("kind", "width"), [("SCALAR", 1), ("VEC2", 2), ("VEC3", 3), ("VEC4", 4)])
@pytest.mark.parametrize("gap", [0, 5])
def test_every_component_width_and_stride(component: int, kind: str, width: int, gap: int) -> None:
    code = CODES[component]
    values = [[7 * i + j for j in range(width)] for i in range(6)]
    rows = b"".join(struct.pack(f"<{width}{code}", *row) + b"\xee" * gap for row in values)
    view = {"byteStride": struct.calcsize(f"<{width}{code}") + gap} if gap else {}
    got = read(
        b"\xdd\xdd\xdd" + rows,
        {"byteOffset": 3, "componentType": component, "count": 6, "type": kind},
        **view,
    )
    assert got.dtype == np.dtype(code)
    assert got.tolist() == (np.array(values)[:, 0].tolist() if width == 1 else values)


@pytest.mark.parametrize(
    ("kind", "component", "binary", "want"),
    [
        ("MAT2", 5121, bytes([1, 2, 0, 0, 3, 4, 0, 0]), [[1, 3], [2, 4]]),
        ("MAT3", 5121, bytes([1, 2, 3, 0, 4, 5, 6, 0, 7, 8, 9, 0]), [[1, 4, 7], [2, 5, 8], [3, 6, 9]]),
        ("MAT3", 5123, struct.pack("<3H2x3H2x3H2x", *range(1, 10)), [[1, 4, 7], [2, 5, 8], [3, 6, 9]]),
        ("MAT2", 5126, struct.pack("<4f", 1, 2, 3, 4), [[1, 3], [2, 4]]),
    ],
)
def test_columns_begin_on_four_bytes(kind: str, component: int, binary: bytes, want: list[list[int]]) -> None:
    assert read(binary, {"componentType": component, "count": 1, "type": kind})[0].tolist() == want


@pytest.mark.parametrize(
    ("component", "values", "want"),
    [
        (5120, [-128, -127, 0, 127], [-1, -1, 0, 1]),
        (5121, [0, 51, 255], [0, 0.2, 1]),
        (5122, [-32768, -32767, 16384, 32767], [-1, -1, 16384 / 32767, 1]),
        (5123, [0, 65535], [0, 1]),
    ],
)
def test_normalised_integers(component: int, values: list[int], want: list[float]) -> None:
    binary = struct.pack(f"<{len(values)}{CODES[component]}", *values)
    accessor = {"componentType": component, "count": len(values), "type": "SCALAR", "normalized": True}
    got = read(binary, accessor)
    assert got.dtype == np.float32 and np.array_equal(got, np.float32(want))


def sparse(indices: list[int], *, base: bool, count: int = 4) -> dict[str, Any]:
    """Document whose accessor 0 has two-wide floats replaced at `indices` by 100, 101, 102, ..."""
    accessor: dict[str, Any] = {
        "componentType": 5126,
        "count": count,
        "type": "VEC2",
        "sparse": {
            "count": len(indices),
            "indices": {"bufferView": 1, "componentType": 5121},
            "values": {"bufferView": 2},
        },
    }
    views = [
        {"buffer": 0, "byteOffset": 0, "byteLength": 32},
        {"buffer": 0, "byteOffset": 32, "byteLength": len(indices)},
        {"buffer": 0, "byteOffset": 40, "byteLength": 8 * len(indices)},
    ]
    return {
        "buffers": [{"byteLength": 40 + 8 * len(indices)}],
        "bufferViews": views,
        "accessors": [accessor | ({"bufferView": 0} if base else {})],
    }


def sparse_binary(indices: list[int]) -> bytes:
    values = struct.pack(f"<{2 * len(indices)}f", *range(100, 100 + 2 * len(indices)))
    return struct.pack("<8f", *range(8)) + bytes(indices) + b"\0" * (8 - len(indices)) + values


@pytest.mark.parametrize("base", [True, False])
def test_sparse(base: bool) -> None:
    data = pack(sparse([1, 3], base=base), sparse_binary([1, 3]))
    rest = [[0, 1], [4, 5]] if base else [[0, 0], [0, 0]]
    got = glb.accessor(glb.decode(data), 0).tolist()
    assert got == [rest[0], [100, 101], rest[1], [102, 103]]
    assert glb.decode(data).binary[:32] == struct.pack("<8f", *range(8)), "the file's bytes stay as they are"


def test_real_file_as_trimesh_reads_it() -> None:
    path = shared("gltf/CesiumMan.glb")
    document = glb.decode(path.read_bytes(), path.name)
    mesh = next(iter(trimesh.load(path, process=False).geometry.values()))
    primitive = document.document["meshes"][0]["primitives"][0]
    assert np.array_equal(
        glb.accessor(document, primitive["attributes"]["POSITION"]), mesh.vertices.astype("f4")
    )
    assert np.array_equal(glb.accessor(document, primitive["indices"]).reshape(-1, 3), mesh.faces)
    assert all(len(glb.accessor(document, i)) for i in range(len(document.document["accessors"])))


DEEP = b"[" * 100_000 + b"]" * 100_000
GOOD = pack({"asset": {"version": "2.0"}}, b"1234")

BAD_FILES = {
    "empty": (b"", "is not a GLB file"),
    "another format": (b"ply\n" + GOOD, "is not a GLB file"),
    "version 1": (GOOD[:4] + struct.pack("<I", 1) + GOOD[8:], "is GLB version 1"),
    "truncated": (GOOD[:-1], f"says {len(GOOD)} bytes, but has {len(GOOD) - 1}"),
    "chunk too long": (GOOD[:12] + struct.pack("<I", 2**32 - 1) + GOOD[16:], "chunk 0: says 4294967295"),
    "binary first": (struct.pack("<4sIIII4s", b"glTF", 2, 24, 4, BIN, b"1234"), "does not begin with"),
    "many chunks": (
        struct.pack("<4sII", b"glTF", 2, 12 + 8 * 99) + struct.pack("<II", 0, JSON) * 99,
        "bytes after chunk 15",
    ),
    "no JSON": (pack(b"{nope"), "JSON: cannot be parsed"),
    "deep": (pack(DEEP), "JSON: cannot be parsed"),
    "NaN": (pack(b'{"a": NaN}'), "NaN is not JSON"),
    "a list": (pack([]), "JSON: is not an object"),
    "an extension": (pack({"extensionsRequired": ["KHR_draco_mesh_compression"]}), "cannot be read"),
}


@pytest.mark.parametrize("case", BAD_FILES)
def test_bad_files_are_named(case: str) -> None:
    data, message = BAD_FILES[case]
    with pytest.raises(AvatarError) as caught:
        glb.decode(data, "a.glb")
    assert str(caught.value).startswith("a.glb: ") and message in str(caught.value)


def test_json_too_large_is_refused_before_it_is_parsed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(glb, "MAX_JSON_BYTES", 100)
    with pytest.raises(AvatarError, match="up to 100 are read"):
        glb.decode(pack(b"{nope" + b" " * 100))


FLOATS = {"componentType": 5126, "count": 4, "type": "SCALAR"}
HUGE = 1 << 62

BAD_ACCESSORS: dict[str, tuple[dict[str, Any], dict[str, Any], str]] = {
    "past its view": (FLOATS | {"count": 5}, {}, "5 elements end at byte 20, but its bufferView has 16"),
    "absurd count of zeros": (FLOATS | {"count": HUGE, "bufferView": "-"}, {}, "zeros, but the file has 16"),
    "negative count": (FLOATS | {"count": -1}, {}, "count: -1 is not a whole number"),
    "negative offset": (FLOATS | {"byteOffset": -4}, {}, "byteOffset: -4 is not a whole number"),
    "unknown component": (FLOATS | {"componentType": 5124}, {}, "componentType: 5124 is not one of 5120"),
    "unknown type": (FLOATS | {"type": "MAT5"}, {}, "type: MAT5 is not one of SCALAR"),
    "normalised floats": (FLOATS | {"normalized": True}, {}, "normalized: goes with 8- and 16-bit integers"),
    "no such view": (FLOATS | {"bufferView": 7}, {}, "bufferViews[7]: does not exist"),
    "view past the buffer": (FLOATS, {"byteLength": 17}, "bufferViews[0]: ends at byte 17, but its buffer"),
    "view before the buffer": (FLOATS, {"byteOffset": -1}, "byteOffset: -1"),
    "stride too small": (FLOATS, {"byteStride": 3}, "elements of 4 bytes in a bufferView with byteStride 3"),
    "stride of zero": (FLOATS, {"byteStride": 0}, "byteStride: 0 is not 1..252"),
    "another buffer": (FLOATS, {"buffer": 1}, "buffers[1]: does not exist"),
    "compressed": (FLOATS, {"extensions": {"EXT_meshopt_compression": {}}}, "has extensions"),
}


@pytest.mark.parametrize("case", BAD_ACCESSORS)
def test_bad_accessors_are_named(case: str) -> None:
    accessor, view, message = BAD_ACCESSORS[case]
    document = small(bytes(16), accessor, **view)
    if document["accessors"][0]["bufferView"] == "-":
        del document["accessors"][0]["bufferView"]
    with pytest.raises(AvatarError) as caught:
        glb.accessor(glb.decode(pack(document, bytes(16)), "a.glb"), 0)
    assert str(caught.value).startswith("a.glb: ") and message in str(caught.value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"buffers": [{"byteLength": 16, "uri": "/etc/passwd"}]}, "lies outside the file"),
        ({"buffers": [{"byteLength": 99}]}, "99, but the binary chunk has 16 bytes"),
        ({"buffers": {}}, "buffers[0]: does not exist"),
        ({"bufferViews": [[]]}, "bufferViews[0]: is not an object"),
        ({"accessors": []}, "accessors[0]: does not exist"),
        ({"accessors": "no"}, "accessors[0]: does not exist"),
    ],
)
def test_bad_tables_are_named(change: dict[str, Any], message: str) -> None:
    document = small(bytes(16), FLOATS) | change
    with pytest.raises(AvatarError) as caught:
        glb.accessor(glb.decode(pack(document, bytes(16)), "a.glb"), 0)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("indices", "count", "message"),
    [
        ([1, 4], 4, "indices[1]: is 4, but the accessor has 4 elements"),
        ([2, 1], 4, "indices[1]: must strictly increase"),
        ([1, 1], 4, "indices[1]: must strictly increase"),
        ([0, 1, 2], 2, "sparse.count: is 3, but the accessor has 2 elements"),
    ],
)
def test_bad_sparse_is_named(indices: list[int], count: int, message: str) -> None:
    data = pack(sparse(indices, base=False, count=count), sparse_binary(indices))
    with pytest.raises(AvatarError) as caught:
        glb.accessor(glb.decode(data), 0)
    assert message in str(caught.value)
