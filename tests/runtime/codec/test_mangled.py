"""No bytes give the PLY and GLB codecs anything but a clean result or an AvatarError."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from avatar_runtime.codec import glb, ply
from tests.hostile import MANGLING, VALUES, mangled, only_avatar_errors
from tests.runtime.codec.test_glb import FLOATS, pack, small, sparse, sparse_binary
from tests.runtime.codec.test_ply import made

PLY = ply.encode(made(3, 1), ["comment"])
GLBS = (
    pack(sparse([1, 3], base=True), sparse_binary([1, 3])),
    pack(small(bytes(16), FLOATS, byteStride=4), bytes(16)),
)


def _read_ply(data: bytes) -> None:
    def read() -> None:
        gaussians = ply.gaussians(ply.decode(data, "a.ply"), "a.ply")
        assert gaussians.mean.shape == (gaussians.count, 3) and np.isfinite(gaussians.sh).all()

    only_avatar_errors(read)


def _read_glb(data: bytes) -> None:
    def read() -> None:
        document = glb.decode(data, "a.glb")
        for index in range(len(document.entries("accessors"))):
            assert glb.accessor(document, index).nbytes <= 16 * 4 * len(data)

    only_avatar_errors(read)


@MANGLING
@given(mangled(PLY))
def test_mangled_ply(data: bytes) -> None:
    _read_ply(data)


@MANGLING
@given(
    st.lists(st.sampled_from(PLY[: PLY.index(b"end_header")].splitlines()), max_size=40),
    st.binary(max_size=300),
)
def test_shuffled_ply_headers(lines: list[bytes], body: bytes) -> None:
    _read_ply(b"\n".join([b"ply", b"format binary_little_endian 1.0", *lines, b"end_header"]) + b"\n" + body)


@MANGLING
@given(st.sampled_from(GLBS).flatmap(mangled))
def test_mangled_glb(data: bytes) -> None:
    _read_glb(data)


KEYS = (
    "bufferView",
    "byteOffset",
    "componentType",
    "count",
    "type",
    "normalized",
    "sparse",
    "indices",
    "values",
)


@MANGLING
@given(
    st.sampled_from(KEYS),
    st.sampled_from(["accessors", "bufferViews", "buffers"]),
    st.sampled_from([*KEYS, "byteLength", "byteStride", "buffer", "uri", "extensions"]),
    VALUES,
    VALUES,
)
def test_any_json_value_anywhere(key: str, kind: str, other: str, first: Any, second: Any) -> None:
    document = json.loads(json.dumps(sparse([1, 3], base=True)))
    document["accessors"][0]["sparse"][key] = first
    document[kind][0][other] = second
    _read_glb(pack(document, sparse_binary([1, 3])))
