"""A GPU program as data: packed buffers and lists of passes. No part of it depends on one graphics interface."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import U32

WORD = 4  # bytes
Array = npt.NDArray[Any]
Constant = int | float | str | tuple[float, ...]  # a str names a value of the frame: see FRAME_SOURCES

# What a pass may ask of a frame. "NAME[i]" is row i of a table. Stage `joints` and the camera give them.
FRAME_SOURCES: Mapping[str, int] = {  # name -> floats
    "world_row0": 4,  # world from avatar
    "world_row1": 4,
    "world_row2": 4,
    "world_quat_wxyz": 4,
    "group_matrix_row0": 4,  # by group: mesh from binding mesh
    "group_matrix_row1": 4,
    "group_matrix_row2": 4,
    "group_rotation_row0": 4,
    "group_rotation_row1": 4,
    "group_rotation_row2": 4,
    "camera_row0": 4,  # camera from world
    "camera_row1": 4,
    "camera_row2": 4,
    "clip_row0": 4,  # clip from world
    "clip_row1": 4,
    "clip_row2": 4,
    "clip_row3": 4,
    "eye": 4,
    "tan_half_fov": 2,
    "image_size": 2,  # pixels
    **{f"light_ambient{k}": 4 for k in range(9)},  # of the scene: rgb
    **{f"light_place{k}": 4 for k in range(4)},  # of a light: towards it and 0, or its position and 1
    **{f"light_colour{k}": 4 for k in range(4)},
    **{f"light_turn_row{k}": 4 for k in range(3)},  # frame that the captured light moves with from world
    **{f"shadow_row{k}": 4 for k in range(4)},  # column, row, distance and w of the shadow map, from world
    "shadow_offset": 4,  # along the normal, along the light, 1 where there is a shadow map, 0
}
POSE_SECTIONS = ("weights", "features", "late", "joints")  # of buffer Pose, in this order


@dataclass(frozen=True)
class Section:
    """A run of equal elements in a packed buffer; it begins at a word."""

    name: str  # the constant that tells kernels where it begins
    elements: Array  # [n] uint8, uint16 or uint32; float32 by its bits
    codec: str = "raw"  # how a file stores it: one of codec.sections.CODECS
    record: int = 1  # elements of one record, for codecs planes and delta

    @property
    def width(self) -> int:
        """Bits of an element."""
        return 8 * self.elements.itemsize

    @property
    def words(self) -> int:
        """32-bit words that it takes."""
        return -(-self.elements.nbytes // WORD)


@dataclass(frozen=True)
class Buffer:
    """A buffer of the GPU: static with sections, or writable with a size alone."""

    name: str
    size: int  # bytes
    sections: tuple[Section, ...] = ()

    def offsets(self) -> dict[str, int]:
        """Section name -> its first word."""
        found, at = {}, 0
        for section in self.sections:
            found[section.name] = at
            at += section.words
        return found

    def content(self) -> U32:
        """[W] the words that are uploaded; no words if it is writable."""
        words = np.zeros(sum(section.words for section in self.sections), np.uint32)
        data, at = words.view(np.uint8), 0
        for section in self.sections:
            data[at : at + section.elements.nbytes] = section.elements.view(np.uint8).reshape(-1)
            at += WORD * section.words
        return words


@dataclass(frozen=True)
class Pass:
    """One dispatch of one kernel."""

    entry: str  # a compute entry of avatar_shaders
    rows: int  # threads that have work
    buffers: Mapping[str, str]  # the shader's name -> a name of Program.buffers
    constants: Mapping[str, Constant]

    def count(self, name: str) -> int:
        """A constant that is a count."""
        value = self.constants[name]
        assert isinstance(value, int), name
        return value


@dataclass(frozen=True)
class Run:
    """Rows first..first + count of an avatar's Gaussians or vertices."""

    first: int
    count: int


@dataclass(frozen=True)
class Level:
    """One level of detail: its Gaussians in chunks. Chunk i is in the buffers that `splats(i)` and the like name."""

    prefix: str  # of its buffers' names
    chunks: tuple[Run, ...]
    deform: tuple[Pass, ...]  # once a pose
    view: tuple[Pass, ...]  # once a camera
    shadow: tuple[Pass, ...] = ()  # once a pose and light, where one casts shadows
    light: tuple[Pass, ...] = ()  # once a camera, after `view`, where the scene has a light

    @property
    def rows(self) -> int:
        """How many Gaussians it has."""
        return sum(run.count for run in self.chunks)

    def names(self, kind: str) -> tuple[str, ...]:
        """Names of the buffers of one kind, `Splats`, `Sh` or `Projected`, one a chunk."""
        return tuple(f"{self.prefix}{kind}.{index}" for index in range(len(self.chunks)))


@dataclass(frozen=True)
class Program:
    """Everything that a player runs up to stage project. Sorting and drawing belong to its scene."""

    buffers: Mapping[str, Buffer]
    mesh: tuple[Pass, ...]  # stages morph and skin: skipped if posed vertices are given
    levels: tuple[Level, ...]  # finest first
    pose: Mapping[str, int]  # section of Pose -> its first float
    pose_floats: int
    reads_mesh: bool  # deform reads Mesh, so mesh runs before it

    def constants_of(self, buffer: str) -> Mapping[str, Constant]:
        """Constants of all passes that bind a buffer: widths and offsets of its sections."""
        found: dict[str, Constant] = {}
        for one in self.passes():
            if buffer in one.buffers.values():
                found.update(one.constants)
        return found

    def passes(self) -> Iterator[Pass]:
        """All passes."""
        yield from self.mesh
        for level in self.levels:
            yield from level.deform
            yield from level.view
            yield from level.shadow
            yield from level.light
