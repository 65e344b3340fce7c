"""`np.save(path, {...})` without a copy of the arrays in memory, in the names that NumPy before and after 2 knows."""

from __future__ import annotations

import pickle
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

MOST_BYTES = 2**32 - 1  # of one array: the length has four bytes in pickles of protocol 3
# numpy.core.multiarray._reconstruct(numpy.ndarray, (0,), b"b"), then its state (1, shape, dtype, False, bytes).
RECONSTRUCT = b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(K\x00tC\x01btR"
DTYPE = b"cnumpy\ndtype\n(%s\x89\x88tR(K\x03%sNNNJ\xff\xff\xff\xffJ\xff\xff\xff\xff%stb"


def write_npy_dict(path: Path, arrays: Mapping[str, npt.NDArray[Any]]) -> None:
    """A 0-d object array that holds the dict, pickled by protocol 3 as NumPy does; arrays are float32.

    Raises ValueError for another type, or an array of 4 GiB and more.
    """
    for name, array in arrays.items():
        if array.dtype != np.float32 or array.nbytes > MOST_BYTES:
            raise ValueError(
                f"{name} is {array.dtype}{list(array.shape)}; float32 below 4 GiB can be written"
            )
    with path.open("wb") as file:
        np.lib.format.write_array_header_1_0(file, {"descr": "|O", "fortran_order": False, "shape": ()})
        file.write(b"\x80\x03" + RECONSTRUCT + b"(K\x01)" + _dtype("O8", "|", 63) + b"\x89]}(")
        for name, array in arrays.items():
            text = name.encode()
            file.write(b"X" + struct.pack("<I", len(text)) + text)
            _write_array(file, np.ascontiguousarray(array))
        file.write(b"uatb.")


def _write_array(file: IO[bytes], array: npt.NDArray[np.float32]) -> None:
    shape = b"(" + b"".join(b"J" + struct.pack("<i", size) for size in array.shape) + b"t"
    file.write(RECONSTRUCT + b"(K\x01" + shape + _dtype("f4", "<", 0) + b"\x89")
    file.write(pickle.BINBYTES + struct.pack("<I", array.nbytes))
    file.write(array.astype("<f4", copy=False).data)
    file.write(b"tb")


def _dtype(code: str, order: str, flags: int) -> bytes:
    def text(value: str) -> bytes:
        return b"X" + struct.pack("<I", len(value)) + value.encode()

    return DTYPE % (text(code), text(order), b"K" + bytes([flags]))
