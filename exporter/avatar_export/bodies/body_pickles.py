"""chumpy and scipy.sparse objects of FLAME and SMPL pickles: inert stand-ins that checked code turns into arrays.

Facts of the pickled state: chumpy.ch.Ch keeps its array as `x`; chumpy.reordering.Select is
a.ravel()[idxs].reshape(preferred_shape); scipy's csc and csr matrices keep data, indices, indptr and a shape.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.formats.npy import ComputedArray, StoredArray, sizes_of
from avatar_export.formats.pickle.arrays import PickledArray
from avatar_export.formats.pickle.values import Global, StandIn
from avatar_runtime.io.errors import AvatarError

MAX_DENSE_CELLS = 1 << 25  # a joint regressor has 24 x 6890
MAX_NESTED = 8

Array = npt.NDArray[Any]


class _Record(StandIn):
    """An object that is known by its attributes."""

    def __init__(self, file: object):
        self.file = file
        self.state: dict[Any, object] = {}

    def build(self, state: object) -> None:
        if type(state) is not dict:
            raise ValueError("an object's state is not a dict")
        self.state = state

    def wrong(self, message: str, name: str) -> AvatarError:
        return AvatarError(message, file=self.file, field=name)

    def array(self, key: str, name: str) -> StoredArray:
        value = self.state.get(key)
        if not isinstance(value, PickledArray):
            raise self.wrong(f"has no array {key}", name)
        return value.finish(name)


class _Chumpy(_Record):
    """chumpy.ch.Ch"""

    def finish(self, name: str) -> StoredArray | ComputedArray:
        inner: object = self
        for _ in range(MAX_NESTED):
            if not isinstance(inner, _Chumpy):
                break
            inner = inner.state.get("x")
        if not isinstance(inner, (PickledArray, _Select)):
            raise self.wrong("a chumpy object holds no array", name)
        return inner.finish(name)


class _Select(_Record):
    """chumpy.reordering.Select"""

    def finish(self, name: str) -> ComputedArray:
        inner = self.state.get("a")
        if not isinstance(inner, _Chumpy) or not isinstance(inner.state.get("x"), PickledArray):
            raise self.wrong("a chumpy selection does not select from an array", name)
        values, index = inner.array("x", name), self.array("idxs", name)
        shape = sizes_of(self.state.get("preferred_shape", (math.prod(index.shape),)))
        if shape is None:
            raise self.wrong("a chumpy selection has no shape", name)
        if math.prod(shape) != math.prod(index.shape) or index.dtype.kind not in "iu":
            raise self.wrong(f"a chumpy selection of {math.prod(index.shape)} has shape {list(shape)}", name)
        return ComputedArray(name, shape, values.dtype, partial(self._read, values, index, shape, name))

    def _read(self, values: StoredArray, index: StoredArray, shape: tuple[int, ...], name: str) -> Array:
        flat, at = values.read().reshape(-1), index.read().reshape(-1)
        if at.size and (int(at.min()) < 0 or int(at.max()) >= flat.size):
            raise self.wrong(f"a chumpy selection reaches outside its {flat.size} values", name)
        return flat[at].reshape(shape)


class _Sparse(_Record):
    """scipy.sparse csc_matrix (columns compressed) or csr_matrix (rows)."""

    def __init__(self, by_column: bool, file: object):
        super().__init__(file)
        self.by_column = by_column

    def finish(self, name: str) -> ComputedArray:
        shape = sizes_of(self.state.get("_shape", self.state.get("shape")))
        if shape is None or len(shape) != 2:
            raise self.wrong("a sparse matrix has no shape", name)
        if math.prod(shape) > MAX_DENSE_CELLS:
            raise self.wrong(
                f"a sparse matrix of {shape[0]} x {shape[1]} is larger than any joint regressor", name
            )
        values = self.array("data", name)
        return ComputedArray(name, shape, values.dtype, partial(self._read, values, shape, name))

    def _read(self, values: StoredArray, shape: tuple[int, ...], name: str) -> Array:
        data, index, start = values.read(), self.array("indices", name), self.array("indptr", name)
        lines, length = (shape[1], shape[0]) if self.by_column else shape
        if index.dtype.kind not in "iu" or start.dtype.kind not in "iu":
            raise self.wrong("a sparse matrix has indices that are not whole numbers", name)
        at, ptr = index.read(), start.read().astype(np.int64)
        sound = data.ndim == at.ndim == ptr.ndim == 1 and len(at) == len(data) and len(ptr) == lines + 1
        if not sound or ptr[0] != 0 or ptr[-1] != len(data) or (np.diff(ptr) < 0).any():
            raise self.wrong("a sparse matrix has inconsistent arrays", name)
        if at.size and (int(at.min()) < 0 or int(at.max()) >= length):
            raise self.wrong(f"a sparse matrix has an index outside 0..{length - 1}", name)
        line = np.repeat(np.arange(lines), np.diff(ptr))
        dense = np.zeros(shape, np.float64)
        np.add.at(dense, (at, line) if self.by_column else (line, at), data.astype(np.float64))
        return dense


def body_globals(file: Path) -> dict[str, Global]:
    """The names in FLAME's and SMPL's pickles besides NumPy's, Python 2 or 3, old and new scipy."""
    root = Global("object", _not_called)
    classes: dict[str, Callable[..., object]] = {
        "chumpy.ch.Ch": partial(_Chumpy, file),
        "chumpy.Ch": partial(_Chumpy, file),
        "chumpy.reordering.Select": partial(_Select, file),
    }
    for kind in ("csc", "csr"):
        for module in (f"scipy.sparse.{kind}", f"scipy.sparse._{kind}"):
            classes[f"{module}.{kind}_matrix"] = partial(_Sparse, kind == "csc", file)
    names = {name: Global(name, make) for name, make in classes.items()}
    known = frozenset(names.values())

    def reconstruct(kind: object, base: object, state: object) -> object:
        if kind not in known or base is not root or state is not None or not isinstance(kind, Global):
            raise ValueError("an object of another class")
        return kind.make()

    for module in ("copy_reg", "copyreg"):
        names[f"{module}._reconstructor"] = Global("copyreg._reconstructor", reconstruct)
    for module in ("__builtin__", "builtins"):
        names[f"{module}.object"] = root
        names[f"{module}.set"] = Global("set", _members)
    return names


def _members(items: object = ()) -> list[object]:
    """A set of names among chumpy's bookkeeping, which is not used."""
    if not isinstance(items, (list, tuple)):
        raise ValueError("a set is not made from a list")
    return list(items)


def _not_called(*arguments: object) -> object:
    raise ValueError("object is called")
