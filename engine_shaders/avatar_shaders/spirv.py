"""The part of the SPIR-V binary format that sets binding numbers and names."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from enum import IntEnum

CONSTANTS_BINDING = 8  # beside at most 8 storage buffers; Metal numbers both in one row
CONSTANTS_NAME = "constants"
_HEADER = 5  # words before the first instruction

Words = tuple[int, ...]


class Op(IntEnum):
    """Opcodes (SPIR-V 1.0 specification, section 3.32)."""

    NAME = 5
    TYPE_POINTER = 32
    VARIABLE = 59
    LOAD = 61
    ACCESS_CHAIN = 65
    DECORATE = 71


class Decoration(IntEnum):
    """Decorations (section 3.20)."""

    BLOCK = 2
    BUFFER_BLOCK = 3
    BINDING = 33


class Storage(IntEnum):
    """Storage classes (section 3.7)."""

    UNIFORM_CONSTANT = 0
    UNIFORM = 2


def with_bindings(module: bytes) -> bytes:
    """A module without unused resources, with this project's binding numbers and a name for its constants.

    Storage buffers get 0, 1, ... in the order of their old numbers (GLES 3.1 guarantees four only), constants
    CONSTANTS_BINDING, textures 0, 1, ...
    """
    words = struct.unpack(f"<{len(module) // 4}I", module)
    instructions = _without_unused(list(_instructions(words)))
    kinds = _kinds(instructions)
    bound = sorted((i for i in instructions if _binds(i)), key=lambda i: i[3])
    numbers: dict[int, int] = {}
    for kind in ("storage", "texture"):
        numbers |= {i[1]: n for n, i in enumerate(i for i in bound if kinds[i[1]] == kind)}
    numbers |= {i[1]: CONSTANTS_BINDING for i in bound if kinds[i[1]] == "constants"}
    out = list(words[:_HEADER])
    for instruction in instructions:
        if _binds(instruction):
            instruction = (*instruction[:3], numbers[instruction[1]])
        elif _opcode(instruction) == Op.NAME and kinds.get(instruction[1]) == "constants":
            instruction = _name(instruction[1], CONSTANTS_NAME)
        out += instruction
    return struct.pack(f"<{len(out)}I", *out)


def _instructions(words: Words) -> Iterator[Words]:
    at = _HEADER
    while at < len(words):
        length = words[at] >> 16
        yield words[at : at + length]
        at += length


def _without_unused(instructions: list[Words]) -> list[Words]:
    """Without the resources that this entry does not use, their names and their decorations."""
    used = {i[3] for i in instructions if _opcode(i) in (Op.LOAD, Op.ACCESS_CHAIN)}
    resources = {i[2] for i in instructions if _opcode(i) == Op.VARIABLE and i[3] in tuple(Storage)}
    unused = resources - used
    return [
        i
        for i in instructions
        if not (_opcode(i) == Op.VARIABLE and i[2] in unused)
        and not (_opcode(i) in (Op.NAME, Op.DECORATE) and i[1] in unused)
    ]


def _opcode(instruction: Words) -> int:
    return instruction[0] & 0xFFFF


def _binds(instruction: Words) -> bool:
    return _opcode(instruction) == Op.DECORATE and instruction[2] == Decoration.BINDING


def _kinds(instructions: list[Words]) -> dict[int, str]:
    """storage, constants or texture by the id of a resource."""
    blocks = {}
    for i in instructions:
        if _opcode(i) == Op.DECORATE and i[2] in (Decoration.BLOCK, Decoration.BUFFER_BLOCK):
            blocks[i[1]] = "storage" if i[2] == Decoration.BUFFER_BLOCK else "constants"
    pointed = {i[1]: i[3] for i in instructions if _opcode(i) == Op.TYPE_POINTER}
    kinds = {}
    for i in instructions:
        if _opcode(i) == Op.VARIABLE and i[3] == Storage.UNIFORM:
            kinds[i[2]] = blocks[pointed[i[1]]]
        elif _opcode(i) == Op.VARIABLE and i[3] == Storage.UNIFORM_CONSTANT:
            kinds[i[2]] = "texture"
    return kinds


def _name(target: int, name: str) -> Words:
    text = name.encode() + b"\0" * (4 - len(name) % 4)
    return ((2 + len(text) // 4) << 16 | Op.NAME, target, *struct.unpack(f"<{len(text) // 4}I", text))
