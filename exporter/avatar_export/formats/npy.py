"""Arrays in files (or in bytes) that are read row by row; `.npy` without pickle.

Files are read in blocks, not mapped: resident pages of a mapped file count as memory.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from io import BytesIO, FileIO
from pathlib import Path
from typing import Any, BinaryIO, Protocol

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file

NUMBER_CODES = ("f2", "f4", "f8", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "b1")
BYTE_ORDERS = ("<", ">", "=", "|")
MAX_DIMENSIONS = 32
LARGEST_EXTENT = 1 << 56  # elements; NumPy refuses larger shapes, even empty ones
MAX_HEADER_BYTES = 65536
SPAN_BYTES = 65536  # a span up to this size is read at once, even if only part of it is needed

Array = npt.NDArray[Any]
Fetch = Callable[[int, Array], None]  # byte offset, C-contiguous array to fill


class RowSource(Protocol):
    """An array that can be read block by block."""

    @property
    def name(self) -> str:
        """The name in messages."""
        ...

    @property
    def shape(self) -> tuple[int, ...]:
        """The sizes of all axes."""
        ...

    @property
    def dtype(self) -> np.dtype[Any]:
        """The stored type."""
        ...

    def rows(self, start: int, stop: int, axis: int = 0) -> F32:
        """A float32 copy of the rows start:stop along `axis`; the other axes are complete."""
        ...

    def read(self) -> Array:
        """A copy of the whole array in its own type."""
        ...


def number_type(code: str) -> np.dtype[Any] | None:
    """The NumPy type of a code such as '<f4' if it is a plain number of NUMBER_CODES, else None."""
    order, bare = (code[0], code[1:]) if code.startswith(BYTE_ORDERS) else ("=", code)
    return np.dtype(order + bare) if bare in NUMBER_CODES else None


@dataclass(frozen=True)
class StoredArray:
    """A RowSource over a byte range of a file or of bytes, with any non-overlapping strides (in elements).

    Made by `stored_array`, which checks every size before anything is read.
    """

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    strides: tuple[int, ...]
    offset: int  # bytes, of element 0
    source: Path | bytes = field(repr=False)
    file: str

    def rows(self, start: int, stop: int, axis: int = 0) -> F32:
        """A float32 copy of the rows start:stop along `axis`; the other axes are complete.

        Raises ValueError for rows that do not exist, AvatarError if the file has become shorter since.
        """
        if not 0 <= start <= stop <= self.shape[axis]:
            raise ValueError(f"{self.name}: rows {start}:{stop} are not within 0:{self.shape[axis]}")
        shape = (*self.shape[:axis], stop - start, *self.shape[axis + 1 :])
        block = self._block(shape, self.offset + start * self.strides[axis] * self.dtype.itemsize)
        return _float32(block)

    def read(self) -> Array:
        """A copy of the whole array in its own type and native byte order."""
        return self._block(self.shape, self.offset)

    def _block(self, shape: tuple[int, ...], offset: int) -> Array:
        stored = np.dtype(np.uint8) if self.dtype.kind == "b" else self.dtype
        out = np.empty(shape, stored)
        if out.size:
            with self._opened() as fetch:
                _fill(fetch, offset, out, self.strides)
        if self.dtype.kind == "b":  # any non-zero byte is true; NumPy's own bool must be 0 or 1
            return np.asarray(out != 0)
        result: Array = out.astype(stored.newbyteorder("="), copy=False)
        return result

    @contextmanager
    def _opened(self) -> Iterator[Fetch]:
        if isinstance(self.source, bytes):
            data = np.frombuffer(self.source, np.uint8)

            def copy(offset: int, out: Array) -> None:
                out.reshape(-1).view(np.uint8)[:] = data[offset : offset + out.nbytes]

            yield copy
            return
        try:
            with self.source.open("rb", buffering=0) as stream:

                def fetch(offset: int, out: Array) -> None:
                    stream.seek(offset)
                    _read_exactly(stream, out, self.file, self.name)

                yield fetch
        except OSError as error:
            raise AvatarError(
                f"cannot be read ({error.strerror or error})", file=self.file, field=self.name
            ) from error


@dataclass(frozen=True)
class ComputedArray:
    """A RowSource that is computed when it is read."""

    name: str
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    make: Callable[[], Array] = field(repr=False)

    def rows(self, start: int, stop: int, axis: int = 0) -> F32:
        """A float32 copy of the rows start:stop along `axis`; the other axes are complete."""
        if not 0 <= start <= stop <= self.shape[axis]:
            raise ValueError(f"{self.name}: rows {start}:{stop} are not within 0:{self.shape[axis]}")
        return _float32(np.moveaxis(np.moveaxis(self.make(), axis, 0)[start:stop], 0, axis).copy())

    def read(self) -> Array:
        """The whole array."""
        return self.make()


def stored_array(
    name: str,
    source: Path | bytes,
    file: object,
    *,
    shape: Sequence[object],
    dtype: np.dtype[Any],
    offset: int,
    available: int,
    strides: Sequence[object] | None = None,
    exact: bool = False,
) -> StoredArray:
    """A StoredArray whose elements lie within the `available` bytes from `offset` on, which is checked.

    `strides` in elements, default C order. With `exact`, the array must fill the bytes to the last one.
    Raises AvatarError for invalid dimensions or strides, for overlapping ones, and for those that do not fit.
    """

    def wrong(message: str) -> AvatarError:
        return AvatarError(message, file=file, field=name)

    sizes = sizes_of(shape)
    if sizes is None:
        raise wrong("has an invalid shape")
    steps = c_strides(sizes) if strides is None else sizes_of(strides)
    if steps is None or len(steps) != len(sizes):
        raise wrong("has strides that do not match its shape")
    count = math.prod(sizes)
    if not count and math.prod(max(size, 1) for size in sizes) >= LARGEST_EXTENT:
        raise wrong(f"has a shape of {' x '.join(map(str, sizes))[:80]}, which is too large")
    extent = 0
    if count:
        extent = 1
        for step, size in sorted((step, size) for step, size in zip(steps, sizes, strict=True) if size > 1):
            if step < extent:
                raise wrong("has overlapping strides (an expanded tensor); save a contiguous copy")
            extent += step * (size - 1)
    need = extent * dtype.itemsize
    if need > available or (exact and need != available):
        raise wrong(
            f"{dtype.str[1:]}{list(sizes)} needs {need} bytes, but there are {available}; the file is damaged"
        )
    steps = tuple(step if size > 1 else 0 for step, size in zip(steps, sizes, strict=True))
    return StoredArray(name, sizes, dtype, steps, offset, source, str(file))


def c_strides(shape: Sequence[int]) -> tuple[int, ...]:
    """Strides in elements of a C-contiguous array."""
    return tuple(math.prod(shape[axis + 1 :]) for axis in range(len(shape)))


def fortran_strides(shape: object) -> tuple[int, ...] | None:
    """Strides in elements of a Fortran-contiguous array; None for an invalid shape."""
    sizes = sizes_of(shape)
    return None if sizes is None else c_strides(sizes[::-1])[::-1]


def sizes_of(values: object) -> tuple[int, ...] | None:
    """`values` as a shape of at most MAX_DIMENSIONS whole, non-negative sizes; None if they are not one."""
    if not isinstance(values, (tuple, list)) or len(values) > MAX_DIMENSIONS:
        return None
    sizes = tuple(v for v in values if type(v) is int and 0 <= v < 2**62)
    return sizes if len(sizes) == len(values) else None


def open_npy(path: Path) -> StoredArray:
    """A `.npy` file of plain numbers, C or Fortran order; only its header is read.

    Raises AvatarError for anything else: pickled objects, strings, records, a size that differs from the file's.
    """
    try:
        with open_file(path) as stream:
            size = stream.seek(0, 2)
            stream.seek(0)
            return _stored_npy(stream, size, path, path, path.stem)
    except OSError as error:
        raise AvatarError(f"cannot be read ({error.strerror or error})", file=path) from error


def parse_npy(data: bytes, file: object, name: str) -> StoredArray:
    """As `open_npy`, for the bytes of an entry of an `.npz`."""
    return _stored_npy(BytesIO(data), len(data), data, file, name)


def parse_text_npy(data: bytes, file: object, name: str) -> tuple[str, ...]:
    """The strings of a one-dimensional `.npy` of unicode text. Raises AvatarError for anything else."""
    shape, _, dtype, offset = npy_header(BytesIO(data), file, name)
    if dtype.kind != "U" or dtype.itemsize == 0 or len(shape) != 1:
        raise AvatarError(f"expected a list of names, got {dtype}{list(shape)}", file=file, field=name)
    if shape[0] * dtype.itemsize != len(data) - offset:
        raise AvatarError("its size differs from its header", file=file, field=name)
    size, encoding = dtype.itemsize, "utf-32-be" if dtype.str[0] == ">" else "utf-32-le"
    try:  # NumPy does not check code points
        return tuple(
            data[at : at + size].decode(encoding).rstrip("\0") for at in range(offset, len(data), size)
        )
    except UnicodeError as error:
        raise AvatarError("holds invalid unicode text", file=file, field=name) from error


def npy_header(stream: BinaryIO, file: object, name: str) -> tuple[tuple[int, ...], bool, np.dtype[Any], int]:
    """Shape, Fortran order, type and data offset of a `.npy`. Raises AvatarError for an invalid header."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            version = np.lib.format.read_magic(stream)
            if version not in ((1, 0), (2, 0)):
                raise ValueError(f"version {version}")
            read = (
                np.lib.format.read_array_header_1_0
                if version == (1, 0)
                else np.lib.format.read_array_header_2_0
            )
            shape, fortran, dtype = read(stream, max_header_size=MAX_HEADER_BYTES)
    except Exception as error:  # NumPy parses the header as Python text, which can raise almost anything
        raise AvatarError(f"is not an .npy array ({str(error)[:80]!a})", file=file, field=name) from error
    return shape, bool(fortran), dtype, stream.tell()


