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
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.codec import safetensors
from avatar_runtime.codec.gzip_pieces import GzipWriter
from avatar_runtime.codec.sections import BITS, incidence
from avatar_runtime.codec.sections import decode as decode_section
from avatar_runtime.codec.sections import encode as encode_section
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.model import Buffer, Level, Pass, Program, Run, Section
from avatar_runtime.program.passes import SHADERS
from avatar_schema.validate import manifest_problems, schema_problems, version_problems

MAGIC = b"\x1f\x8b"  # gzip
METADATA = "pack"
HEADER_LIMIT = 16 << 20  # bytes of JSON
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


def program_document(program: Program) -> dict[str, Any]:
    """The lists of passes and everything about the buffers but their contents."""
    return {
        "pose": dict(program.pose),
        "pose_floats": program.pose_floats,
        "reads_mesh": program.reads_mesh,
        "mesh": [_pass(one) for one in program.mesh],
        "levels": [
            {
                "prefix": level.prefix,
                "chunks": [[run.first, run.count] for run in level.chunks],
                "deform": [_pass(one) for one in level.deform],
                "view": [_pass(one) for one in level.view],
            }
            for level in program.levels
        ],
    }


def _pass(one: Pass) -> dict[str, Any]:
    constants = {k: list(v) if isinstance(v, tuple) else v for k, v in one.constants.items()}
    return {"entry": one.entry, "rows": one.rows, "buffers": dict(one.buffers), "constants": constants}


def decode(data: bytes, file: str) -> PackFile:
    """A pack. Raises AvatarError for anything out of order; the program is not yet checked."""
    header, body = inflate(data, file)
    try:
        document = json.loads(header["__metadata__"][METADATA])
    except (KeyError, TypeError, ValueError, RecursionError) as error:
        raise AvatarError(f"has no JSON document {METADATA!r} in its metadata ({error})", file=file) from None
    _check(document, file)
    _check_clips(document["avatar"], limit_of(data), file)
    tensors = {
        name: _span(name, entry, body, file) for name, entry in header.items() if name != "__metadata__"
    }
    try:
        reader = _Reader(tensors)
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
    errors = errors or [p for p in manifest_problems(manifest_of(document)) if not p.warning]
    if errors:
        raise AvatarError(errors[0].message, file=file, field=errors[0].path)
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


def inflate(data: bytes, file: str) -> tuple[dict[str, Any], memoryview]:
    """(header of the safetensors body, its tensors' bytes), never more than the header says and the limits allow."""
    if data[:2] != MAGIC:
        raise AvatarError("is not a pack: it does not begin as a gzip file", file=file)
    stream = _Inflating(data, file)
    size = int.from_bytes(stream.take(8), "little")
    if size > HEADER_LIMIT:
        raise AvatarError(f"claims a header of {size} bytes; up to {HEADER_LIMIT} are read", file=file)
    header = safetensors.header(stream.take(size), file)
    ends = [
        entry["data_offsets"][1]
        for name, entry in header.items()
        if name != "__metadata__" and safetensors.is_entry(entry)
    ]
    total = max(ends, default=0)
    if total > limit_of(data):
        raise AvatarError(
            f"claims {total} bytes in a file of {len(data)}; at most {MOST_RATIO} times its size and {BODY_LIMIT} "
            "are inflated",
            file=file,
        )
    body = stream.take(total)
    stream.end()
    return header, memoryview(body)


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


def _span(name: str, entry: Any, body: memoryview, file: str) -> memoryview:
    if not safetensors.is_entry(entry):
        raise AvatarError("is not the entry of a tensor", file=file, field=name)
    (begin, end), shape = entry["data_offsets"], entry["shape"]
    if entry["dtype"] != "U8" or shape != [end - begin] or not begin <= end <= len(body):
        raise AvatarError(
            f"{entry['dtype']}{shape} at bytes {begin}..{end} does not fit the file", file=file, field=name
        )
    return body[begin:end]


class _Reader:
    """Sections and arrays from the tensors that they name."""

    def __init__(self, tensors: Mapping[str, memoryview]) -> None:
        self._tensors, self._left = tensors, 2 * BODY_LIMIT

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
                found[name] = Buffer(name, int(said["bytes"]))
        return found

    def _sections(self, buffer: str, listed: list[Mapping[str, Any]]) -> tuple[Section, ...]:
        found: dict[str, Section] = {}
        for said in listed:
            name, codec, record = said["name"], said["codec"], int(said.get("record", 1))
            where, count, bits = f"buffer {buffer}, section {name}", int(said["count"]), int(said["bits"])
            if name in found:
                raise AvatarError("is named twice", field=where)
            self._take(count * bits // 8, where)
            if codec == "incidence":
                elements = self._incidence(name, listed, found, where).astype(BITS[bits])
            else:
                data = self._tensor(said.get("tensor"), where)
                elements = decode_section(data, codec, bits, count, record, where)
            if len(elements) != count:
                raise AvatarError(f"has {len(elements)} elements, not {count}", field=where)
            found[name] = Section(name, elements, codec, record)
        return tuple(found.values())

    def _incidence(
        self, name: str, listed: list[Mapping[str, Any]], found: Mapping[str, Section], where: str
    ) -> Array:
        counts = {said["name"]: int(said["count"]) for said in listed}
        if "corners" not in found or "vertex_triangle_ptr" not in counts:
            raise AvatarError("codec incidence needs section corners before it", field=where)
        made = incidence(found["corners"].elements, counts["vertex_triangle_ptr"] - 1, where)
        return made[0 if name == "vertex_triangle_ptr" else 1]

    def array(self, name: str, said: Mapping[str, Any]) -> Array:
        where, kind = f"array {name}", np.dtype(TYPES[said["type"]])
        shape = [int(length) for length in said["shape"]]  # JSON may write 3 as 3.0
        count = math.prod(shape)
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
            raise AvatarError(f"with it the pack takes more than {2 * BODY_LIMIT} bytes", field=where)


def read_program(said: Mapping[str, Any], buffers: Mapping[str, Buffer]) -> Program:
    """The program of a document that the schema accepts."""
    return Program(
        buffers,
        tuple(_read_pass(one) for one in said["mesh"]),
        tuple(
            Level(
                level["prefix"],
                tuple(Run(int(first), int(count)) for first, count in level["chunks"]),
                tuple(_read_pass(one) for one in level["deform"]),
                tuple(_read_pass(one) for one in level["view"]),
            )
            for level in said["levels"]
        ),
        {name: int(at) for name, at in said["pose"].items()},
        int(said["pose_floats"]),
        bool(said["reads_mesh"]),
    )


def _read_pass(said: Mapping[str, Any]) -> Pass:
    constants = {k: tuple(v) if isinstance(v, list) else v for k, v in said["constants"].items()}
    return Pass(said["entry"], int(said["rows"]), dict(said["buffers"]), constants)
