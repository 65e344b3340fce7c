"""Pickles of arrays: what NumPy writes is read without NumPy's constructors; everything else is refused."""

from __future__ import annotations

import colorsys
import copyreg
import datetime
import pickle
import struct
import sys
from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avatar_export.formats.pickle.arrays import parse_pickle, read_pickle, read_pickled_npy
from avatar_runtime.io.errors import AvatarError
from tests.golden import BlendshapesGolden
from tests.hostile import (
    MANGLING,
    Canary,
    Reduced,
    mangled,
    modules,
    only_avatar_errors,
    peak_bytes,
    py2_array,
    py2_dict,
    read_all,
)

RNG = np.random.default_rng(3)
CONTENT: dict[str, Any] = {
    "init_xyz": RNG.normal(size=(9, 3, 50)).astype("f4"),
    "fortran": np.asfortranarray(RNG.normal(size=(4, 3))),
    "big": RNG.normal(size=(2, 3)).astype(">f8"),
    "flags": np.array([[True, False], [False, True]]),
    "whole": np.arange(5, dtype=np.int64),
    "none": np.zeros((0, 3), np.float32),
    "point": np.array(2.5),
    "scalar": np.float32(1.5),
    "flame": {"exp": np.ones((1, 100), np.float32), 3: [1, -(2**40), 2.5, None, True, "text", b"raw"]},
    "ordered": OrderedDict([("a", (1, 2)), ("b", np.zeros(3, np.uint8))]),
    "long text": "ä" * 2000,
}


def same(got: object, want: object) -> None:
    if isinstance(want, dict):
        assert isinstance(got, dict) and list(got) == list(want)
        for key in want:
            same(got[key], want[key])
    elif isinstance(want, (list, tuple)):
        assert type(got) is type(want) and len(got) == len(want)
        for one, other in zip(got, want, strict=True):
            same(one, other)
    elif isinstance(want, np.ndarray):
        assert got.shape == want.shape and got.dtype == want.dtype.newbyteorder("=")
        np.testing.assert_array_equal(got, want)
    else:
        assert got == want


@pytest.mark.parametrize("protocol", range(6))
def test_every_protocol_reads_as_it_was_written(protocol: int) -> None:
    same(read_all(parse_pickle(pickle.dumps(CONTENT, protocol), "f")), CONTENT)


def test_python_2_pickles_read_as_latin1() -> None:
    array, fortran = RNG.normal(size=(70, 3)), np.asfortranarray(RNG.normal(size=(7, 3)).astype("f4"))
    data = py2_dict({"posedirs": py2_array(array), "f": py2_array(fortran), "style": b"U\x04l\xe4ss"})
    same(read_all(parse_pickle(data, "f")), {"posedirs": array, "f": fortran, "style": "läss"})


def test_leaves_are_named_by_their_path() -> None:
    content = parse_pickle(pickle.dumps(CONTENT), "f")
    assert content["flame"]["exp"].name == "flame.exp"
    assert content["ordered"]["b"].name == "ordered.b"
    assert parse_pickle(pickle.dumps((np.zeros(1), [np.zeros(2)])), "f")[1][0].name == "[1][0]"


@pytest.mark.parametrize("protocol", [2, 3, 4, 5])
def test_object_npy_stays_in_the_file(tmp_path: Path, protocol: int) -> None:
    arrays = {"init_sh": RNG.normal(size=(4000, 16, 50)).astype("f4"), "W": np.ones((4000, 5), "f4")}
    path = tmp_path / "acc40000.npy"
    header = tmp_path / "header.npy"
    np.save(header, np.array(None, object), allow_pickle=True)
    path.write_bytes(header.read_bytes()[:128] + pickle.dumps(np.array(arrays, object), protocol))
    if protocol > 2:  # protocol 2 has text in place of bytes, which must be decoded
        assert peak_bytes(lambda: read_pickled_npy(path)["init_sh"].rows(5, 50)) < 500_000
    read = read_pickled_npy(path)
    same(read_all(read), arrays)
    np.testing.assert_array_equal(read["init_sh"].rows(3900, 4000), arrays["init_sh"][3900:])


def test_object_npy_must_be_a_dict_of_arrays(tmp_path: Path) -> None:
    path = tmp_path / "acc.npy"
    for wrong, message in [
        (np.array([{"a": np.zeros(1)}], object), "without dimensions"),
        (np.zeros(3), "without dimensions"),
        (np.array([1, 2], object), "without dimensions"),
        (np.array("text", object), "does not hold a dict of arrays"),
        (np.array({"a": 1}, object), "a: is not an array"),
        (np.array({3: np.zeros(1)}, object), "3: is not an array"),
        (np.array({"a": np.array([None])}, object), "a: an array of 'O8' is refused"),
    ]:
        np.save(path, wrong, allow_pickle=True)
        with pytest.raises(AvatarError, match=message):
            read_pickled_npy(path)


