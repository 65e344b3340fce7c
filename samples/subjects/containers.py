"""Writers of the containers that research code saves: `.npy`, a torch checkpoint zip, pickled NumPy arrays.

Torch is not needed: a checkpoint is a stored zip of raw storages and a pickle that names torch's functions.
Big arrays come as `Chunks`, so that a checkpoint of gigabytes is written with the memory of one chunk.
"""

from __future__ import annotations

import io
import pickle
import zipfile
from collections import OrderedDict
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any, ClassVar

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

ALIGNMENT = 64
STORAGE_TYPE = {"<f4": "FloatStorage", "<i8": "LongStorage"}


@dataclass(frozen=True)
class Chunks:
    """An array that is made piece by piece, along its first axis; `make` starts over each time."""

    shape: tuple[int, ...]
    make: Callable[[], Iterable[Array]]
    dtype: str = "<f4"

    @property
    def nbytes(self) -> int:
        return int(np.prod(self.shape, dtype=np.int64)) * np.dtype(self.dtype).itemsize

    def bytes(self) -> Iterator[bytes]:
        """The pieces as little-endian bytes; ValueError unless they fill the shape."""
        written = 0
        for piece in self.make():
            data = np.ascontiguousarray(piece, self.dtype).tobytes()
            written += len(data)
            yield data
        if written != self.nbytes:
            raise ValueError(f"pieces hold {written} bytes, the shape {self.shape} needs {self.nbytes}")

    @staticmethod
    def of(array: Array) -> Chunks:
        """One piece that is a whole array."""
        return Chunks(array.shape, lambda: [array], array.dtype.newbyteorder("<").str)


@dataclass(frozen=True)
class Global:
    """A pickled name such as `torch FloatStorage`, written without importing it."""

    module: str
    name: str


@dataclass(frozen=True)
class Call:
    """A pickled call of a Global."""

    function: Global
    arguments: tuple[Any, ...]
    state: Any = None


@dataclass(frozen=True)
class Parameter:
    """A tensor that torch saves as nn.Parameter."""

    data: Chunks


@dataclass(frozen=True)
class Storage:
    """A persistent reference to one of the zip's raw records."""

    dtype: str
    key: str
    elements: int


# The pickler in Python: the C one cannot write a name that it cannot import.
PythonPickler: Any = pickle._Pickler


class Pickler(PythonPickler):  # type: ignore[misc]
    """The standard library's pickler in Python, with stand-ins for names, calls and very long bytes."""

    dispatch: ClassVar[dict[Any, Any]] = dict(PythonPickler.dispatch)

    def persistent_id(self, obj: object) -> tuple[Any, ...] | None:
        if not isinstance(obj, Storage):
            return None
        kind = Global("torch", STORAGE_TYPE[obj.dtype])
        # One object for each distinct value, so that the memo shares them as torch's own files do.
        kind = self.shared.setdefault(kind, kind)
        return ("storage", kind, obj.key, "cuda:0", obj.elements)

    def __init__(self, file: IO[bytes], protocol: int):
        super().__init__(file, protocol, fix_imports=False)
        self.shared: dict[Global, Global] = {}
        self.raw = file

    def save_global_name(self, obj: Global) -> None:
        first = self.shared.setdefault(obj, obj)
        if first is not obj and id(first) in self.memo:
            self.write(self.get(self.memo[id(first)][0]))
            return
        self.write(pickle.GLOBAL + f"{obj.module}\n{obj.name}\n".encode())
        self.memoize(first)

    def save_call(self, obj: Call) -> None:
        self.save(obj.function)
        self.save(obj.arguments)
        self.write(pickle.REDUCE)
        self.memoize(obj)
        if obj.state is not None:
            self.save(obj.state)
            self.write(pickle.BUILD)

    def save_long_bytes(self, obj: Chunks) -> None:
        self.write(pickle.BINBYTES + obj.nbytes.to_bytes(4, "little"))
        for piece in obj.bytes():
            self.raw.write(piece)
        self.memoize(obj)

    dispatch[Global] = save_global_name
    dispatch[Call] = save_call
    dispatch[Chunks] = save_long_bytes


def save_npy(path: Path, array: Chunks) -> None:
    """A plain `.npy` file, version 1.0, row-major."""
    with path.open("wb") as f:
        header = {"descr": array.dtype, "fortran_order": False, "shape": array.shape}
        np.lib.format.write_array_header_1_0(f, header)
        for piece in array.bytes():
            f.write(piece)


