"""Arrays of an avatar as sections of packed buffers, with the constants that describe them to a kernel.

`dense` and `sparse` write, `dense_values` and `sparse_rows` read the same sections back.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from avatar_runtime.avatar import F32, SparseRows
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.codes import Codes, decode
from avatar_runtime.program.model import WORD, Array, Buffer, Constant, Run, Section

SCALE_NAMES = {"linear": "scale", "signed": "step", "weight": "step", "table": "table"}
NO_SCALE = 0  # where a width of 32 bits needs none; kernels do not read it


@dataclass
class Building:
    """A packed buffer in the making, and the constants that describe its sections."""

    name: str
    sections: list[Section] = field(default_factory=list)
    constants: dict[str, Constant] = field(default_factory=dict)

    def add(self, name: str, elements: Array, codec: str = "raw", record: int = 1) -> None:
        """A section of integers, or of float32 by its bits."""
        if elements.dtype == np.float32:
            elements = elements.view(np.uint32)
        self.sections.append(Section(name, np.ascontiguousarray(elements).reshape(-1), codec, record))

    def indices(self, name: str, values: Array, most: int, codec: str = "delta", record: int = 1) -> None:
        """A section of integers 0..most - 1, as narrow as they allow, and NAME_width."""
        kind = np.uint8 if most <= 1 << 8 else np.uint16 if most <= 1 << 16 else np.uint32
        self.add(name, values.astype(kind), codec, record)
        self.constants[f"{name}_width"] = 8 * np.dtype(kind).itemsize

    def coded(self, name: str, kind: str, values: F32, codes: Codes | None, *, by_plane: bool) -> None:
        """A section NAME of values [n, C], its NAME_width, and the section of its scale."""
        scale = f"{name}_{SCALE_NAMES[kind]}"
        if codes is None:
            stored: Array = np.ascontiguousarray(values, np.float32).view(np.uint32)
            self.constants[scale] = NO_SCALE
        else:
            # At width 0 kernels read one word of every kind but signed, so one must lie there.
            nothing = np.zeros((int(kind != "signed"), 1), np.uint8)
            stored = nothing if codes.codes is None else codes.codes
            self.add(scale, np.ascontiguousarray(codes.scale, np.float32), "planes")
        self.constants[f"{name}_width"] = 32 if codes is None else codes.width
        if by_plane:
            self.add(name, stored.T, "planes")
        else:
            self.add(name, stored, "planes", max(stored.shape[1], 1))

    def done(self) -> tuple[Buffer, dict[str, Constant]]:
        """The buffer, and all constants: offsets, widths, scales."""
        buffer = Buffer(self.name, WORD * sum(s.words for s in self.sections), tuple(self.sections))
        return buffer, {**self.constants, **buffer.offsets()}


Pick = Callable[[str], Codes | None]  # codes of an attribute


def sparse(
    into: Building, name: str, rows: SparseRows, kinds: Mapping[str, tuple[str, str]], run: Run, pick: Pick
) -> None:
    """Sections NAME_ptr, NAME_column and one an attribute: `kinds` attribute -> (section, kind of codes)."""
    ptr = rows.row_ptr[run.first : run.first + run.count + 1].astype(np.uint32)
    entries = slice(int(ptr[0]), int(ptr[-1]))
    into.add(f"{name}_ptr", ptr - ptr[0], "pointer")
    into.indices(f"{name}_column", rows.column[entries], max(rows.columns, 1))
    for attribute, (section, kind) in kinds.items():
        values = rows.values[attribute][entries]
        count = int(np.prod(values.shape[1:], dtype=np.int64))
        codes = pick(attribute)
        into.coded(
            section,
            kind,
            values.reshape(len(values), count),
            None if codes is None else part(codes, entries),
            by_plane=False,
        )


def part(codes: Codes, rows: slice) -> Codes:
    """Some rows of `codes`."""
    return Codes(codes.kind, None if codes.codes is None else codes.codes[rows], codes.scale)


@dataclass(frozen=True)
class Source:
    """A packed buffer and the constants of the passes that read it."""

    buffer: Buffer
    constants: Mapping[str, Constant]

    def section(self, name: str) -> Array:
        """The elements of a section. Raises AvatarError if there is none of that name."""
        for section in self.buffer.sections:
            if section.name == name:
                return section.elements
        raise AvatarError("is missing", field=f"buffer {self.buffer.name}, {name}")

    def floats(self, name: str) -> F32:
        """The elements of a section of float32."""
        return self.section(name).view(np.float32)

    def codes(self, name: str, kind: str, rows: int, channels: int, columns: int) -> Codes | None:
        """The codes of an array [rows, channels] stored by row; None if it is stored as float32.

        Raises AvatarError for a scale that is not of that many channels and columns, and where no pass says the width.
        """
        width = self.constants.get(f"{name}_width")
        if width is None:
            raise AvatarError("no pass reads it", field=f"buffer {self.buffer.name}, {name}")
        if width == 32:
            return None
        scale = self.floats(f"{name}_{SCALE_NAMES[kind]}")
        shape = {"linear": (channels, 2), "signed": (columns, channels)}.get(kind, (len(scale),))
        needed = int(np.prod(shape))
        if len(scale) != needed:
            place = f"buffer {self.buffer.name}, {name}_{SCALE_NAMES[kind]}"
            raise AvatarError(f"has {len(scale)} numbers; {needed} are needed", field=place)
        stored = self.section(name).reshape(rows, channels) if width else None
        return Codes(kind, stored, scale.reshape(shape))


def dense_values(sources: Sequence[Source], name: str, kind: str, rows: Sequence[int], channels: int) -> F32:
    """[N, channels]: a section of planes in every chunk, decoded and joined."""
    parts = [np.zeros((0, channels), np.float32)]
    for source, count in zip(sources, rows, strict=True):
        codes = source.codes(name, kind, count, channels, 0)
        if codes is None:
            parts.append(source.floats(name).reshape(channels, count).T)
        else:
            if codes.codes is not None:
                planes = codes.codes.reshape(channels, count)
                codes = Codes(kind, planes.T, codes.scale)
            parts.append(decode(codes, count, channels))
    return np.ascontiguousarray(np.concatenate(parts))


def sparse_rows(
    sources: Sequence[Source],
    name: str,
    shapes: Mapping[str, tuple[str, str, tuple[int, ...]]],
    columns: int,
) -> SparseRows:
    """The rows of all chunks: `shapes` attribute -> (section, kind, shape of a value)."""
    ptrs, all_columns = [np.zeros(1, np.uint32)], [np.zeros(0, np.uint16)]
    values: dict[str, list[F32]] = {
        a: [np.zeros((0, *shape), np.float32)] for a, (_, _, shape) in shapes.items()
    }
    for source in sources:
        ptr, column = source.section(f"{name}_ptr"), source.section(f"{name}_column").astype(np.uint16)
        ptrs.append(ptr[1:] + ptrs[-1][-1])
        all_columns.append(column)
        for attribute, (section, kind, shape) in shapes.items():
            channels = int(np.prod(shape, dtype=np.int64))
            codes = source.codes(section, kind, len(column), channels, columns)
            if codes is None:
                found = source.floats(section)
            else:
                found = decode(codes, len(column), channels, column)
            values[attribute].append(found.reshape(-1, *shape))
    return SparseRows(
        np.concatenate(ptrs),
        np.concatenate(all_columns),
        {attribute: np.concatenate(parts) for attribute, parts in values.items()},
        columns,
    )
