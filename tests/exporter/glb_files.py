"""Binary glTF files, written field by field."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

COMPONENTS = {"u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class Builder:
    """Collects accessors of one binary chunk; `document` is the glTF around it."""

    def __init__(self, **document: Any) -> None:
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "accessors": [],
            "bufferViews": [],
            **document,
        }
        self.binary = b""

    def view(self, values: npt.NDArray[Any]) -> int:
        data = np.ascontiguousarray(values).tobytes()
        self.binary += b"\0" * (-len(self.binary) % 4)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        self.binary += data
        self.document["bufferViews"].append(view)
        return len(self.document["bufferViews"]) - 1

    def _accessor(self, kind: str, count: int, code: int, **extra: Any) -> int:
        self.document["accessors"].append({"componentType": code, "type": kind, "count": count, **extra})
        return len(self.document["accessors"]) - 1

    def add(self, values: Any, kind: str, dtype: str | None = None, **extra: Any) -> int:
        array = np.asarray(values, dtype)
        view, count = self.view(array), array.size // WIDTHS[kind]
        return self._accessor(kind, count, COMPONENTS[array.dtype.str[1:]], bufferView=view, **extra)

    def add_sparse(self, values: npt.NDArray[Any]) -> int:
        rows = np.flatnonzero(values.any(axis=1))
        indices = {"bufferView": self.view(rows.astype("<u2")), "componentType": 5123}
        sparse = {"count": len(rows), "indices": indices, "values": {"bufferView": self.view(values[rows])}}
        return self._accessor("VEC3", len(values), 5126, sparse=sparse)

    def data(self) -> bytes:
        self.document["buffers"] = [{"byteLength": len(self.binary)}]
        return packed(self.document, struct.pack("<I4s", len(self.binary), b"BIN\0") + self.binary)

    def write(self, path: Path) -> Path:
        path.write_bytes(self.data())
        return path


def packed(document: dict[str, Any], rest: bytes) -> bytes:
    """A GLB of a document and the chunks after it."""
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text) + len(rest), len(text), b"JSON") + text + rest


def edited(data: bytes, change: Callable[[dict[str, Any]], object]) -> bytes:
    """A GLB whose JSON document `change` has altered in place."""
    length = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + length])
    change(document)
    return packed(document, data[20 + length :])
