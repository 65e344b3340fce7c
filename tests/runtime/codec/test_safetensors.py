"""The safetensors codec: crossed with the library both ways, to the byte, and against hostile files."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import safetensors.numpy

from avatar_runtime.codec.safetensors import DTYPES, HEADER_LIMIT, decode, encode
from avatar_runtime.io.errors import AvatarError

Array = npt.NDArray[Any]
TYPES = [np.dtype(code) for code in DTYPES.values()]


def whole(tensors: dict[str, Array]) -> bytes:
    return b"".join(encode(tensors))


def one_of_each() -> dict[str, Array]:
    """Every type; odd sizes, so that alignment matters; empty, scalar and Fortran-ordered arrays."""
    rng = np.random.default_rng(5)
    tensors = {
        str(t): rng.integers(0, 100, size=2 * i + 1).astype(t).reshape(1, -1) for i, t in enumerate(TYPES)
    }
    tensors["empty"] = np.zeros((0, 3), np.float32)
    tensors["scalar"] = np.array(7, np.uint16)
    tensors["fortran"] = np.asfortranarray(np.arange(12, dtype=np.float32).reshape(3, 4))
    tensors["big_endian"] = np.arange(5, dtype=">i4")
    tensors['name with "quotes" and ü'] = np.ones(3, np.uint8)
    return tensors


def same(a: dict[str, Array], b: dict[str, Array]) -> None:
    assert set(a) == set(b)
    for name, value in a.items():
        assert b[name].dtype == value.dtype.newbyteorder("="), name
        assert b[name].shape == value.shape, name
        assert np.array_equal(b[name], value), name


def test_the_library_reads_what_we_write() -> None:
    tensors = one_of_each()
    same(tensors, safetensors.numpy.load(whole(tensors)))


def test_we_read_what_the_library_writes() -> None:
    tensors = {name: np.ascontiguousarray(value) for name, value in one_of_each().items()}
    tensors["big_endian"] = tensors["big_endian"].astype("<i4")
    data = safetensors.numpy.save(tensors, metadata={"made": "by the library", "format": "np"})
    same(tensors, decode(data, "x"))


def test_golden_bytes() -> None:
    """Wide types first, then by name; the header padded with spaces to eight bytes."""
    tensors = {
        "b": np.array([1, 2, 3], np.uint16),
        "c": np.array([[1.5]], np.float32),
        "a": np.array([9], np.uint16),
    }
    header = (
        b'{"c":{"dtype":"F32","shape":[1,1],"data_offsets":[0,4]},'
        b'"a":{"dtype":"U16","shape":[1],"data_offsets":[4,6]},'
        b'"b":{"dtype":"U16","shape":[3],"data_offsets":[6,12]}}'
    )
    header += b" " * (-len(header) % 8)
    expected = struct.pack("<Q", len(header)) + header + struct.pack("<f4H", 1.5, 9, 1, 2, 3)
    assert whole(tensors) == expected
    assert whole(dict(reversed(tensors.items()))) == expected


def test_every_array_is_aligned_and_read_without_a_copy() -> None:
    data = whole(one_of_each())
    (header,) = struct.unpack("<Q", data[:8])
    assert header % 8 == 0
    for entry in json.loads(data[8 : 8 + header]).values():
        assert entry["data_offsets"][0] % np.dtype(DTYPES[entry["dtype"]]).itemsize == 0
    arrays = decode(data, "x")
    buffer = np.frombuffer(data, np.uint8)
    assert all(np.shares_memory(a, buffer) for a in arrays.values() if a.size)
    assert not any(a.flags.writeable for a in arrays.values())


def file_of(header: Any, body: bytes = b"", claimed: int | None = None) -> bytes:
    text = header if isinstance(header, bytes) else json.dumps(header).encode()
    return struct.pack("<Q", len(text) if claimed is None else claimed) + text + body


def entry(dtype: Any = "F32", shape: Any = (1,), offsets: Any = (0, 4)) -> dict[str, Any]:
    return {"a": {"dtype": dtype, "shape": shape, "data_offsets": offsets}}


BODY = b"\0" * 4
HOSTILE = {
    "short": (b"\0" * 7, "at least 8"),
    "header longer than the file": (file_of({}, claimed=100), "header claims"),
    "header beyond the limit": (file_of(b" " * (HEADER_LIMIT + 1) + b"{}"), "header claims"),
    "not JSON": (file_of(b"{"), "not JSON"),
    "not UTF-8": (file_of(b'{"\xff": 1}'), "not JSON"),
    "nested too deep": (file_of(b"[" * 100_000), "not JSON"),
    "a list": (file_of([]), "not a JSON object"),
    "entry without fields": (file_of({"a": {}}), "dtype None"),
    "unknown type": (file_of(entry("BF16"), BODY), "dtype 'BF16'"),
    "shape is a number": (file_of(entry(shape=1), BODY), "lists of counts"),
    "negative length": (file_of(entry(shape=[-1]), BODY), "lists of counts"),
    "fractional length": (file_of(entry(shape=[1.5]), BODY), "lists of counts"),
    "a length of 2^48": (file_of(entry(shape=[1 << 48]), BODY), "lists of counts"),
    "three offsets": (file_of(entry(offsets=[0, 4, 4]), BODY), "lists of counts"),
    "offsets beyond the file": (file_of(entry(offsets=[4, 8]), BODY), "does not fit"),
    "shape smaller than its bytes": (file_of(entry(shape=[0]), BODY), "does not fit"),
    "a product beyond 64 bits": (file_of(entry(shape=[1 << 40, 1 << 40]), BODY), "does not fit"),
    "strides beyond 64 bits": (file_of(entry(shape=[0, 1 << 47, 1 << 47], offsets=[0, 0])), "does not fit"),
    "bytes after the last": (file_of(entry(), BODY + b"\0"), "end at byte 4"),
    "a hole before the first": (file_of(entry(offsets=[4, 8]), BODY * 2), "hole or overlap at byte 0"),
    "a line break in a name": (file_of({"a\nb": 3}), "a b: is not"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_hostile_headers_are_refused(name: str) -> None:
    data, message = HOSTILE[name]
    with pytest.raises(AvatarError) as caught:
        decode(data, "rig.safetensors")
    assert message in str(caught.value)
    assert "rig.safetensors" in str(caught.value)
    assert "\n" not in str(caught.value)
