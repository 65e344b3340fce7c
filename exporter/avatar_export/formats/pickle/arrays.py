"""Pickles of NumPy arrays, read without running them: the meaning of each allowed name.

The allow-list is explicit: a name outside it is an error, and a name inside it makes an inert object of this
package, never one of NumPy's. Big arrays stay in the file and are read by rows.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from avatar_export.formats.npy import (
    BYTE_ORDERS,
    ComputedArray,
    RowSource,
    StoredArray,
    fortran_strides,
    npy_header,
    number_type,
    stored_array,
)
from avatar_export.formats.pickle.load import load_pickle
from avatar_export.formats.pickle.machine import Persistent
from avatar_export.formats.pickle.values import Global, Payload, StandIn, make_dict
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file

MAX_DEPTH = 50


class PickledType(StandIn):
    """Stands in for numpy.dtype: a code and a byte order."""

    def __init__(self, code: object, align: object = False, copy: object = False):
        if not isinstance(code, str) or len(code) > 8:
            raise ValueError("a dtype has no code")
        self.code = code
        self.order = "="

    def build(self, state: object) -> None:
        """Take the byte order. Raises ValueError for records and subtypes."""
        if not isinstance(state, tuple) or len(state) < 5 or any(part is not None for part in state[2:5]):
            raise ValueError("a dtype has fields or a subtype")
        if state[1] not in BYTE_ORDERS:
            raise ValueError("a dtype has no byte order")
        self.order = str(state[1])

    @property
    def is_object(self) -> bool:
        """Whether it stands for arrays of Python objects."""
        return self.code.lstrip("<>=|")[:1] == "O"

    def number(self) -> np.dtype[np.generic] | None:
        """The NumPy type, None if it is not a plain number."""
        return number_type(self.code if self.code.startswith(BYTE_ORDERS) else self.order + self.code)

    def finish(self, name: str) -> object:
        """The code of the type."""
        return self.code


class PickledArray(StandIn):
    """Stands in for numpy.ndarray: shape, type and where the bytes lie."""

    def __init__(self, file: object):
        self.file = file
        self.shape: tuple[object, ...] = ()
        self.type: PickledType | None = None
        self.fortran = False
        self.data: object = b""

    def build(self, state: object) -> None:
        """Take shape, type, order and data. Raises ValueError for another state."""
        if not isinstance(state, tuple) or len(state) not in (4, 5):
            raise ValueError("an array has no state")
        shape, kind, fortran, data = state[-4:]  # the oldest pickles have no version in front
        if not isinstance(shape, tuple) or not isinstance(kind, PickledType):
            raise ValueError("an array has no shape or type")
        self.shape, self.type, self.fortran, self.data = shape, kind, bool(fortran), data

    def finish(self, name: str) -> StoredArray:
        """The array over its bytes. Raises AvatarError for objects, and for sizes that do not fit."""
        dtype = self.type.number() if self.type else None
        if dtype is None:
            kind = self.type.code if self.type else "nothing"
            raise AvatarError(
                f"an array of {kind!a} is refused; plain numbers are needed", file=self.file, field=name
            )
        source, offset, length = self._run(name)
        strides = fortran_strides(self.shape) if self.fortran else None
        return stored_array(
            name, source, self.file, shape=self.shape, dtype=dtype, offset=offset, available=length,
            strides=strides, exact=True,
        )  # fmt: skip

    def _run(self, name: str) -> tuple[Path | bytes, int, int]:
        try:
            if isinstance(self.data, Payload):
                return self.data.run()
            data = self.data.encode("latin1") if isinstance(self.data, str) else self.data
        except (UnicodeError, OSError):
            data = None
        if not isinstance(data, bytes):
            raise AvatarError("an array has no data", file=self.file, field=name)
        return data, 0, len(data)


def numpy_globals(file: object) -> dict[str, Global]:
    """The names in pickles of dicts of NumPy arrays, Python 2 or 3, NumPy 1 or 2."""
    array = Global("numpy.ndarray", _not_called)

    def reconstruct(kind: object, shape: object, code: object) -> PickledArray:
        if kind is not array:
            raise ValueError("an array of another class")
        return PickledArray(file)

    def from_buffer(data: object, kind: object, shape: object, order: object) -> PickledArray:
        made = PickledArray(file)
        made.build((shape, kind, order == "F", data))
        return made

    def scalar(kind: object, data: object) -> object:
        made = PickledArray(file)
        made.build(((), kind, False, data))
        return made.finish("scalar").read().item()

    def bytes_of_nothing() -> bytes:  # the data of an empty array in protocols below 3
        return b""

    makers: dict[str, Callable[..., object]] = {
        "_codecs.encode": _encode,
        "collections.OrderedDict": make_dict,
        "__builtin__.bytes": bytes_of_nothing,
        "builtins.bytes": bytes_of_nothing,
        "numpy.dtype": PickledType,
    }
    for core in ("core", "_core"):
        makers[f"numpy.{core}.multiarray._reconstruct"] = reconstruct
        makers[f"numpy.{core}.multiarray.scalar"] = scalar
        makers[f"numpy.{core}.numeric._frombuffer"] = from_buffer
    return {"numpy.ndarray": array, **{name: Global(name, make) for name, make in makers.items()}}


def read_pickle(path: Path, allowed: Mapping[str, Global] | None = None) -> object:
    """What a pickle file describes: dicts, lists, tuples, plain values, and arrays as RowSources.

    `allowed`: names besides NumPy's. Raises AvatarError for every other name and for damage; nothing of the file is
    ever run.
    """
    return finish(load_pickle(path, path, numpy_globals(path) | dict(allowed or {})), "", path)


def parse_pickle(
    data: bytes,
    file: object,
    allowed: Mapping[str, Global] | None = None,
    persistent: Persistent | None = None,
) -> object:
    """As `read_pickle`, for bytes. `persistent` resolves references to data outside the pickle."""
    return finish(load_pickle(data, file, numpy_globals(file) | dict(allowed or {}), persistent), "", file)


def read_pickled_npy(path: Path) -> dict[str, RowSource]:
    """The arrays of an object `.npy`: np.save of a dict of arrays. They stay in the file until read.

    Raises AvatarError if the file is anything else.
    """
    try:
        with open_file(path) as stream:
            shape, _, dtype, offset = npy_header(stream, path, path.stem)
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=path) from error
    if shape != () or dtype.kind != "O":
        raise AvatarError("is not a saved dict of arrays (an object array without dimensions)", file=path)
    root = load_pickle(path, path, numpy_globals(path), offset=offset)
    items = root.data if isinstance(root, PickledArray) and root.type and root.type.is_object else None
    if (
        not isinstance(root, PickledArray)
        or root.shape != ()
        or not isinstance(items, list)
        or len(items) != 1
    ):
        raise AvatarError("is not a saved dict of arrays", file=path)
    return arrays_of(finish(items[0], "", path), path)


def arrays_of(value: object, file: object) -> dict[str, RowSource]:
    """`value` as a dict of named arrays. Raises AvatarError for anything else."""
    if not isinstance(value, dict):
        raise AvatarError("does not hold a dict of arrays", file=file)
    for name, array in value.items():
        if not isinstance(name, str) or not isinstance(array, (StoredArray, ComputedArray)):
            raise AvatarError("is not an array", file=file, field=_printable(name))
    return dict(value)


def finish(value: object, name: str, file: object) -> object:
    """The data that the result of `load_pickle` stands for; messages name parts by their path, such as flame.exp.

    Shared parts are finished once, so that a small pickle cannot unfold into a large tree.
    """
    return _Finisher(file).finish(value, name, 0)


class _Finisher:
    def __init__(self, file: object):
        self.file = file
        self.done: dict[int, object] = {}
        self.open: set[int] = set()

    def finish(self, value: object, name: str, depth: int) -> object:
        if value is None or isinstance(value, (bool, int, float, str, bytes)):
            return value
        if id(value) in self.done:
            return self.done[id(value)]
        if depth > MAX_DEPTH or id(value) in self.open:
            raise AvatarError("contains itself or is nested too deeply", file=self.file, field=name[:80])
        self.open.add(id(value))
        result = self._made(value, name, depth)
        self.open.discard(id(value))
        self.done[id(value)] = result
        return result

    def _made(self, value: object, name: str, depth: int) -> object:
        if isinstance(value, StandIn):
            return value.finish(name)
        if isinstance(value, StoredArray):
            return replace(value, name=name)
        if isinstance(value, Payload):
            try:
                return value.value()
            except (UnicodeError, OSError) as error:
                raise AvatarError("holds damaged text", file=self.file, field=name) from error
        if isinstance(value, dict):
            return {
                key: self.finish(item, f"{name}.{_printable(key)}" if name else _printable(key), depth + 1)
                for key, item in value.items()
            }
        if isinstance(value, (list, tuple)):
            return type(value)(self._items(value, name, depth))
        what = value.name if isinstance(value, Global) else type(value).__name__
        raise AvatarError(f"holds the name {what} where data should be", file=self.file, field=name)

    def _items(self, value: Sequence[object], name: str, depth: int) -> Iterable[object]:
        return [self.finish(item, f"{name}[{i}]", depth + 1) for i, item in enumerate(value)]


def _encode(text: object, encoding: object = "utf8") -> object:
    """How Python 2 protocols carry bytes: latin1 text. Long text stays in the file."""
    if encoding != "latin1":
        raise ValueError("text has another encoding than latin1")
    if isinstance(text, Payload) and text.kind == "utf8":
        return text
    if not isinstance(text, str):
        raise ValueError("something that is not text is encoded")
    return text.encode("latin1")


def _not_called(*arguments: object) -> object:
    raise ValueError("numpy.ndarray is called")


def _printable(key: object) -> str:
    text = str(key)
    return text if text.isprintable() and len(text) <= 80 else ascii(text[:40])