@pytest.mark.parametrize("protocol", range(6))
def test_commands_are_refused_by_name_and_not_run(tmp_path: Path, protocol: int) -> None:
    canary = Canary(tmp_path)
    for name, data in canary.pickles(protocol).items():
        module, _, function = name.partition(".")
        with pytest.raises(AvatarError, match=rf"asks for \S*{function}; refused") as caught:
            parse_pickle(data, "f")
        assert module in {"os", "subprocess", "pickle", "builtins", "numpy"}, caught.value
        path = tmp_path / "evil.pkl"
        path.write_bytes(data)
        with pytest.raises(AvatarError, match="refused"):
            read_pickle(path)
    assert not canary.file.exists()


def test_the_canary_sings_when_it_is_let_out(tmp_path: Path) -> None:
    canary = Canary(tmp_path)
    pickle.loads(canary.pickles(2)["builtins.exec"])
    assert canary.file.exists()


@pytest.mark.parametrize(
    "data",
    [
        b"\x80\x02cposix\nsystem\nU\x04true\x85R.",
        b"\x80\x04\x8c\x05posix\x8c\x06system\x93\x8c\x04true\x85R.",
        b"(S'true'\niposix\nsystem\n.",
        b"(cposix\nsystem\nS'true'\no.",
        b"\x80\x02\x82\x01.",
        b"\x80\x02\x83\x01\x00.",
        b"\x80\x02\x84\x01\x00\x00\x00.",
        b"Pabc\n.",
        b"\x80\x02K\x01Q.",
        b"\x80\x05\x97.",
        b"\x80\x04(\x91.",
        b"\x80\x06N.",
        b"\x80\x02K\x01K\x02\x85R.",
        b"\x80\x02cnumpy\nndarray\n)R.",
        b"\x80\x02cnumpy\nndarray\n.",
        b"\x80\x02cnumpy\ndtype\nU\x02f4\x85R}b.",
        b"\x80\x02]}b.",
        b"\x80\x02}(]K\x01u.",
        b"\x80\x02}K\x01a.",
        b"\x80\x02c_codecs\nencode\nX\x01\x00\x00\x00aX\x04\x00\x00\x00utf8\x86R.",
        b"\x80\x04\x8c\x05numpy\x8c\x0bload.__call__\x93.",
        b"", b".", b"N", b"(", b"0.", b"\x80", b"h\x05.", b"g9\n.", b"Fx\n.", b"t.",
        b"I" + b"9" * 5000 + b"\n.",
    ],
)  # fmt: skip
def test_operations_that_no_array_needs_are_refused(data: bytes) -> None:
    with pytest.raises(AvatarError):
        parse_pickle(data, "f")


@pytest.mark.parametrize(
    "claim",
    [
        b"\x8e" + struct.pack("<Q", 2**62),
        b"\x8d" + struct.pack("<Q", 2**64 - 1),
        b"\x96" + struct.pack("<Q", 2**40),
        b"B" + struct.pack("<I", 2**32 - 1),
        b"X" + struct.pack("<I", 2**31),
        b"T" + struct.pack("<i", 2**31 - 1),
        b"T" + struct.pack("<i", -5),
        b"\x8b" + struct.pack("<i", 2**31 - 1),
        b"\x8b" + struct.pack("<i", -1),
        b"Nr" + struct.pack("<I", 2**32 - 1),
        b"\x95" + struct.pack("<Q", 2**63),
    ],
)
def test_a_length_is_believed_only_if_the_bytes_are_there(tmp_path: Path, claim: bytes) -> None:
    path = tmp_path / "x.pkl"
    path.write_bytes(b"\x80\x04" + claim + b"abc")
    assert peak_bytes(lambda: only_avatar_errors(lambda: read_pickle(path))) < 1_000_000
    with pytest.raises(
        AvatarError, match=r"claims \d+ bytes more where 3 are left|negative|damaged|\d+ bytes; refused"
    ):
        read_pickle(path)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"a": np.array([1, "x"], object)}, "a: an array of 'O8' is refused"),
        ({"a": np.array(["x"])}, "a: an array of 'U1' is refused"),
        ({"a": np.array([1j])}, "a: an array of 'c16' is refused"),
        ({"a": np.zeros(2, [("x", "f4")])}, "dtype has fields"),
        ({"a": np.array(["2020-01-01"], "M8[D]")}, "refused|damaged"),
        ({(1, 2): 3}, "neither a name nor a number"),
        ({None: 3}, "neither a name nor a number"),
        ({1.5: 3}, "neither a name nor a number"),
        ({"a": frozenset({1})}, "refused"),
        ({"a": datetime.date(2020, 1, 1)}, r"datetime\.date; refused"),
        (Reduced(copyreg._reconstructor, dict, object, None), "refused"),
    ],
)
def test_what_is_no_plain_number_is_refused(wrong: object, message: str) -> None:
    with pytest.raises(AvatarError, match=message):
        parse_pickle(pickle.dumps(wrong, 4), "f")


