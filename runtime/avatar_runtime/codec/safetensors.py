"""safetensors, both directions: a JSON header, then raw little-endian arrays without holes.

Own code because the library copies every array on the way out; tests cross this codec with the library.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, TypeGuard

import numpy as np
import numpy.typing as npt

from avatar_runtime.codec import json_text
from avatar_runtime.io.errors import AvatarError

Array = npt.NDArray[Any]

DTYPES = {
    "F64": "<f8",
    "F32": "<f4",
    "F16": "<f2",
    "I64": "<i8",
    "I32": "<i4",
    "I16": "<i2",
    "I8": "|i1",
    "U64": "<u8",
    "U32": "<u4",
    "U16": "<u2",
    "U8": "|u1",
}
NAMES = {np.dtype(code): name for name, code in DTYPES.items()}
HEADER_LIMIT = 16 << 20


def encode(tensors: Mapping[str, Array]) -> Iterator[memoryview]:
    """The file's bytes in pieces: header, then each array without a copy where it is contiguous.

    Order: wide types first, then by name, so that every array is aligned. Same tensors, same bytes.
    """
    order = sorted(tensors, key=lambda name: (-tensors[name].dtype.itemsize, name))
    header: dict[str, Any] = {}
    at = 0
    for name in order:
        a = tensors[name]
        header[name] = {
            "dtype": NAMES[a.dtype.newbyteorder("<")],
            "shape": list(a.shape),
            "data_offsets": [at, at + a.nbytes],
        }
        at += a.nbytes
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 8)
    yield memoryview(len(text).to_bytes(8, "little") + text)
    for name in order:
        a = np.ascontiguousarray(tensors[name], tensors[name].dtype.newbyteorder("<"))
        if a.nbytes:
            yield a.reshape(-1).data.cast("B")


def decode(data: bytes | memoryview, file: str) -> dict[str, Array]:
    """Arrays by name, as read-only views on `data`. Raises AvatarError for anything out of order."""
    view = memoryview(data)
    if len(view) < 8:
        raise AvatarError(f"is {len(view)} bytes long; a safetensors file has at least 8", file=file)
    size = int.from_bytes(view[:8], "little")
    if size > min(HEADER_LIMIT, len(view) - 8):
        raise AvatarError(f"header claims {size} bytes of a file of {len(view)}", file=file)
    described = header(bytes(view[8 : 8 + size]), file)
    described.pop("__metadata__", None)
    body = view[8 + size :]
    arrays: dict[str, Array] = {}
    spans = []
    for name, entry in described.items():
        arrays[name], span = _tensor(name, entry, body, file)
        spans.append(span)
    at = 0
    for begin, end in sorted(spans):
        if begin != at:
            raise AvatarError(f"tensors leave a hole or overlap at byte {at}", file=file)
        at = end
    if at != len(body):
        raise AvatarError(f"tensors end at byte {at}, the file at {len(body)}", file=file)
    return arrays


def header(text: bytes, file: str) -> dict[str, Any]:
    """The JSON object before the tensors, metadata included. Raises AvatarError for anything else."""
    try:
        found = json_text.parse(text)
    except ValueError as error:
        raise AvatarError(f"header is not JSON ({error})", file=file) from None
    if not isinstance(found, dict):
        raise AvatarError("header is not a JSON object", file=file)
    return found


def _tensor(name: str, entry: Any, body: memoryview, file: str) -> tuple[Array, tuple[int, int]]:
    if not isinstance(entry, dict):
        raise AvatarError("is not a JSON object", file=file, field=name)
    dtype, shape, offsets = (entry.get(key) for key in ("dtype", "shape", "data_offsets"))
    if not isinstance(dtype, str) or dtype not in DTYPES:
        raise AvatarError(f"dtype {dtype!r} is not one of {', '.join(DTYPES)}", file=file, field=name)
    if not (_sizes(shape, 8) and _sizes(offsets, 2) and len(offsets) == 2):
        raise AvatarError("shape and data_offsets must be lists of counts", file=file, field=name)
    begin, end = offsets
    count, strides = 1, 1  # an array without elements still needs strides that NumPy can count
    for length in shape:
        count, strides = count * length, strides * max(length, 1)
    code = np.dtype(DTYPES[dtype])
    if not begin <= end <= len(body) or count * code.itemsize != end - begin or strides >= 1 << 56:
        raise AvatarError(
            f"{dtype}{shape} at bytes {begin}..{end} does not fit a body of {len(body)} bytes",
            file=file,
            field=name,
        )
    return np.frombuffer(body[begin:end], code).reshape(shape), (begin, end)


def _sizes(value: Any, most: int) -> TypeGuard[list[int]]:
    return (
        isinstance(value, list)
        and len(value) <= most
        and all(type(v) is int and 0 <= v < 1 << 48 for v in value)
    )
