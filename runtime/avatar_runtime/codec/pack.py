"""NAME.avatar, both directions: gzip around a safetensors body whose metadata is one JSON document, `pack`.

SPEC.md section 18 defines every field. Nothing is trusted until `decode` returns: sizes are checked before memory is
taken; `program.check` then checks what kernels would touch.
"""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeGuard

import numpy as np
import numpy.typing as npt

from avatar_runtime.codec import json_text
from avatar_runtime.codec.gzip_pieces import GzipWriter
from avatar_runtime.codec.program import program_document, read_program
from avatar_runtime.codec.sections import BITS, incidence
from avatar_runtime.codec.sections import decode as decode_section
from avatar_runtime.codec.sections import encode as encode_section
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.model import Buffer, Program, Section
from avatar_runtime.program.passes import SHADERS
from avatar_schema.validate import schema_problems, version_problems

MAGIC = b"\x1f\x8b"  # gzip
METADATA = "pack"
HEADER_LIMIT = 16 << 20  # bytes of JSON
HEADER_LEAST, HEADER_RATIO = 1 << 16, 16  # bytes of JSON of any file, and further ones a byte of the file
BODY_LIMIT = 1 << 30  # bytes, inflated
MOST_RATIO = 400  # inflated bytes a byte of the file; gzip reaches 1032 on zeros alone
GZIP = 16 + zlib.MAX_WBITS  # what zlib calls the gzip format
Array = npt.NDArray[Any]
TYPES = {"f32": np.float32, "u8": np.uint8, "u16": np.uint16, "u32": np.uint32, "i32": np.int32}
TYPE_NAMES = {np.dtype(kind): name for name, kind in TYPES.items()}


@dataclass(frozen=True)
class PackFile:
    """What a pack holds, decoded: the document without its lists of buffers and passes, the program, other arrays."""

    document: Mapping[str, Any]  # as pack.schema.json has it
    program: Program
    arrays: Mapping[str, Array] = field(default_factory=dict)  # rig.*, clips.*, preview: what no buffer holds


