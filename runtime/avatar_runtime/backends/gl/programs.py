"""The generated shaders in one context: programs, their constants by name, dispatches.

Bindings, offsets of constants and names come from the reflection table that is generated with the shaders.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Protocol

import moderngl
import numpy as np

import avatar_shaders
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.chunks import GROUP, MOST_GROUPS

WIDTH = "_width"  # ends the names of constants that say how many bits an element has
Values = Mapping[str, Any]


class Shaders(Protocol):
    """Where shader text comes from; the module `avatar_shaders` is one."""

    def source(self, entry: str, language: str) -> str:
        """The text of an entry point."""
        ...

    def reflection(self, language: str) -> Mapping[str, Any]:
        """What each entry point binds."""
        ...


class Constants:
    """The uniform block of one entry point, in a buffer of its own."""

    def __init__(self, gpu: Gpu, entry: str, block: Mapping[str, Any], values: Values) -> None:
        """Takes the block's members from `values`, which may hold more. Raises KeyError if one is missing."""
        self.entry = entry
        self._members = {m["name"]: (m["offset"], m["type"]) for m in block["members"]}
        self._binding = block["binding"]
        self._bytes = bytearray(block["size"])
        self._buffer = gpu.buffer(f"constants of {entry}", block["size"])
        self.set({name: values[name] for name in self._members})

    def set(self, values: Values) -> None:
        """New values of some members."""
        for name, value in values.items():
            offset, kind = self._members[name]
            packed = np.asarray(value, "<f4" if kind.startswith("float") else "<u4").tobytes()
            self._bytes[offset : offset + len(packed)] = packed
        self._buffer.write(self._bytes)

    def bind(self) -> None:
        """To the binding that the shader reads."""
        self._buffer.bind_to_uniform_block(self._binding)


class Dispatch:
    """One kernel with its buffers and constants, ready to run."""

    def __init__(
        self,
        shader: moderngl.ComputeShader,
        buffers: tuple[tuple[moderngl.Buffer, int], ...],  # and bindings
        constants: Constants,
        groups: int,
    ) -> None:
        self._shader, self._buffers, self._groups = shader, buffers, groups
        self.constants = constants

    def run(self) -> None:
        """Queues the kernel; the caller adds the memory barrier."""
        for buffer, binding in self._buffers:
            buffer.bind_to_storage_buffer(binding)
        self.constants.bind()
        self._shader.run(self._groups)


class Programs:
    """The compiled entry points of one context; each is compiled at its first use."""

    def __init__(self, gpu: Gpu, shaders: Shaders | None = None) -> None:
        self._gpu = gpu
        self._shaders: Shaders = avatar_shaders if shaders is None else shaders
        self.table = self._shaders.reflection(gpu.language)
        self._compute: dict[str, moderngl.ComputeShader] = {}  # by text

    def dispatch(
        self,
        entry: str,
        rows: int,
        buffers: Mapping[str, moderngl.Buffer],
        values: Values,
        block: int = GROUP,
    ) -> Dispatch:
        """Kernel `entry` over `rows` rows, `block` of them a group; buffers by the shader's names.

        Raises AvatarError for more rows than one dispatch has, or if the driver does not compile the shader.
        """
        groups = -(-rows // block)
        if groups > MOST_GROUPS:
            raise AvatarError(
                f"{rows} rows are more than the {MOST_GROUPS * block} of one dispatch; prune the avatar",
                field=f"backend gl: {entry}",
            )
        table = self.table[entry]
        bound = tuple((buffers[item["name"]], item["binding"]) for item in table["storage"])
        return Dispatch(self._kernel(entry, values), bound, self.constants(entry, values), groups)

    def constants(self, entry: str, values: Values) -> Constants:
        """The constants of `entry`, with their first values."""
        return Constants(self._gpu, entry, self.table[entry]["uniform_blocks"][0], values)

    def draw(self, vertex: str, pixel: str) -> moderngl.Program:
        """A vertex and a pixel shader, linked. Raises AvatarError as `dispatch`."""
        language = self._gpu.language
        try:
            made = self._gpu.context.program(
                self._shaders.source(vertex, language), self._shaders.source(pixel, language)
            )
        except moderngl.Error as error:
            raise refused(f"{vertex} and {pixel}", language, error) from error
        self._gpu.hold(made)
        return made

    def _kernel(self, entry: str, values: Values) -> moderngl.ComputeShader:
        """The kernel in which each width of elements is written as the number that it has in this pass.

        The driver then compiles the one way to read a section that is taken. Left to a constant, llvmpipe goes all ways
        for each element and keeps one result, which makes stage `blend` half as slow again.
        """
        language = self._gpu.language
        text = self._shaders.source(entry, language)
        for member in self.table[entry]["uniform_blocks"][0]["members"]:
            if member["name"].endswith(WIDTH):
                width = np.asarray(values[member["name"]]).item()
                text = re.sub(rf"\bconstants\.{member['name']}\b", f"{int(width)}u", text)
        if text not in self._compute:
            try:
                made = self._gpu.context.compute_shader(text)
            except moderngl.Error as error:
                raise refused(entry, language, error) from error
            self._compute[text] = self._gpu.hold(made)
        return self._compute[text]


def refused(what: str, language: str, error: Exception) -> AvatarError:
    """The error for a shader that the driver does not compile."""
    return AvatarError(f"the driver does not compile it: {error}", field=f"shader {what} ({language})")
