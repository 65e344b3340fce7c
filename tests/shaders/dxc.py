"""Microsoft's compiler through ctypes, where its library can be had: a second opinion on the HLSL.

Run as a program with a JSON list of [file, entry, profile, options] on standard input, it prints a JSON list of
messages, empty for what compiles. It is a process of its own because the library breaks the interpreter's exit.
"""

from __future__ import annotations

import ctypes as C
import importlib.util
import json
import os
import subprocess
import sys
import uuid
from pathlib import Path

Job = tuple[str, str, str, tuple[str, ...]]

COMPILER = (
    "73e22d93-e6ce-47f3-b5bf-f0664f39c1b0",
    "228b4687-5a6a-4730-900c-9702b2203f54",
)  # class, interface
UTILS = ("6245d6af-66e0-48fd-80b4-4d271796748c", "4605c4cb-2019-492a-ada4-65f20bb7d67f")
RESULT = "58346cda-dde7-4497-9461-6f87af5e0659"
# Slots of the virtual tables: on Linux IUnknown has a virtual destructor, which takes slots 3 and 4.
COMPILE, INCLUDE_HANDLER = 5, 11
STATUS, ERRORS, POINTER, SIZE = 5, 7, 5, 6


class Buffer(C.Structure):
    """DxcBuffer."""

    _fields_ = (("pointer", C.c_void_p), ("size", C.c_size_t), ("encoding", C.c_uint32))


def library() -> Path | None:
    """libdxcompiler: the file AVATAR_DXC names, else the one inside an installed compushady."""
    named = os.environ.get("AVATAR_DXC")
    if named:
        return Path(named)
    found = importlib.util.find_spec("compushady")
    folders = list(found.submodule_search_locations or []) if found else []
    return next((path for folder in folders for path in Path(folder).rglob("libdxcompiler*.so*")), None)


def messages(jobs: list[Job]) -> list[str]:
    """What the compiler says against each job; "" for what compiles. Needs `library()`."""
    done = subprocess.run(
        [sys.executable, __file__], input=json.dumps(jobs), capture_output=True, text=True, check=False
    )
    assert done.stdout, done.stderr
    said: list[str] = json.loads(done.stdout)
    return said


def _guid(text: str) -> C.Array[C.c_char]:
    return C.create_string_buffer(uuid.UUID(text).bytes_le, 16)


def _call(this: C.c_void_p, slot: int, result: type | None, *arguments: object) -> object:
    table = C.cast(this, C.POINTER(C.POINTER(C.c_void_p))).contents
    kinds = [C.c_uint32 if isinstance(a, C.c_uint32) else C.c_void_p for a in arguments]
    return C.CFUNCTYPE(result, C.c_void_p, *kinds)(table[slot])(this, *arguments)


class _Compiler:
    def __init__(self, path: Path):
        dll = C.CDLL(str(path))
        self._compiler, utils = (self._create(dll, *ids) for ids in (COMPILER, UTILS))
        self._includes = C.c_void_p()
        _call(utils, INCLUDE_HANDLER, C.c_int32, C.byref(self._includes))

    @staticmethod
    def _create(dll: C.CDLL, kind: str, interface: str) -> C.c_void_p:
        made = C.c_void_p()
        assert dll.DxcCreateInstance(_guid(kind), _guid(interface), C.byref(made)) == 0
        return made

    def message(self, file: str, entry: str, profile: str, options: list[str]) -> str:
        text = Path(file).read_bytes()
        kept = C.create_string_buffer(text, len(text))
        source = Buffer(C.cast(kept, C.c_void_p), len(text), 65001)
        words = [file, "-E", entry, "-T", profile, *options]
        arguments = (C.c_wchar_p * len(words))(*words)
        result = C.c_void_p()
        _call(
            self._compiler,
            COMPILE,
            C.c_int32,
            C.byref(source),
            arguments,
            C.c_uint32(len(words)),
            self._includes,
            _guid(RESULT),
            C.byref(result),
        )
        status, errors = C.c_int32(), C.c_void_p()
        _call(result, STATUS, C.c_int32, C.byref(status))
        if status.value == 0:
            return ""
        _call(result, ERRORS, C.c_int32, C.byref(errors))
        size = _call(errors, SIZE, C.c_size_t)
        pointer = _call(errors, POINTER, C.c_void_p)
        assert isinstance(size, int) and isinstance(pointer, int)
        return C.string_at(pointer, size).decode(errors="replace").strip("\0\n") or "failed without a message"


def main() -> None:
    """See the module's first lines."""
    path = library()
    assert path, "no libdxcompiler"
    compiler = _Compiler(path)
    print(json.dumps([compiler.message(*job) for job in json.load(sys.stdin)]), flush=True)
    os._exit(0)


if __name__ == "__main__":
    main()
