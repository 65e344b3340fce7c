"""Genuine bytes for the readers' tests: pickles by the standard pickler, zips by the standard zipfile.

Classes of torch, chumpy and scipy are not installed here. Modules of these names stand in while something is
pickled, so that the standard pickler writes the very opcodes that the real classes give.
"""

from __future__ import annotations

import io
import pickle
import struct
import sys
import tracemalloc
import types
import zipfile
from collections import OrderedDict
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import reduce
from pathlib import Path
from random import Random
from typing import Any
from unittest.mock import patch

import numpy as np
import numpy.typing as npt
from hypothesis import settings
from hypothesis import strategies as st
from tools.fuzz.mutate import wounded

from avatar_runtime.io.errors import AvatarError
from tests.session.fuzz import examples

Array = npt.NDArray[Any]
MANGLING = settings(max_examples=examples(150), database=None)


@contextmanager
def modules(**named: Mapping[str, type | Callable[..., Any]]) -> Iterator[None]:
    """Modules that only the pickler sees, in place of real ones; keys are names with `__` for a dot."""
    made: dict[str, types.ModuleType] = {}
    for key, members in named.items():
        name = key.replace("__", ".")
        parts = name.split(".")
        for i in range(1, len(parts) + 1):
            full = ".".join(parts[:i])
            made.setdefault(full, types.ModuleType(full))
        for attribute, value in members.items():
            value.__module__, value.__qualname__, value.__name__ = name, attribute, attribute
            setattr(made[name], attribute, value)
    with patch.dict(sys.modules, made):
        yield


class Storage:
    """A torch storage in a pickle: its class, key and number of elements."""

    def __init__(self, kind: type, key: str, count: int):
        self.reference = ("storage", kind, key, "cuda:0", count)


class Reduced:
    """Anything that pickles as a call."""

    def __init__(self, call: Any, *arguments: Any):
        self.call = call
        self.arguments = arguments

    def __reduce__(self) -> tuple[Any, tuple[Any, ...]]:
        return self.call, self.arguments


STORAGES = {
    "f4": "FloatStorage", "f8": "DoubleStorage", "f2": "HalfStorage", "i8": "LongStorage", "i4": "IntStorage",
    "i2": "ShortStorage", "i1": "CharStorage", "u1": "ByteStorage", "b1": "BoolStorage",
}  # fmt: skip


