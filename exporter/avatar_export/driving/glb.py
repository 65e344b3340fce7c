"""Reads the container, JSON and accessors of a binary glTF 2.0 (.glb), every size checked before use.

Only what animation clips need: data inside the file, no external buffers, no sparse accessors.
"""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from avatar_export.driving.checks import read_bytes, shown
from avatar_runtime.avatar import F64
from avatar_runtime.errors import AvatarError

MAX_FILE_BYTES = 512 << 20
MAX_JSON_BYTES = 64 << 20

_HEADER = struct.Struct("<4sII")
_CHUNK = struct.Struct("<I4s")
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


class Component(NamedTuple):
    """A component type and what a normalised integer is divided by."""

    dtype: np.dtype[Any]
    divisor: float


COMPONENTS = {
    5120: Component(np.dtype("i1"), 127.0),
    5121: Component(np.dtype("u1"), 255.0),
    5122: Component(np.dtype("<i2"), 32767.0),
    5123: Component(np.dtype("<u2"), 65535.0),
    5126: Component(np.dtype("<f4"), 1.0),
}


@dataclass(frozen=True)
class Glb:
    """The JSON and the binary chunk of a .glb."""

    document: dict[str, Any]
    binary: bytes
    source: str

    def error(self, message: str, field: str) -> AvatarError:
        return AvatarError(message, file=self.source, field=field)

    def entries(self, key: str) -> list[dict[str, Any]]:
        """The top-level list `key` ([] if absent), each entry an object."""
        return objects(self, self.document, key, "")

    def entry(self, key: str, index: object, field: str) -> dict[str, Any]:
        """Entry `index` of the top-level list `key`; `field` is what refers to it."""
        entries = self.entries(key)
        if not isinstance(index, int) or isinstance(index, bool) or not 0 <= index < len(entries):
            raise self.error(f"{shown(index)} is none of {len(entries)} {key}", field)
        return entries[index]


def read_glb(path: Path | str) -> Glb:
    """The .glb file at `path`. Raises AvatarError for anything but a whole binary glTF 2.x."""
    source = Path(path).name
    data = read_bytes(Path(path), MAX_FILE_BYTES)
    if len(data) < _HEADER.size or data[:4] != b"glTF":
        raise AvatarError("is no binary glTF (.glb)", file=source)
    _, version, length = _HEADER.unpack_from(data)
    if version != 2 or length > len(data):
        raise AvatarError(f"version {version} of {length} bytes in a file of {len(data)}", file=source)
    chunks = _chunks(data[:length], source)
    if not chunks or chunks[0][0] != b"JSON" or len(chunks[0][1]) > MAX_JSON_BYTES:
        raise AvatarError(f"must begin with a JSON chunk of at most {MAX_JSON_BYTES >> 20} MiB", file=source)
    try:
        document = json.loads(chunks[0][1])
    except (ValueError, RecursionError) as error:
        raise AvatarError(f"its JSON is damaged: {error}", file=source) from None
    if not isinstance(document, dict):
        raise AvatarError("its JSON is no object", file=source)
    binary = chunks[1][1] if len(chunks) > 1 and chunks[1][0] == b"BIN\0" else b""
    return Glb(document, binary, source)


def _chunks(data: bytes, source: str) -> list[tuple[bytes, bytes]]:
    chunks: list[tuple[bytes, bytes]] = []
    at = _HEADER.size
    while at < len(data):
        if at + _CHUNK.size > len(data):
            raise AvatarError("ends inside a chunk header", file=source)
        size, kind = _CHUNK.unpack_from(data, at)
        at += _CHUNK.size
        if size > len(data) - at:
            raise AvatarError(f"chunk {len(chunks)}: {size} bytes said, {len(data) - at} left", file=source)
        chunks.append((kind, data[at : at + size]))
        at += size
    return chunks


def objects(glb: Glb, owner: dict[str, Any], key: str, field: str) -> list[dict[str, Any]]:
    """The list `key` of `owner` ([] if absent), each entry an object."""
    found = owner.get(key, [])
    if not isinstance(found, list) or not all(isinstance(entry, dict) for entry in found):
        raise glb.error("must be a list of objects", f"{field}{key}")
    return found


def accessor(glb: Glb, index: object, kind: str, field: str) -> F64:
    """Accessor `index`, which must be of type `kind`, as [count, width]; normalised integers are divided."""
    entry = glb.entry("accessors", index, field)
    field = f"accessors[{index}]"
    if entry.get("sparse") is not None or "bufferView" not in entry:
        raise glb.error("is sparse or empty, which this reader does not take in a clip", field)
    if entry.get("type") != kind:
        raise glb.error(f"type {shown(entry.get('type'))}, expected {kind}", field)
    component = COMPONENTS.get(natural(glb, entry, "componentType", field))
    if component is None or (component.divisor != 1 and entry.get("normalized") is not True):
        raise glb.error("components must be float or normalised integers of 8 or 16 bits", field)
    count, width = natural(glb, entry, "count", field), WIDTHS[kind]
    view = glb.entry("bufferViews", entry["bufferView"], field)
    if view.get("buffer") != 0 or "uri" in glb.entry("buffers", 0, field):
        raise glb.error("must lie in the binary chunk of the .glb", field)
    row = width * component.dtype.itemsize
    stride = natural(glb, view, "byteStride", field, row) or row
    first = natural(glb, view, "byteOffset", field, 0) + natural(glb, entry, "byteOffset", field, 0)
    within = natural(glb, entry, "byteOffset", field, 0) + (count - 1) * stride + row
    ends = first + (count - 1) * stride + row
    if (
        count < 1
        or within > natural(glb, view, "byteLength", field)
        or ends > len(glb.binary)
        or stride < row
    ):
        raise glb.error(f"{count} elements do not fit their buffer view or the file", field)
    raw: Any = np.ndarray(
        (count, width), component.dtype, glb.binary, first, (stride, component.dtype.itemsize)
    )
    return (
        np.maximum(raw.astype(np.float64) / component.divisor, -1.0) if component.divisor != 1 else raw * 1.0
    )


def natural(glb: Glb, owner: dict[str, Any], key: str, field: str, default: int | None = None) -> int:
    """The integer >= 0 at `key`."""
    value = owner.get(key, default)
    if not isinstance(value, int) or isinstance(value, bool) or value < 0 or value > 1 << 53:
        raise glb.error("must be an integer that is not negative", f"{field}.{key}")
    return value


def numbers(glb: Glb, owner: dict[str, Any], key: str, default: tuple[float, ...], field: str) -> F64:
    """The list of finite numbers at `key`, as long as `default`, which stands in for an absent one."""
    value = owner.get(key, default)
    plain = isinstance(value, list | tuple) and len(value) == len(default)
    if not plain or not all(isinstance(v, int | float) and abs(v) < 1e30 for v in value):
        raise glb.error(f"must be {len(default)} finite numbers", f"{field}.{key}")
    return np.array(value, np.float64)
