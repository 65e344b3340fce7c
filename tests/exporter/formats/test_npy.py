"""Arrays in files: every layout read by rows equals NumPy's own reading; lies about sizes are refused."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_export.formats import npy as arrays
from avatar_export.formats.npy import ComputedArray, open_npy, parse_npy, parse_text_npy, stored_array
from avatar_runtime.io.errors import AvatarError
from tests.hostile import MANGLING, mangled, only_avatar_errors, peak_bytes
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


def test_rows_are_a_copy_that_may_be_written(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", numbers((4, 2)))
    source = open_npy(tmp_path / "a.npy")
    source.rows(0, 4)[:] = -1
    np.testing.assert_array_equal(source.read(), numbers((4, 2)))
    in_memory = parse_npy(npy(numbers((4, 2))), "x", "x")
    in_memory.rows(0, 4)[:] = -1
    np.testing.assert_array_equal(in_memory.read(), numbers((4, 2)))


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


def test_a_block_of_a_large_file_takes_little_memory(tmp_path: Path) -> None:
    array = numbers((4000, 16, 50))  # 12.8 MB
    np.save(tmp_path / "c.npy", array)
    np.save(tmp_path / "f.npy", np.asfortranarray(array))
    for name in ("c", "f"):
        source = open_npy(tmp_path / f"{name}.npy")
        assert peak_bytes(lambda s=source: s.rows(10, 110)) < 1_200_000  # 320 kB wanted
        np.testing.assert_array_equal(source.rows(1990, 2010), array[1990:2010])


def test_true_is_any_byte_but_zero() -> None:
    source = stored_array(
        "b", bytes([0, 1, 2, 255]), "f", shape=(4,), dtype=np.dtype("?"), offset=0, available=4
    )
    assert source.read().tolist() == [False, True, True, True]
    assert source.read().dtype == np.bool_
    assert source.rows(0, 4).tolist() == [0, 1, 1, 1]


def test_a_number_too_large_for_float32_is_infinite_without_a_warning() -> None:
    assert np.isinf(parse_npy(npy(np.array([1e300])), "f", "x").rows(0, 1)).all()


def test_computed_array_reads_rows_along_any_axis() -> None:
    array = numbers((4, 3), "<f8")
    source = ComputedArray("c", (4, 3), array.dtype, lambda: array)
    np.testing.assert_array_equal(source.rows(1, 3), array[1:3])
    np.testing.assert_array_equal(source.rows(1, 2, axis=1), array[:, 1:2])
    assert source.rows(0, 1).dtype == np.float32
    with pytest.raises(ValueError, match="within 0:3"):
        source.rows(0, 4, axis=1)


@pytest.mark.parametrize("rows", [(-1, 2), (0, 8), (5, 4)])
def test_rows_that_are_not_there_are_the_callers_mistake(tmp_path: Path, rows: tuple[int, int]) -> None:
    np.save(tmp_path / "a.npy", numbers((7, 3)))
    with pytest.raises(ValueError, match="within 0:7"):
        open_npy(tmp_path / "a.npy").rows(*rows)


def lying(shape: str, descr: str = "'<f4'", fortran: str = "False") -> bytes:
    header = f"{{'descr': {descr}, 'fortran_order': {fortran}, 'shape': {shape}, }}".encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + bytes(48)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (lying("(10000000000, 16, 3, 50)"), "needs 96000000000000 bytes, but there are 48"),
        (lying("(13,)"), "needs 52 bytes, but there are 48"),
        (lying("(11,)"), "needs 44 bytes, but there are 48"),
        (lying("(-1, 3)"), "has an invalid shape"),
        (lying("(True, 12)"), "has an invalid shape"),
        (lying(f"({2**70},)"), "has an invalid shape"),
        (lying("(" + "1," * 40 + ")"), "has an invalid shape"),
        (lying("(12,)", fortran="(((("), "not an .npy array"),
        (lying("__import__('os')"), "not an .npy array"),
        (lying("(12,)", "'<f9'"), "not an .npy array"),
        (lying("(3,)", "'<c16'"), "has type complex128"),
        (lying("(3,)", "'<U4'"), "has type <U4"),
        (lying("(6,)", "[('a', '<f8')]"), "has type"),
        (lying("(2,)", "'(3,)<f8'"), "not an .npy array|has type"),
        (lying("(6,)", "'|O'"), "pickled objects"),
        (lying("(12,)")[:60], "not an .npy array"),
        (b"\x93NUMPY\x03\x00" + lying("(12,)")[8:], "not an .npy array"),
        (b"not an array", "not an .npy array"),
        (b"", "not an .npy array"),
    ],
)
def test_npy_that_lies_or_is_something_else_is_refused(tmp_path: Path, data: bytes, message: str) -> None:
    path = tmp_path / "pos.npy"
    path.write_bytes(data)
    with pytest.raises(AvatarError, match=message) as caught:
        open_npy(path)
    assert caught.value.file == str(path)
    assert peak_bytes(lambda: only_avatar_errors(lambda: open_npy(path))) < 1_000_000


def test_missing_file_and_file_that_shrinks(tmp_path: Path) -> None:
    path = tmp_path / "a.npy"
    with pytest.raises(AvatarError, match="cannot be read"):
        open_npy(path)
    np.save(path, numbers((7, 3)))
    source = open_npy(path)
    path.write_bytes(path.read_bytes()[:-5])
    source.rows(0, 5)
    with pytest.raises(AvatarError, match="truncated"):
        source.read()
    path.unlink()
    with pytest.raises(AvatarError, match="cannot be read"):
        source.rows(0, 1)


@pytest.mark.parametrize("strides", [(0, 1), (1, 1), (2, 1), (3, 2), (-3, 1), (3,), ("3", 1)])
def test_strides_that_overlap_or_are_none_are_refused(strides: tuple[object, ...]) -> None:
    with pytest.raises(AvatarError, match="strides"):
        stored_array(
            "v",
            bytes(4000),
            "f",
            shape=(4, 3),
            dtype=np.dtype("<f4"),
            offset=0,
            available=4000,
            strides=strides,
        )


def test_names_in_npy() -> None:
    names = ("jawOpen", "mouthSmileLeft")
    assert parse_text_npy(npy(np.array(names)), "f", "n") == names
    for wrong in (np.array(names, object), np.array([["a"]]), np.zeros(3), np.array("a")):
        with pytest.raises(AvatarError, match="list of names"):
            parse_text_npy(npy(wrong, allow_pickle=True), "f", "n")
    with pytest.raises(AvatarError, match="size"):
        parse_text_npy(npy(np.array(names))[:-4], "f", "n")
    with pytest.raises(AvatarError, match="unicode"):
        parse_text_npy(npy(np.array(names))[:-4] + b"\xff\xff\xff\x7f", "f", "n")


@MANGLING
@given(
    data=st.sampled_from([npy(numbers((5, 3))), npy(np.asfortranarray(numbers((5, 3), ">f8")))]).flatmap(
        mangled
    )
)
def test_mangled_npy_gives_numbers_or_an_avatar_error(
    tmp_path_factory: pytest.TempPathFactory, data: bytes
) -> None:
    path = tmp_path_factory.getbasetemp() / "mangled.npy"
    path.write_bytes(data)

    def read() -> None:
        source = open_npy(path)
        assert source.read().shape == source.shape
        if source.shape:
            source.rows(0, source.shape[0])

    only_avatar_errors(read)
    only_avatar_errors(lambda: parse_text_npy(data, "f", "n"))


def test_a_zero_does_not_excuse_a_giant_shape(tmp_path: Path) -> None:
    header = b"{'descr': '<f4', 'fortran_order': False, 'shape': (2305843009213693952, 0), }"
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    path = tmp_path / "zero.npy"
    path.write_bytes(b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header)
    with pytest.raises(AvatarError, match="which is too large"):
        open_npy(path).read()
