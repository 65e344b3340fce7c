"""Binary PLY with one `vertex` element of scalars, and the INRIA layout of Gaussians in it: bytes <-> arrays.

INRIA layout: x y z nx ny nz f_dc_0..2 f_rest_* opacity scale_0..2 rot_0..3, one row a Gaussian, training
space (log scale, opacity logit, quaternion wxyz), f_rest channel-major. Written as float32 little-endian with
zero normals; read in any order of properties and of any scalar type.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, Gaussians
from avatar_runtime.io.errors import AvatarError

MAX_HEADER_BYTES = 65536
FORMAT = "binary_little_endian"
SCALARS = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "<i2",
    "int16": "<i2",
    "ushort": "<u2",
    "uint16": "<u2",
    "int": "<i4",
    "int32": "<i4",
    "uint": "<u4",
    "uint32": "<u4",
    "float": "<f4",
    "float32": "<f4",
    "double": "<f8",
    "float64": "<f8",
}
POSITION = ("x", "y", "z")
NORMAL = ("nx", "ny", "nz")
DC = ("f_dc_0", "f_dc_1", "f_dc_2")
OPACITY = ("opacity",)
SCALE = ("scale_0", "scale_1", "scale_2")
ROTATION = ("rot_0", "rot_1", "rot_2", "rot_3")
REST_COUNTS = (0, 9, 24, 45)  # SH degree 0..3

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Ply:
    """The `vertex` element of a PLY file."""

    properties: Mapping[str, Array]  # name -> [N] view of the file's bytes, in file order
    count: int
    matrix: F32 | None  # [N, len(properties)] the same numbers where all are little-endian float32
    comments: tuple[str, ...]


@dataclass(frozen=True)
class Header:
    """What the header of a PLY says of its rows."""

    rows: int
    offset: int  # bytes before the first row
    dtype: np.dtype[Any]  # of a row, with named fields in file order
    comments: tuple[str, ...]


def decode(data: bytes | memoryview, file: object = None) -> Ply:
    """The vertex element of a binary little-endian PLY, as views of `data`.

    Raises AvatarError for any other format, a list property, another element with rows, a property that
    is a duplicate, no header end within 64 KB, or a body that is not exactly as long as the header says.
    """
    view = memoryview(data).cast("B")
    head = header(view, len(view), file)
    names = head.dtype.names or ()
    rows = np.ndarray(head.rows, head.dtype, view, head.offset)
    floats = {head.dtype[name].str for name in names} == {"<f4"}
    matrix = np.ndarray((head.rows, len(names)), "<f4", view, head.offset) if floats else None
    return Ply({name: rows[name] for name in names}, head.rows, matrix, head.comments)


def header(data: bytes | memoryview, size: int, file: object = None) -> Header:
    """The header of a PLY of `size` bytes, whose beginning is `data`. Raises AvatarError as `decode`."""
    lines, body = _header_lines(memoryview(data).cast("B"), file)
    if lines[1:2] != [f"format {FORMAT} 1.0"]:
        got = lines[1] if len(lines) > 1 else "nothing"
        raise AvatarError(f"'format {FORMAT} 1.0' is needed, got {got[:60]!r}; convert it", file=file)
    comments: list[str] = []
    elements: dict[str, int] = {}
    current = ""
    fields: dict[str, str] = {}
    for line in lines[2:]:
        word, _, rest = line.partition(" ")
        if word == "comment":
            comments.append(rest)
        elif word == "element":
            current, count = _element(rest, elements, file)
            elements[current] = count
        elif word == "property" and elements:
            if current == "vertex":
                name, code = _property(rest, fields, file)
                fields[name] = code
        elif word != "obj_info":
            raise AvatarError(f"header line {line[:60]!r} is not PLY", file=file)
    row = _row(size - body, elements, fields, file)
    return Header(elements["vertex"], body, row, tuple(comments))


def gaussians(ply: Ply, file: object = None) -> Gaussians:
    """The Gaussians of an INRIA layout, as copies: values as stored, SH coefficient-major.

    Raises AvatarError that names a missing property, a wrong number of f_rest_*, no rows, or the row of a
    number that is not finite.
    """
    if not ply.count:
        raise AvatarError("has no rows", file=file, field="vertex")
    rest = sum(name.startswith("f_rest_") for name in ply.properties)
    if rest not in REST_COUNTS:
        raise AvatarError(
            f"{rest} properties, expected one of {', '.join(map(str, REST_COUNTS))}",
            file=file,
            field="f_rest_*",
        )
    sh = np.empty((ply.count, 1 + rest // 3, 3), np.float32)
    _take(ply, DC, sh[:, 0], file)
    for channel in range(3):
        first = channel * (rest // 3)
        _take(ply, [f"f_rest_{first + k}" for k in range(rest // 3)], sh[:, 1:, channel], file)

    def read(names: tuple[str, ...]) -> F32:
        return _take(ply, names, np.empty((ply.count, len(names)), np.float32), file)

    return Gaussians(read(POSITION), read(SCALE), read(ROTATION), read(OPACITY)[:, 0], sh)


def encode(gaussians: Gaussians, comments: Iterable[str] = ()) -> bytes:
    """A PLY in INRIA order, any SH degree. Raises ValueError for a comment that is not one line of ASCII."""
    g = gaussians
    rest = 3 * (g.sh.shape[1] - 1)
    names = (*POSITION, *NORMAL, *DC, *(f"f_rest_{k}" for k in range(rest)), *OPACITY, *SCALE, *ROTATION)
    lines = ["ply", f"format {FORMAT} 1.0"]
    for comment in comments:
        if not (comment.isascii() and comment.isprintable()):
            raise ValueError(f"a comment is one line of printable ASCII, not {comment!r}")
        lines.append(f"comment {comment}")
    lines += [f"element vertex {g.count}", *(f"property float {name}" for name in names), "end_header"]
    matrix = np.empty((g.count, len(names)), "<f4")
    matrix[:, 0:3], matrix[:, 3:6], matrix[:, 6:9] = g.mean, 0, g.sh[:, 0]
    per_channel = rest // 3
    for channel in range(3):
        first = 9 + channel * per_channel
        matrix[:, first : first + per_channel] = g.sh[:, 1:, channel]
    matrix[:, 9 + rest], matrix[:, 10 + rest : 13 + rest] = g.opacity_logit, g.log_scale
    matrix[:, 13 + rest :] = g.quat_wxyz
    return b"".join([("\n".join(lines) + "\n").encode("ascii"), matrix.reshape(-1).data])


def _header_lines(view: memoryview, file: object) -> tuple[list[str], int]:
    """(lines before end_header, offset of the body)."""
    head = bytes(view[:MAX_HEADER_BYTES])
    if not re.match(rb"ply\r?\n", head):
        raise AvatarError("does not begin with 'ply'", file=file)
    end = re.search(rb"\nend_header\r?\n", head)
    if end is None:
        raise AvatarError(f"has no end_header within {MAX_HEADER_BYTES} bytes", file=file)
    text = head[: end.start()].decode("utf-8", errors="replace")
    return [line.removesuffix("\r") for line in text.split("\n")], end.end()


def _element(text: str, known: Mapping[str, int], file: object) -> tuple[str, int]:
    match = re.fullmatch(r"(\S+) ([0-9]{1,18})", text)
    if match is None or not text.isprintable():
        raise AvatarError(f"element line {text[:60]!r} is not a name and a count", file=file)
    name, count = match[1], int(match[2])
    if name in known:
        raise AvatarError("is a duplicate", file=file, field=f"element {name[:60]}")
    if name != "vertex" and count:
        raise AvatarError(f"has {count} rows; only 'vertex' is read", file=file, field=f"element {name[:60]}")
    return name, count


def _property(text: str, known: Mapping[str, str], file: object) -> tuple[str, str]:
    kind, _, name = text.partition(" ")
    if kind == "list":
        raise AvatarError(f"property {text[-60:]!r} is a list; scalars are needed", file=file)
    if kind not in SCALARS or not re.fullmatch(r"\S+", name) or not name.isprintable():
        raise AvatarError(f"property line {text[:60]!r} is not a scalar type and a name", file=file)
    if name in known:
        raise AvatarError("is a duplicate", file=file, field=f"property {name[:60]}")
    return name, SCALARS[kind]


def _row(left: int, elements: Mapping[str, int], fields: Mapping[str, str], file: object) -> np.dtype[Any]:
    """The type of a row, of which all fit exactly into the `left` bytes after the header."""
    if "vertex" not in elements or not fields:
        raise AvatarError("has no element 'vertex' with properties", file=file)
    row = np.dtype(list(fields.items()))
    count = elements["vertex"]
    if count * row.itemsize != left:
        raise AvatarError(
            f"says {count} rows of {row.itemsize} bytes, but {left} bytes follow the header",
            file=file,
            field="element vertex",
        )
    return row


def _take(ply: Ply, names: Sequence[str], out: F32, file: object) -> F32:
    """Fill `out` [N, len(names)] with these properties, which must exist and be finite."""
    for name in names:
        if name not in ply.properties:
            raise AvatarError("is missing", file=file, field=f"property {name}")
    order = list(ply.properties)
    first = order.index(names[0]) if names else 0
    with np.errstate(
        over="ignore", invalid="ignore"
    ):  # beyond float32 becomes infinite, which is refused below
        if ply.matrix is not None and order[first : first + len(names)] == list(names):
            out[:] = ply.matrix[:, first : first + len(names)]
        else:
            for column, name in enumerate(names):
                out[:, column] = ply.properties[name]
        total = np.sum(out, dtype=np.float64)
    if not np.isfinite(total):
        at, column = np.argwhere(~np.isfinite(out))[0]
        value = ply.properties[names[column]][at]
        raise AvatarError(f"is {value}; finite numbers are needed", file=file, field=f"{names[column]}[{at}]")
    return out
