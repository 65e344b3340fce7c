"""A binary glTF file: pygltflib's document, and arrays that are copied only when they are written."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt
import pygltflib as gltf

from avatar_export.version import GENERATOR
from avatar_runtime.codec.glb import BINARY_CHUNK, COMPONENTS, JSON_CHUNK, SHAPES
from avatar_runtime.io.errors import AvatarError

Array = npt.NDArray[Any]

COMPONENT_TYPE = {np.dtype(name): component for component, name in COMPONENTS.items()}
ELEMENT_TYPE = {shape: name for name, shape in SHAPES.items() if name not in ("MAT2", "MAT3")}
MOST_BYTES = (1 << 32) - 1  # the length of a GLB is u32
# Defaults of glTF that pygltflib writes. They are left out, so that the file depends less on pygltflib's version, and
# because the Khronos validator refuses an offset without a buffer view, as in sparse accessors.
DEFAULTS = {"byteOffset": 0, "normalized": False}


class GlbBuilder:
    """Collects arrays and a glTF document around them; `pieces` gives the bytes of the .glb."""

    def __init__(self, name: str) -> None:
        """`name` is that of the file, for errors."""
        self.name = name
        self.document = gltf.GLTF2(asset=gltf.Asset(version="2.0", generator=GENERATOR), scene=0)
        self._arrays: list[Array] = []
        self._size = 0

    def accessor(
        self, array: Array, target: int | None = None, *, bounds: bool = False, normalized: bool = False
    ) -> int:
        """Index of an accessor of a filled array [count, ...] of float32, u8, u16 or u32; [count, row, column]
        for matrices. `target` as in glTF's buffer views; `bounds` writes min and max.
        """
        stored = array.swapaxes(1, 2) if array.ndim == 3 else array  # glTF stores matrices by column
        item = _accessor(array.dtype, len(array), array.shape[1:])
        item.bufferView, item.normalized = self._view(stored, target), normalized
        return self._add(item, array if bounds else None)

    def sparse(self, count: int, rows: Array, values: Array) -> int:
        """Index of a float accessor [count, ...] of zeros, except `values` [n, ...] in `rows` [n], which increase; with
        min and max. Without rows it stores row 0 as zeros, since some importers refuse an accessor without data.
        """
        if not len(rows):
            rows, values = np.zeros(1, np.int64), np.zeros((1, *values.shape[1:]), np.float32)
        index = rows.astype(np.uint16 if count <= 1 << 16 else np.uint32)
        item = _accessor(values.dtype, count, values.shape[1:])
        item.sparse = gltf.Sparse(
            count=len(rows),
            indices=gltf.AccessorSparseIndices(
                bufferView=self._view(index), componentType=COMPONENT_TYPE[index.dtype]
            ),
            values=gltf.AccessorSparseValues(bufferView=self._view(values)),
        )
        rest = np.zeros((1 if len(rows) < count else 0, *values.shape[1:]), np.float32)
        substituted = np.concatenate([values, rest])
        return self._add(item, substituted)

    def pieces(self) -> Iterator[bytes | memoryview]:
        """The bytes of the file, one piece per array. Raises AvatarError if they are more than a GLB can hold."""
        self.document.buffers = [gltf.Buffer(byteLength=self._size)]
        document = _without_defaults(json.loads(self.document.to_json(allow_nan=False)))
        text = json.dumps(document, separators=(",", ":")).encode()
        text += b" " * (-len(text) % 4)
        length = 12 + 8 + len(text) + 8 + self._size
        if length > MOST_BYTES:
            raise AvatarError(
                f"has {length} bytes, but a GLB holds at most {MOST_BYTES}; write the bundle without engine files",
                file=self.name,
            )
        yield struct.pack("<4sII", b"glTF", 2, length)
        yield struct.pack("<II", len(text), JSON_CHUNK) + text + struct.pack("<II", self._size, BINARY_CHUNK)
        for array in self._arrays:
            contiguous = np.ascontiguousarray(array, array.dtype.newbyteorder("<"))
            yield contiguous.data.cast("B")
            if contiguous.nbytes % 4:
                yield b"\0" * (-contiguous.nbytes % 4)

    def _view(self, array: Array, target: int | None = None) -> int:
        """Index of a buffer view that holds `array`."""
        view = gltf.BufferView(buffer=0, byteOffset=self._size, byteLength=array.nbytes, target=target)
        self.document.bufferViews.append(view)
        self._arrays.append(array)
        self._size += array.nbytes + -array.nbytes % 4
        return len(self.document.bufferViews) - 1

    def _add(self, item: gltf.Accessor, bounded: Array | None) -> int:
        if bounded is not None:
            values = bounded.reshape(len(bounded), -1)
            item.min, item.max = values.min(axis=0).tolist(), values.max(axis=0).tolist()
        self.document.accessors.append(item)
        return len(self.document.accessors) - 1


def _accessor(dtype: np.dtype[Any], count: int, shape: tuple[int, ...]) -> gltf.Accessor:
    return gltf.Accessor(componentType=COMPONENT_TYPE[dtype], count=count, type=ELEMENT_TYPE[shape])


def _without_defaults(value: Any) -> Any:
    if isinstance(value, dict):
        kept = {key: _without_defaults(item) for key, item in value.items()}
        return {key: item for key, item in kept.items() if key not in DEFAULTS or item != DEFAULTS[key]}
    return [_without_defaults(item) for item in value] if isinstance(value, list) else value