def test_an_array_whose_size_is_not_its_data_is_refused() -> None:
    good = pickle.dumps(np.arange(1000, dtype="<f8").reshape(10, 100), 3)
    assert good.count(b"K\nKd\x86") == 1
    for shape in (
        b"K\nKe\x86",
        b"K\nKc\x86",
        b"J\xff\xff\xff\x7fJ\xff\xff\xff\x7f\x86",
        b"J\xff\xff\xff\xffKd\x86",
    ):
        data = good.replace(b"K\nKd\x86", shape)
        assert peak_bytes(lambda d=data: only_avatar_errors(lambda: parse_pickle(d, "f"))) < 1_000_000
        with pytest.raises(AvatarError, match=r"bytes, but there are 8000|has an invalid shape"):
            parse_pickle(data, "f")


def test_a_list_that_holds_itself_is_refused() -> None:
    looped: list[object] = []
    looped.append(looped)
    with pytest.raises(AvatarError, match="contains itself"):
        parse_pickle(pickle.dumps(looped), "f")


def test_depth_is_limited() -> None:
    nested: list[object] = []
    for _ in range(200):
        nested = [nested]
    with pytest.raises(AvatarError, match="nested too deeply"):
        parse_pickle(pickle.dumps(nested), "f")
    with pytest.raises(AvatarError):
        parse_pickle(b"(" * 100_000 + b"t" * 100_000 + b".", "f")


def test_a_small_pickle_does_not_unfold_into_a_large_tree() -> None:
    shared_part: object = [np.zeros(3)]
    for _ in range(40):
        shared_part = [shared_part, shared_part]
    parse_pickle(pickle.dumps(shared_part), "f")


@pytest.mark.parametrize("call", [b"ccollections\nOrderedDict\nh\x00\x85R0", b"N0h\x00h\x000"])
def test_steps_are_limited(call: bytes) -> None:
    """A long list that is passed again and again must not cost its length each time: this would never end."""
    pairs = pickle.dumps([("a", 1)] * 20_000, 2)[:-1]
    data = pairs.replace(b"q\x00", b"q\x00", 1) + call * 400_000 + b"."
    with pytest.raises(AvatarError, match="steps"):
        parse_pickle(data, "f")


def test_names_that_cannot_be_printed_do_not_break_the_line() -> None:
    for name in ("a\nb", "\x1b[31m", "x" * 500, "\u202e"):
        assert not only_avatar_errors(lambda n=name: parse_pickle(pickle.dumps({n: np.array([None])}), "f"))


SMALL = {
    "a": np.arange(6, dtype="f4").reshape(2, 3),
    "b": [np.float64(2), {"c": np.ones(400, "i2")}],
    "d": "text",
}
SMALL_PICKLES = [pickle.dumps(SMALL, protocol) for protocol in (0, 2, 3, 4, 5)]
SMALL_PICKLES.append(py2_dict({"v": py2_array(np.ones((40, 3))), "s": b"U\x03lbs"}))


@MANGLING
@given(data=st.sampled_from(SMALL_PICKLES).flatmap(mangled))
def test_mangled_pickles_give_data_or_an_avatar_error(data: bytes) -> None:
    only_avatar_errors(lambda: read_all(parse_pickle(data, "f")))


@MANGLING
@given(data=st.binary(max_size=60).map(lambda tail: b"\x80\x04" + tail + b"."))
def test_random_pickles_give_data_or_an_avatar_error(data: bytes) -> None:
    only_avatar_errors(lambda: read_all(parse_pickle(data, "f")))


@MANGLING
@given(data=st.data())
def test_mangled_object_npy_gives_data_or_an_avatar_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.getbasetemp() / "mangled_acc.npy"
    np.save(path, np.array(SMALL | {"b": np.zeros(3), "d": np.ones(2000)}, object), allow_pickle=True)
    path.write_bytes(data.draw(mangled(path.read_bytes())))
    only_avatar_errors(lambda: read_all(read_pickled_npy(path)))


def test_golden_acc_reads_as_numpy_reads_it(blendshapes_golden: BlendshapesGolden) -> None:
    path = blendshapes_golden.raw / "acc40000.npy"
    want = np.load(path, allow_pickle=True).item()  # our own file
    got = read_pickled_npy(path)
    assert set(got) == set(want)
    for key, source in got.items():
        np.testing.assert_array_equal(source.read(), want[key])
    np.testing.assert_array_equal(
        got["pose_blendshape"].rows(9, 99, axis=1), want["pose_blendshape"][:, 9:99]
    )


def test_a_made_up_module_leaves_the_real_one_as_it_was() -> None:
    """Those of torch stayed in it, and later tests loaded checkpoints full of None."""
    real = colorsys.rgb_to_hsv
    with modules(colorsys={"rgb_to_hsv": lambda *_: None}, not_here__inside={"Thing": type("Thing", (), {})}):
        assert sys.modules["colorsys"].rgb_to_hsv is not real
        assert "not_here.inside" in sys.modules
    assert sys.modules["colorsys"] is colorsys
    assert colorsys.rgb_to_hsv is real
    assert "not_here" not in sys.modules
