"""The program in the document of a pack, both directions: its lists of passes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from avatar_runtime.program.model import POSE_SECTIONS, Buffer, Level, Pass, Program, Run

# Of passes; whether each level has them.
LISTS = {"deform": True, "view": True, "shadow": False, "light": False}


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
                **{
                    n: [*map(_pass, getattr(level, n))]
                    for n, must in LISTS.items()
                    if must or getattr(level, n)
                },
            }
            for level in program.levels
        ],
    }


def _pass(one: Pass) -> dict[str, Any]:
    constants = {k: list(v) if isinstance(v, tuple) else v for k, v in one.constants.items()}
    return {"entry": one.entry, "rows": one.rows, "buffers": dict(one.buffers), "constants": constants}


def read_program(said: Mapping[str, Any], buffers: Mapping[str, Buffer]) -> Program:
    """The program of a document that the schema accepts."""
    return Program(
        buffers,
        tuple(_read_pass(one) for one in said["mesh"]),
        tuple(
            Level(
                level["prefix"],
                tuple(Run(int(first), int(count)) for first, count in level["chunks"]),
                *(tuple(map(_read_pass, level.get(name, ()))) for name in LISTS),
            )
            for level in said["levels"]
        ),
        {name: int(said["pose"][name]) for name in POSE_SECTIONS},
        int(said["pose_floats"]),
        bool(said["reads_mesh"]),
    )


def _read_pass(said: Mapping[str, Any]) -> Pass:
    constants = {k: tuple(v) if isinstance(v, list) else v for k, v in said["constants"].items()}
    return Pass(said["entry"], int(said["rows"]), dict(said["buffers"]), constants)