def encode(pack: PackFile, order: tuple[str, ...] = ()) -> tuple[bytes, dict[str, int]]:
    """(the file, {tensor: its deflated bytes}): the arrays that `order` names, buffers, the other arrays."""
    writer = _Writer()
    arrays = {name: writer.array(name, pack.arrays[name]) for name in order}
    buffers = [writer.buffer(buffer) for buffer in pack.program.buffers.values()]
    rest = [name for name in pack.arrays if name not in order]
    arrays |= {name: writer.array(name, pack.arrays[name]) for name in rest}
    document = {
        **pack.document,
        "program": program_document(pack.program) | {"buffers": buffers},
        "arrays": arrays,
    }
    text = json.dumps(document, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
    return writer.file(text)


class _Writer:
    """Tensors in the order in which they come; equal contents are stored once."""

    def __init__(self) -> None:
        self.tensors: dict[str, bytes] = {}
        self._names: dict[bytes, str] = {}

    def store(self, name: str, data: bytes) -> str:
        if len(data) < 64:  # too short to be worth sharing
            self.tensors[name] = data
            return name
        return self._names.setdefault(data, name) if data in self._names else self._new(name, data)

    def _new(self, name: str, data: bytes) -> str:
        self._names[data] = name
        self.tensors[name] = data
        return name

    def array(self, name: str, array: Array) -> dict[str, Any]:
        flat = np.ascontiguousarray(array).reshape(-1)
        bits = 8 * array.itemsize
        codec = "planes" if flat.size and bits > 8 else "raw"
        data = encode_section(flat.view(BITS[bits]), codec)
        return {
            "tensor": self.store(name, data),
            "type": TYPE_NAMES[array.dtype],
            "shape": list(array.shape),
            "codec": codec,
        }

    def buffer(self, buffer: Buffer) -> dict[str, Any]:
        if not buffer.sections:
            return {"name": buffer.name, "bytes": buffer.size}
        return {"name": buffer.name, "sections": [self.section(buffer.name, s) for s in buffer.sections]}

    def section(self, buffer: str, s: Section) -> dict[str, Any]:
        said: dict[str, Any] = {"name": s.name, "bits": s.width, "count": len(s.elements), "codec": s.codec}
        if s.codec == "planes" and s.record != 1:
            said["record"] = s.record
        if s.codec != "incidence":
            said["tensor"] = self.store(f"{buffer}/{s.name}", encode_section(s.elements, s.codec, s.record))
        return said

    def file(self, text: str) -> tuple[bytes, dict[str, int]]:
        header: dict[str, Any] = {"__metadata__": {METADATA: text}}
        at = 0
        for name, data in self.tensors.items():
            header[name] = {"dtype": "U8", "shape": [len(data)], "data_offsets": [at, at + len(data)]}
            at += len(data)
        head = json.dumps(header, separators=(",", ":"), ensure_ascii=False).encode()
        head += b" " * (-len(head) % 8)
        out, sizes = GzipWriter(), {}
        sizes["document"] = out.add(len(head).to_bytes(8, "little") + head)
        for name, data in self.tensors.items():
            sizes[name] = out.add(data)
        return out.done(), sizes


def decode(data: bytes, file: str) -> PackFile:
    """A pack. Raises AvatarError for anything out of order; the program is not yet checked."""
    header, body = inflate(data, file)
    document = _json(header.document, f"document {METADATA!r}", file)
    _check(document, file)
    _check_clips(document["avatar"], limit_of(data), file)
    tensors = {name: body[begin:end] for name, (begin, end) in header.tensors.items()}
    try:
        reader = _Reader(tensors, min(2 * BODY_LIMIT, MOST_RATIO * len(data)))
        buffers = reader.buffers(document["program"]["buffers"])
        arrays = {name: reader.array(name, said) for name, said in document["arrays"].items()}
    except AvatarError as error:
        raise AvatarError(error.message, file=file, field=error.field) from None
    kept = {key: value for key, value in document.items() if key not in ("program", "arrays")}
    return PackFile(kept, read_program(document["program"], buffers), arrays)


def manifest_of(document: Mapping[str, Any]) -> dict[str, Any]:
    """The manifest that a pack's document stands for: that of a bundle without files."""
    nothing: dict[str, Any] = {"engine": None, "reference": None, "files": []}
    return {**nothing, **document["avatar"], "asset": document["asset"]}


def _check(document: Any, file: str) -> None:
    errors = [p for p in version_problems(document) if not p.warning] if isinstance(document, dict) else []
    errors = errors or schema_problems(document, "pack")
    if errors:
        first = next((p for p in errors if p.path != "$"), errors[0])  # at $: how its parts go together
        raise AvatarError(first.message, file=file, field=first.path)
    if document["shaders"] > SHADERS:
        raise AvatarError(
            f"needs kernels of version {document['shaders']}; this reader has {SHADERS}: update avatar-export",
            file=file,
            field="$.shaders",
        )
    if len(document["levels"]) != len(document["program"]["levels"]):
        raise AvatarError("has another number of levels than $.levels", file=file, field="$.program.levels")


def _check_clips(avatar: Mapping[str, Any], limit: int, file: str) -> None:
    """Channels that stand still are stored once for all frames, so a small file could claim frames without end."""
    names = (avatar["expressions"], avatar["late_morphs"], avatar["joints"])
    expressions, late, joints = (len(listed or ()) for listed in names)
    floats = expressions + late + 16 * (joints + 1)
    total = 0
    for index, clip in enumerate(avatar["clips"]):
        total += 4 * floats * int(clip["frames"])
        if total > limit:
            raise AvatarError(
                f"with it the clips decode to {total} bytes; {limit} are the most",
                file=file,
                field=f"$.avatar.clips[{index}]",
            )


@dataclass(frozen=True)
class Header:
    """What stands before the tensors of a pack."""

    document: str  # JSON
    tensors: Mapping[
        str, tuple[int, int]
    ]  # first byte and the one behind the last, of the bytes behind the header


def inflate(data: bytes, file: str) -> tuple[Header, memoryview]:
    """(header of the safetensors body, its tensors' bytes), never more than the header says and the limits allow."""
    if data[:2] != MAGIC:
        raise AvatarError("is not a pack: it does not begin as a gzip file", file=file)
    stream = _Inflating(data, file)
    size = int.from_bytes(stream.take(8), "little")
    most = min(HEADER_LIMIT, HEADER_LEAST + HEADER_RATIO * len(data))
    if size > most:
        raise AvatarError(
            f"claims a header of {size} bytes in a file of {len(data)}; up to {most} are read", file=file
        )
    header = _header(stream.take(size), file)
    total = max((end for _, end in header.tensors.values()), default=0)
    if total > limit_of(data):
        raise AvatarError(
            f"claims {total} bytes in a file of {len(data)}; at most {MOST_RATIO} times its size and {BODY_LIMIT} "
            "are inflated",
            file=file,
        )
    body = stream.take(total)
    stream.end()
    return header, memoryview(body)


def _header(text: bytes, file: str) -> Header:
    found = _json(text, "header", file)
    if not isinstance(found, dict):
        raise AvatarError("is no JSON object", file=file, field="header")
    metadata = found.pop("__metadata__", None)
    document = metadata.get(METADATA) if isinstance(metadata, dict) else None
    if not isinstance(document, str):
        raise AvatarError(f"has no document {METADATA!r} in its metadata", file=file)
    return Header(document, {name: _span(name, entry, file) for name, entry in found.items()})


def _span(name: str, entry: Any, file: str) -> tuple[int, int]:
    """First and last byte of a tensor of bytes, as the entry of the header says. Unknown keys are ignored."""
    if isinstance(entry, dict) and entry.get("dtype") == "U8":
        offsets, shape = entry.get("data_offsets"), entry.get("shape")
        if _counts(offsets, 2) and _counts(shape, 1) and offsets[0] <= offsets[1] == offsets[0] + shape[0]:
            return offsets[0], offsets[1]
    raise AvatarError("is not the entry of a tensor of bytes", file=file, field=f"header.{name[:80]}")


def _counts(value: Any, length: int) -> TypeGuard[list[int]]:
    return isinstance(value, list) and len(value) == length and all(type(v) is int and v >= 0 for v in value)


def _json(text: bytes | str, what: str, file: str) -> Any:
    try:
        return json_text.parse(text)
    except ValueError as error:
        raise AvatarError(f"its {what} is not JSON ({error})", file=file) from None


def limit_of(data: bytes) -> int:
    """The most bytes that a file may inflate to, and that its clips may decode to."""
    return min(BODY_LIMIT, MOST_RATIO * len(data))


class _Inflating:
    """Inflates as many bytes as are asked for."""

    def __init__(self, data: bytes, file: str) -> None:
        self._zlib, self._rest, self._file = zlib.decompressobj(GZIP), data, file

    def take(self, size: int) -> bytes:
        parts, missing = [], size
        while missing:
            try:
                part = self._zlib.decompress(self._rest, missing)
            except zlib.error as error:
                raise AvatarError(f"is damaged: {error}", file=self._file) from None
            self._rest = self._zlib.unconsumed_tail
            if not part:
                raise AvatarError(f"ends {missing} bytes too early", file=self._file)
            parts.append(part)
            missing -= len(part)
        return b"".join(parts)

    def end(self) -> None:
        """Checks that nothing follows, and the checksum."""
        try:
            more = self._zlib.decompress(self._rest, 1)
        except zlib.error as error:
            raise AvatarError(f"is damaged: {error}", file=self._file) from None
        if more or not self._zlib.eof or self._zlib.unused_data:
            raise AvatarError("goes on after its last tensor", file=self._file)


class _Reader:
    """Sections and arrays from the tensors that they name."""

    def __init__(self, tensors: Mapping[str, memoryview], most: int) -> None:
        self._tensors, self._most, self._left = tensors, most, most

    def buffers(self, listed: list[Mapping[str, Any]]) -> dict[str, Buffer]:
        found: dict[str, Buffer] = {}
        for said in listed:
            name = said["name"]
            if name in found:
                raise AvatarError("is named twice", field=f"buffer {name}")
            if "sections" in said:
                sections = self._sections(name, said["sections"])
                found[name] = Buffer(name, 4 * sum(s.words for s in sections), sections)
            else:
                self._take(int(said["bytes"]), f"buffer {name}")
                found[name] = Buffer(name, int(said["bytes"]))
        return found

    def _sections(self, buffer: str, listed: list[Mapping[str, Any]]) -> tuple[Section, ...]:
        found: dict[str, Section] = {}
        around: tuple[Array, Array] | None = None
        for said in listed:
            name, codec, record = said["name"], said["codec"], int(said.get("record", 1))
            where, count, bits = f"buffer {buffer}, section {name}", int(said["count"]), int(said["bits"])
            if name in found:
                raise AvatarError("is named twice", field=where)
            if codec == "incidence":
                around = around or self._incidence(listed, found, where)
                elements = around[0 if name == "vertex_triangle_ptr" else 1].astype(BITS[bits])
                self._take(count * bits // 8, where)
            else:
                self._take(count * (4 if codec == "pointer" else bits // 8), where)
                data = self._tensor(said.get("tensor"), where)
                elements = decode_section(data, codec, bits, count, record, where)
            if len(elements) != count:
                raise AvatarError(f"has {len(elements)} elements, not {count}", field=where)
            found[name] = Section(name, elements, codec, record)
        return tuple(found.values())

    def _incidence(
        self, listed: list[Mapping[str, Any]], found: Mapping[str, Section], where: str
    ) -> tuple[Array, Array]:
        count = next((int(said["count"]) for said in listed if said["name"] == "vertex_triangle_ptr"), 0)
        if "corners" not in found or count < 1:
            raise AvatarError("codec incidence needs section corners before it", field=where)
        if 4 * count > self._left:
            self._take(4 * count, where)
        return incidence(found["corners"].elements, count - 1, where)

    def array(self, name: str, said: Mapping[str, Any]) -> Array:
        where, kind = f"array {name}", np.dtype(TYPES[said["type"]])
        shape = [int(length) for length in said["shape"]]  # JSON may write 3 as 3.0
        count = math.prod(shape)
        if count == 0 and math.prod(length or 1 for length in shape) >> 60:
            shape = [0] * len(shape)  # more than NumPy counts; no array that is used has such a shape
        self._take(count * kind.itemsize, where)
        flat = decode_section(
            self._tensor(said["tensor"], where), said["codec"], 8 * kind.itemsize, count, 1, where
        )
        return flat.view(kind).reshape(shape)

    def _tensor(self, name: Any, where: str) -> memoryview:
        if name not in self._tensors:
            raise AvatarError(f"tensor {name!r} is missing", field=where)
        return self._tensors[name]

    def _take(self, size: int, where: str) -> None:
        self._left -= size
        if self._left < 0:
            raise AvatarError(f"with it the pack takes more than {self._most} bytes", field=where)