class Torch:
    """Writes what torch.save writes: add arrays, put the result into a structure, save."""

    def __init__(self) -> None:
        self.storages: list[bytes] = []
        self.kinds = {name: type(name, (), {}) for name in STORAGES.values()}
        self.rebuild: Callable[..., Any] = lambda *a: None
        self.parameter: Callable[..., Any] = lambda *a: None

    def tensor(self, base: Array, view: Array | None = None) -> Reduced:
        """A tensor over the storage `base`, seen through `view` of it."""
        view = base if view is None else view
        key = str(len(self.storages))
        self.storages.append(np.ascontiguousarray(base).tobytes())
        storage = Storage(self.kinds[STORAGES[base.dtype.str[1:]]], key, base.size)
        first = (view.ctypes.data - base.ctypes.data) // base.itemsize
        strides = tuple(s // base.itemsize for s in view.strides)
        return Reduced(self.rebuild, storage, first, view.shape, strides, False, OrderedDict())

    def wrapped(self, tensor: Reduced) -> Reduced:
        return Reduced(self.parameter, tensor, True, OrderedDict())

    def pickled(self, content: object) -> bytes:
        stream = io.BytesIO()

        class Pickler(pickle.Pickler):
            def persistent_id(self, value: object) -> object:
                return value.reference if isinstance(value, Storage) else None

        utils = {"_rebuild_tensor_v2": self.rebuild, "_rebuild_parameter": self.parameter}
        with modules(torch=self.kinds, torch___utils=utils):
            Pickler(stream, protocol=2).dump(content)
        return stream.getvalue()

    def save(self, path: Path, content: object, byteorder: bytes | None = None) -> Path:
        write_torch_zip(path, self.pickled(content), self.storages, byteorder)
        return path


def write_torch_zip(path: Path, data: bytes, storages: list[bytes], byteorder: bytes | None = None) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:

        def add(name: str, content: bytes) -> None:
            info = zipfile.ZipInfo(f"{path.stem}/{name}")
            info.extra = struct.pack("<HH", 0x4246, 11) + b"Z" * 11  # torch pads local headers like this
            archive.writestr(info, content)

        add("data.pkl", data)
        if byteorder is not None:
            add("byteorder", byteorder)
        for key, content in enumerate(storages):
            add(f"data/{key}", content)
        add("version", b"3\n")


class Canary:
    """A command that a pickle runs if it is allowed to, and the file that would then appear."""

    def __init__(self, folder: Path):
        self.file = folder / "canary"

    def pickles(self, protocol: int) -> dict[str, bytes]:
        import os
        import subprocess

        source = f"open({str(self.file)!r}, 'w').close()"
        calls = {
            "os.system": Reduced(os.system, f"touch {self.file}"),
            "builtins.eval": Reduced(eval, source),
            "builtins.exec": Reduced(exec, source),
            "subprocess.Popen": Reduced(subprocess.Popen, ["touch", str(self.file)]),
            "pickle.loads": Reduced(pickle.loads, pickle.dumps(Reduced(os.system, f"touch {self.file}"))),
            "numpy.load": Reduced(np.load, str(self.file)),
            "builtins.getattr": Reduced(getattr, "", "format"),
        }
        return {name: pickle.dumps({"pos": call}, protocol) for name, call in calls.items()}


def py2_array(array: Array) -> bytes:
    """The opcodes with which Python 2 and NumPy 1 pickled an array (protocol 2, strings are bytes)."""

    def short(text: bytes) -> bytes:
        return b"U" + bytes([len(text)]) + text

    data = array.tobytes(order="F" if array.flags.f_contiguous and not array.flags.c_contiguous else "C")
    fortran = b"\x88" if array.flags.f_contiguous and not array.flags.c_contiguous else b"\x89"
    shape = b"(" + b"".join(b"J" + struct.pack("<i", n) for n in array.shape) + b"t"
    kind, order = array.dtype.str[1:].encode(), array.dtype.str[:1].encode()
    dtype = b"cnumpy\ndtype\n" + short(kind) + b"K\x00K\x01\x87R(K\x03" + short(order)
    dtype += b"NNNJ\xff\xff\xff\xffJ\xff\xff\xff\xffK\x00tb"
    made = b"cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\x00\x85U\x01b\x87R"
    return made + b"(K\x01" + shape + dtype + fortran + b"T" + struct.pack("<i", len(data)) + data + b"tb"


def py2_dict(items: Mapping[str, bytes]) -> bytes:
    pairs = b"".join(b"U" + bytes([len(k)]) + k.encode() + v for k, v in items.items())
    return b"\x80\x02}(" + pairs + b"u."


def mangled(data: bytes) -> st.SearchStrategy[bytes]:
    """`data` with up to three wounds: cut off, bits flipped, bytes overwritten, pieces copied elsewhere."""

    def wounds(seed: int) -> bytes:
        rng = Random(seed)
        return reduce(lambda left, _: wounded(left, rng), range(rng.randint(1, 3)), data)

    return st.integers(0, 1 << 60).map(wounds)


def only_avatar_errors(read: Callable[[], object]) -> bool:
    """Whether `read` worked; False for an AvatarError of one printable line. Other errors escape."""
    try:
        read()
    except AvatarError as error:
        text = str(error)
        text.encode("utf8")
        assert "\n" not in text and len(text) < 1000, text
        return False
    return True


def peak_bytes(work: Callable[[], object]) -> int:
    """The most memory that `work` had allocated at once."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def read_all(value: object) -> object:
    """Every array in nested dicts, lists and tuples read whole."""
    if isinstance(value, dict):
        return {key: read_all(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return type(value)([read_all(item) for item in value])
    return value.read() if hasattr(value, "read") else value