def _stored_npy(stream: BinaryIO, size: int, source: Path | bytes, file: object, name: str) -> StoredArray:
    shape, fortran, dtype, offset = npy_header(stream, file, name)
    if dtype.hasobject:
        raise AvatarError("holds pickled objects; plain numbers are needed", file=file, field=name)
    known = number_type(dtype.str)
    if known is None or dtype.fields or dtype.shape:
        raise AvatarError(
            f"has type {str(dtype)[:40]}; one of {', '.join(NUMBER_CODES)} is needed", file=file, field=name
        )
    strides = fortran_strides(shape) if fortran else None
    return stored_array(
        name, source, file, shape=shape, dtype=known, offset=offset, available=size - offset, strides=strides,
        exact=True,
    )  # fmt: skip


def _float32(array: Array) -> F32:
    with np.errstate(over="ignore", invalid="ignore"):  # an overflow becomes infinite, which checks refuse
        result: F32 = array.astype(np.float32, copy=False)
    return result


def _fill(fetch: Fetch, offset: int, out: Array, strides: tuple[int, ...]) -> None:
    """Fill `out` with elements `strides` apart: in one read where that wastes little, else in pieces.

    The pieces follow the axis with the largest stride, so the number of reads is bounded by the bytes spanned
    over SPAN_BYTES plus one per contiguous run.
    """
    item = out.dtype.itemsize
    if out.flags.c_contiguous and all(
        s == c for s, c, n in zip(strides, c_strides(out.shape), out.shape, strict=True) if n > 1
    ):
        fetch(offset, out)
        return
    span = 1 + sum(s * (n - 1) for s, n in zip(strides, out.shape, strict=True))
    if span * item <= max(SPAN_BYTES, 2 * out.nbytes):
        run = np.empty(span, out.dtype)
        fetch(offset, run)
        out[...] = np.lib.stride_tricks.as_strided(
            run, out.shape, [s * item for s in strides], writeable=False
        )
        return
    axis = max((a for a in range(out.ndim) if out.shape[a] > 1), key=lambda a: strides[a])
    step = max(1, SPAN_BYTES // (strides[axis] * item))
    for first in range(0, out.shape[axis], step):
        piece = out[(slice(None),) * axis + (slice(first, first + step),)]
        _fill(fetch, offset + first * strides[axis] * item, piece, strides)


def _read_exactly(stream: FileIO | BytesIO, out: Array, file: str, name: str) -> None:
    view = memoryview(out.reshape(-1).view(np.uint8).data)
    while len(view):
        got = stream.readinto(view)
        if not got:
            raise AvatarError("ends before its data; the file is truncated", file=file, field=name)
        view = view[got:]
