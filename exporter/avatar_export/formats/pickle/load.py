"""Runs a pickle with a Machine that can only build inert data; nothing of the file is ever called."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path

from avatar_export.formats.pickle.machine import Machine, Persistent
from avatar_export.formats.pickle.steps import STEPS
from avatar_export.formats.pickle.values import Global
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file

MAX_STEPS = 1_000_000  # a checkpoint's pickle has a few thousand
STOP = ord(".")


def load_pickle(
    source: Path | bytes,
    file: object,
    allowed: Mapping[str, Global],
    persistent: Persistent | None = None,
    offset: int = 0,
) -> object:
    """What the pickle at `offset` of `source` describes, made of plain values, Payloads and StandIns.

    `file` is named in messages, `allowed` are the names that the pickle may use, `persistent` resolves references to
    data outside the pickle. Raises AvatarError for every fault: another name, false lengths, damage of any kind.
    """
    try:
        with BytesIO(source) if isinstance(source, bytes) else open_file(source) as stream:
            return _run(Machine(stream, source, file, allowed, persistent, offset))
    except (IndexError, KeyError, TypeError, ValueError, OverflowError, struct.error) as error:
        reason = f"{type(error).__name__}: {str(error)[:100]}"
        raise AvatarError(f"is a damaged pickle ({reason!a})", file=file) from error
    except (RecursionError, MemoryError, OSError) as error:
        raise AvatarError(f"cannot be read as a pickle ({type(error).__name__})", file=file) from error


def _run(machine: Machine) -> object:
    while machine.steps < MAX_STEPS:
        machine.steps += 1
        code = machine.take(1)[0]
        if code == STOP:
            return machine.stack.pop()
        step = STEPS.get(code)
        if step is None:
            machine.refuse(f"uses pickle operation 0x{code:02x}")
        step(machine)
    return machine.refuse(f"has more than {MAX_STEPS} steps")
