"""Arrays in files: every layout read by rows equals NumPy's own reading; lies about sizes are refused."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_export.formats import npy as arrays
from avatar_export.formats.npy import ComputedArray, open_npy, parse_text_npy, stored_array
from tests.exporter.refusals import refused
from tests.hostile import only_avatar_errors, peak_bytes
from tests.session.fuzz import examples

CODES = ("<f4", ">f4", "<f8", "<f2", ">i8", "<i4", "<i2", "|i1", "|u1", ">u2", "<u4", "<u8", "|b1")


def npy(array: object, allow_pickle: bool = False) -> bytes:
    stream = io.BytesIO()
    np.save(stream, array, allow_pickle=allow_pickle)
    return stream.getvalue()


def numbers(shape: tuple[int, ...], code: str = "<f4") -> np.ndarray:
    return np.random.default_rng(7).integers(0, 99, shape).astype(code)


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("code", CODES)
def test_npy_of_every_type_and_order_reads_as_numpy_does(tmp_path: Path, code: str, order: str) -> None:
    array = np.asarray(numbers((7, 3, 5), code), order=order)
    np.save(tmp_path / "a.npy", array)
    source = open_npy(tmp_path / "a.npy")
    assert (source.name, source.shape, source.dtype) == ("a", (7, 3, 5), array.dtype)
    whole = source.read()
    np.testing.assert_array_equal(whole, array)
    assert whole.dtype == array.dtype.newbyteorder("=")
    for axis, (start, stop) in enumerate([(2, 6), (0, 3), (4, 5)]):
        block = source.rows(start, stop, axis)
        assert block.dtype == np.float32
        np.testing.assert_array_equal(block, array.take(range(start, stop), axis).astype("f4"))
    assert source.rows(3, 3).shape == (0, 3, 5)


@pytest.mark.parametrize("span", [8, 64, 65536])
@settings(max_examples=examples(40))
@given(data=st.data())
def test_any_view_of_a_buffer_reads_as_numpy_does(span: int, data: st.DataObject) -> None:
    """Transposed, sliced and stepped views, read at once or by pieces (a small SPAN_BYTES)."""
    shape = data.draw(st.lists(st.integers(1, 6), min_size=1, max_size=4))
    base = np.arange(np.prod(shape), dtype=np.float32).reshape(shape)
    view = base.transpose(data.draw(st.permutations(range(len(shape)))))
    for axis in range(view.ndim):
        first = data.draw(st.integers(0, view.shape[axis] - 1))
        step = data.draw(st.integers(1, 3))
        view = view[(slice(None),) * axis + (slice(first, None, step),)]
    first = (view.ctypes.data - base.ctypes.data) // 4
    source = stored_array(
        "v", base.tobytes(), "f", shape=view.shape, dtype=base.dtype, offset=4 * first,
        available=base.nbytes - 4 * first, strides=tuple(s // 4 for s in view.strides),
    )  # fmt: skip
    axis = data.draw(st.integers(0, view.ndim - 1))
    start = data.draw(st.integers(0, view.shape[axis]))
    stop = data.draw(st.integers(start, view.shape[axis]))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arrays, "SPAN_BYTES", span)
        np.testing.assert_array_equal(source.read(), view)
        np.testing.assert_array_equal(source.rows(start, stop, axis), view.take(range(start, stop), axis))


def test_computed_array_reads_rows_along_any_axis() -> None:
    array = numbers((4, 3), "<f8")
    source = ComputedArray("c", (4, 3), array.dtype, lambda: array)
    np.testing.assert_array_equal(source.rows(1, 3), array[1:3])
    np.testing.assert_array_equal(source.rows(1, 2, axis=1), array[:, 1:2])
    assert source.rows(0, 1).dtype == np.float32
    with pytest.raises(ValueError, match="within 0:3"):
        source.rows(0, 4, axis=1)


def lying(shape: str, descr: str = "'<f4'", fortran: str = "False") -> bytes:
    header = f"{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}".encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + bytes(48)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (lying("(10000000000, 16, 3, 50)"), "needs 96000000000000 bytes, but there are 48"),
        *((lying(f"({n},)"), f"needs {4 * n} bytes, but there are 48") for n in (13, 11)),
        *((lying(shape), "has an invalid shape")
          for shape in ("(-1, 3)", "(True, 12)", f"({2**70},)", f"({'1,' * 40})")),
        *((data, "not an .npy array") for data in (
            lying("(12,)", fortran="(((("), lying("__import__('os')"), lying("(12,)", "'<f9'"), lying("(12,)")[:60],
            b"\x93NUMPY\x03\x00" + lying("(12,)")[8:], b"not an array", b"")),
        (lying("(3,)", "'<c16'"), "has type complex128"),
        (lying("(6,)", "'|O'"), "pickled objects"),
        (lying("(2305843009213693952, 0)"), "which is too large"),  # a zero does not excuse it
    ],
)  # fmt: skip
def test_npy_that_lies_or_is_something_else(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "pos.npy"
    path.write_bytes(data)
    assert refused(message, lambda: open_npy(path).read()).file == str(path)
    assert peak_bytes(lambda: only_avatar_errors(lambda: open_npy(path))) < 1_000_000


def test_missing_file_and_file_that_shrinks(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    refused("cannot be read", open_npy, path)
    np.save(path, numbers((7, 3)))
    source = open_npy(path)
    path.write_bytes(path.read_bytes()[:-5])
    source.rows(0, 5)
    refused("truncated", source.read)
    path.unlink()
    refused("cannot be read", source.rows, 0, 1)


def test_names_in_npy() -> None:
    names = ("jawOpen", "mouthSmileLeft")
    assert parse_text_npy(npy(np.array(names)), "f", "n") == names
    for wrong in (np.array(names, object), np.array([["a"]]), np.zeros(3), np.array("a")):
        refused("list of names", parse_text_npy, npy(wrong, allow_pickle=True), "f", "n")
    refused("size", parse_text_npy, npy(np.array(names))[:-4], "f", "n")
    refused("unicode", parse_text_npy, npy(np.array(names))[:-4] + b"\xff\xff\xff\x7f", "f", "n")