def save_torch(path: Path, obj: Any) -> None:
    """The bytes that `torch.save(obj, path)` of torch 1.x writes for tensors on the first GPU.

    `obj` is made of tuples, lists, dicts, numbers, strings, and Chunks (tensors) or Parameters. The zip is
    stored, each record begins at a multiple of 64 bytes, and there is no byteorder record.
    """
    tensors: list[Chunks] = []
    pickled = io.BytesIO()
    Pickler(pickled, 2).dump(_with_tensors(obj, tensors))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as zip_:
        stem = path.stem
        _add_record(zip_, f"{stem}/data.pkl", [pickled.getvalue()], len(pickled.getvalue()))
        for key, tensor in enumerate(tensors):
            _add_record(zip_, f"{stem}/data/{key}", tensor.bytes(), tensor.nbytes)
        _add_record(zip_, f"{stem}/version", [b"3\n"], 2)


def _with_tensors(obj: Any, tensors: list[Chunks]) -> Any:
    """The object with every Chunks and Parameter replaced by torch's rebuilding call; fills `tensors`."""
    if isinstance(obj, Parameter):
        data = _with_tensors(obj.data, tensors)
        return Call(Global("torch._utils", "_rebuild_parameter"), (data, True, OrderedDict()))
    if isinstance(obj, Chunks):
        elements = int(np.prod(obj.shape, dtype=np.int64))
        storage = Storage(obj.dtype, str(len(tensors)), elements)
        tensors.append(obj)
        stride = tuple(int(np.prod(obj.shape[i + 1 :])) for i in range(len(obj.shape)))
        arguments: tuple[Any, ...] = (storage, 0, obj.shape, stride, False, OrderedDict())
        return Call(Global("torch._utils", "_rebuild_tensor_v2"), arguments)
    if isinstance(obj, tuple | list):
        return type(obj)(_with_tensors(x, tensors) for x in obj)
    if isinstance(obj, dict):
        return {k: _with_tensors(v, tensors) for k, v in obj.items()}
    return obj


def _add_record(zip_: zipfile.ZipFile, name: str, pieces: Iterable[bytes], size: int) -> None:
    info = zipfile.ZipInfo(name)
    info.file_size = size
    # Torch pads with an extra field that only the local header carries.
    header = zip_.fp.tell() + 30 + len(name) + 4  # type: ignore[union-attr]
    padding = -header % ALIGNMENT
    info.extra = b"FB" + padding.to_bytes(2, "little") + b"Z" * padding
    with zip_.open(info, "w") as record:
        for piece in pieces:
            record.write(piece)
    info.extra = b""


def pickled_array(array: Chunks, *, as_text: bool = False) -> Call:
    """The pickled form of an ndarray: `_reconstruct` and a state; `as_text`: bytes as in protocol 2."""
    empty: Any = b"b"
    data: Any = array
    if as_text:
        encode = Global("_codecs", "encode")
        empty = Call(encode, ("b", "latin1"))
        data = Call(encode, (b"".join(array.bytes()).decode("latin1"), "latin1"))
    kind = Call(
        Global("numpy", "dtype"), (array.dtype[1:], False, True), (3, "<", None, None, None, -1, -1, 0)
    )
    reconstruct = Global("numpy.core.multiarray", "_reconstruct")
    return Call(reconstruct, (Global("numpy", "ndarray"), (0,), empty), (1, array.shape, kind, False, data))


def save_npy_dict(path: Path, arrays: dict[str, Chunks]) -> None:
    """The bytes that `np.save(path, {...})` writes: a 0-d object array, pickled with protocol 3."""
    object_type = Call(Global("numpy", "dtype"), ("O8", False, True), (3, "|", None, None, None, -1, -1, 63))
    content = [{name: pickled_array(a) for name, a in arrays.items()}]
    reconstruct = Global("numpy.core.multiarray", "_reconstruct")
    state = (1, (), object_type, False, content)
    with path.open("wb") as f:
        np.lib.format.write_array_header_1_0(f, {"descr": "|O", "fortran_order": False, "shape": ()})
        Pickler(f, 3).dump(Call(reconstruct, (Global("numpy", "ndarray"), (0,), b"b"), state))


def save_pickle(path: Path, content: dict[str, Any]) -> None:
    """A protocol 2 pickle of a dict of Chunks (as ndarrays) and plain values, as FLAME's model files are."""
    plain = {k: pickled_array(v, as_text=True) if isinstance(v, Chunks) else v for k, v in content.items()}
    with path.open("wb") as f:
        Pickler(f, 2).dump(plain)
