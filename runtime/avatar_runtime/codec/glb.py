"""GLB, read strictly: the JSON chunk as a document, accessors of the binary chunk as arrays.

Everything is checked against the bytes of the file before anything is allocated; nothing outside the file
is ever opened (a buffer or image by uri is refused when it is asked for).
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, NoReturn, TypeGuard

import numpy as np
import numpy.typing as npt

from avatar_runtime.io.errors import AvatarError

MAX_JSON_BYTES = 32 << 20
READABLE_EXTENSIONS = (
    "KHR_mesh_quantization",
    "KHR_materials_unlit",
    "KHR_texture_transform",
)  # of those required
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942
COMPONENTS = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
INDEX_COMPONENTS = (5121, 5123, 5125)
NORMALISED_DIVISORS = {"i1": 127.0, "u1": 255.0, "i2": 32767.0, "u2": 65535.0}
SHAPES: Mapping[str, tuple[int, ...]] = {
    "SCALAR": (),
    "VEC2": (2,),
    "VEC3": (3,),
    "VEC4": (4,),
    "MAT2": (2, 2),
    "MAT3": (3, 3),
    "MAT4": (4, 4),
}
MAX_STRIDE = 252
MAX_CHUNKS = 16  # the first two are read

Array = npt.NDArray[Any]
MOST_ENTRIES = 65_536  # nodes, accessors, ... of one file


@dataclass(frozen=True)
class Glb:
    """A GLB file: the JSON document unchanged, and the bytes of its binary chunk."""

    document: Mapping[str, Any]
    binary: memoryview
    file: object = None  # named in errors

    def entry(self, kind: str, index: object) -> dict[str, Any]:
        """document[kind][index], which must be an object. Raises AvatarError."""
        entries = self.document.get(kind, [])
        if not isinstance(entries, list) or not is_count(index) or index >= len(entries):
            self.fail(f"{kind}[{short(index)}]", "does not exist")
        if not isinstance(entries[index], dict):
            self.fail(f"{kind}[{index}]", "is not an object")
        found: dict[str, Any] = entries[index]
        return found

    def entries(self, kind: str) -> list[dict[str, Any]]:
        """All of document[kind], objects each; empty where there are none. Raises AvatarError."""
        entries = self.document.get(kind, [])
        if not isinstance(entries, list):
            self.fail(kind, "is not a list")
        if len(entries) > MOST_ENTRIES:
            self.fail(kind, f"has {len(entries)} entries, at most {MOST_ENTRIES} are read")
        return [self.entry(kind, index) for index in range(len(entries))]

    def fail(self, field: str, message: str) -> NoReturn:
        """Raise AvatarError about `field` of this file."""
        raise AvatarError(message, file=self.file, field=field)


def decode(data: bytes | memoryview, file: object = None) -> Glb:
    """The document and binary chunk of GLB version 2. Raises AvatarError for anything that is not that."""
    view = memoryview(data).cast("B")
    if len(view) < 20 or bytes(view[:4]) != b"glTF":
        raise AvatarError("is not a GLB file", file=file)
    version, length = struct.unpack_from("<II", view, 4)
    if version != 2:
        raise AvatarError(f"is GLB version {version}; version 2 is read", file=file)
    if length != len(view):
        raise AvatarError(f"says {length} bytes, but has {len(view)}", file=file)
    chunks = _chunks(view, file)
    if chunks[0][0] != JSON_CHUNK:
        raise AvatarError("does not begin with its JSON chunk", file=file)
    binary = chunks[1][1] if len(chunks) > 1 and chunks[1][0] == BINARY_CHUNK else view[:0]
    glb = Glb(_document(chunks[0][1], file), binary, file)
    required = glb.document.get("extensionsRequired", [])
    for name in required if isinstance(required, list) else [required]:
        if name not in READABLE_EXTENSIONS:
            glb.fail("extensionsRequired", f"{short(name)} cannot be read; export without it")
    return glb


def accessor(glb: Glb, index: object) -> Array:
    """Accessor `index` as an array [count], [count, n] or, for matrices, [count, row, column].

    Integers stay integers, normalised ones become float32; views of the file where that is possible. Raises
    AvatarError for anything that points outside the file, has an unknown type or is not what glTF 2.0 allows.
    """
    a = glb.entry("accessors", index)
    where = f"accessors[{index}]"
    count = _count(glb, a, "count", where)
    dtype = _dtype(glb, a.get("componentType"), COMPONENTS, where)
    kind = a.get("type")
    if not isinstance(kind, str) or kind not in SHAPES:
        glb.fail(f"{where}.type", f"{short(kind)} is not one of {', '.join(SHAPES)}")
    shape = SHAPES[kind]
    if "bufferView" in a:
        values = _strided(glb, a, count, dtype, shape, where)
    else:
        # Zeros take no bytes in the file; the data that they belong to takes at least a byte per element elsewhere.
        if count > len(glb.binary):
            glb.fail(f"{where}.count", f"{count} zeros, but the file has {len(glb.binary)} bytes")
        values = np.zeros((count, *shape), dtype)
    if "sparse" in a:
        values = _with_sparse(glb, a["sparse"], values, shape, where)
    if len(shape) == 2:
        values = values.swapaxes(1, 2)  # stored by column
    return _normalised(glb, values, where) if a.get("normalized") is True else values


def is_count(value: object) -> TypeGuard[int]:
    """Whether a JSON value is a whole number >= 0 that fits 64 bits (true and 1.0 are not)."""
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1 << 63


def short(value: object) -> str:
    """A JSON value as a few ASCII characters, for messages."""
    if isinstance(value, int) and abs(value) >= 1 << 64:
        return "a huge number"
    text = (
        value
        if isinstance(value, str)
        else type(value).__name__
        if isinstance(value, list | dict)
        else repr(value)
    )
    text = text if len(text) <= 60 else text[:57] + "..."
    return ascii(text)[1:-1]


def _chunks(view: memoryview, file: object) -> list[tuple[int, memoryview]]:
    chunks: list[tuple[int, memoryview]] = []
    at = 12
    while at < len(view):
        if len(view) - at < 8 or len(chunks) == MAX_CHUNKS:
            raise AvatarError(f"{len(view) - at} bytes after chunk {len(chunks) - 1}", file=file)
        size, kind = struct.unpack_from("<II", view, at)
        if size > len(view) - at - 8:
            raise AvatarError(
                f"says {size} bytes, but {len(view) - at - 8} follow", file=file, field=f"chunk {len(chunks)}"
            )
        chunks.append((kind, view[at + 8 : at + 8 + size]))
        at += 8 + size
    return chunks


def _document(chunk: memoryview, file: object) -> dict[str, Any]:
    if len(chunk) > MAX_JSON_BYTES:
        raise AvatarError(
            f"is {len(chunk)} bytes long; up to {MAX_JSON_BYTES} are read", file=file, field="JSON"
        )

    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"{constant} is not JSON")

    try:
        document = json.loads(bytes(chunk).decode("utf-8"), parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        raise AvatarError(f"cannot be parsed: {error}", file=file, field="JSON") from None
    if not isinstance(document, dict):
        raise AvatarError("is not an object", file=file, field="JSON")
    return document


def _count(glb: Glb, owner: Mapping[str, Any], key: str, where: str, default: int | None = None) -> int:
    value = owner.get(key, default)
    if not is_count(value):
        glb.fail(f"{where}.{key}", f"{short(value)} is not a whole number >= 0")
    return value


def _dtype(glb: Glb, component: object, allowed: Collection[int], where: str) -> np.dtype[Any]:
    known = [c for c in COMPONENTS if c in allowed]
    if not is_count(component) or component not in known:
        glb.fail(f"{where}.componentType", f"{short(component)} is not one of {', '.join(map(str, known))}")
    return np.dtype(COMPONENTS[component])


def _region(glb: Glb, index: object, where: str) -> tuple[int, int, int | None]:
    """(first byte, length, byteStride or None) of a bufferView in the binary chunk."""
    view = glb.entry("bufferViews", index)
    name = f"bufferViews[{index}]"
    if view.get("extensions"):
        glb.fail(name, "has extensions, such as a compression, that cannot be read; export without them")
    number = _count(glb, view, "buffer", name)
    buffer = glb.entry("buffers", number)
    if number != 0 or "uri" in buffer:
        glb.fail(f"buffers[{number}]", "lies outside the file; save as one .glb")
    size = _count(glb, buffer, "byteLength", "buffers[0]")
    if size > len(glb.binary):
        glb.fail("buffers[0].byteLength", f"{size}, but the binary chunk has {len(glb.binary)} bytes")
    first, length = _count(glb, view, "byteOffset", name, 0), _count(glb, view, "byteLength", name)
    if first + length > size:
        glb.fail(name, f"ends at byte {first + length}, but its buffer has {size} (asked by {where})")
    stride = view.get("byteStride")
    if stride is not None and not (is_count(stride) and 0 < stride <= MAX_STRIDE):
        glb.fail(f"{name}.byteStride", f"{short(stride)} is not 1..{MAX_STRIDE}")
    return first, length, stride


def _strided(
    glb: Glb, owner: Mapping[str, Any], count: int, dtype: np.dtype[Any], shape: tuple[int, ...], where: str
) -> Array:
    """A view of `count` elements of `shape` in the bufferView of `owner`; matrices as stored, by column."""
    first, length, stride = _region(glb, owner.get("bufferView"), where)
    offset = _count(glb, owner, "byteOffset", where, 0)
    inner = [dtype.itemsize * math.prod(shape[axis + 1 :]) for axis in range(len(shape))]
    if len(shape) == 2:
        inner[0] = -(-inner[0] // 4) * 4  # each column of a matrix begins on four bytes
    size = shape[0] * inner[0] if shape else dtype.itemsize
    step = size if stride is None else stride
    if step < size:
        glb.fail(where, f"has elements of {size} bytes in a bufferView with byteStride {step}")
    if not count:
        return np.zeros((0, *shape), dtype)
    end = offset + step * (count - 1) + size
    if end > length:
        glb.fail(where, f"{count} elements end at byte {end}, but its bufferView has {length}")
    return np.ndarray((count, *shape), dtype, glb.binary, first + offset, (step, *inner))


def _with_sparse(glb: Glb, sparse: object, base: Array, shape: tuple[int, ...], where: str) -> Array:
    """A copy of `base` with the rows that `sparse` lists replaced."""
    where = f"{where}.sparse"
    if not isinstance(sparse, dict):
        glb.fail(where, "is not an object")
    indices, values = sparse.get("indices"), sparse.get("values")
    if not isinstance(indices, dict) or not isinstance(values, dict):
        glb.fail(where, "needs the objects indices and values")
    count = _count(glb, sparse, "count", where)
    if count > len(base):
        glb.fail(f"{where}.count", f"is {count}, but the accessor has {len(base)} elements")
    kind = _dtype(glb, indices.get("componentType"), INDEX_COMPONENTS, f"{where}.indices")
    rows = _strided(glb, indices, count, kind, (), f"{where}.indices").astype(np.int64)
    replacement = _strided(glb, values, count, base.dtype, shape, f"{where}.values")
    if count and int(rows.max()) >= len(base):
        at = int(np.argmax(rows >= len(base)))
        glb.fail(f"{where}.indices[{at}]", f"is {int(rows[at])}, but the accessor has {len(base)} elements")
    if (np.diff(rows) <= 0).any():
        at = int(np.argmax(np.diff(rows) <= 0)) + 1
        glb.fail(f"{where}.indices[{at}]", "must strictly increase")
    result = base.copy()
    result[rows] = replacement
    return result


def _normalised(glb: Glb, values: Array, where: str) -> Array:
    divisor = NORMALISED_DIVISORS.get(values.dtype.str[1:])
    if divisor is None:
        glb.fail(f"{where}.normalized", "goes with 8- and 16-bit integers only")
    return np.maximum(values.astype(np.float64) / divisor, -1.0).astype(np.float32)
