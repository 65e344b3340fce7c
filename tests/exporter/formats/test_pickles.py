"""Pickles of arrays: what NumPy writes is read without NumPy's constructors; everything else is refused."""

from __future__ import annotations

import copyreg
import datetime
import pickle
import struct
from collections import OrderedDict
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.formats.pickle.arrays import parse_pickle, read_pickle, read_pickled_npy
from tests.exporter.refusals import refused
from tests.hostile import Canary, Reduced, only_avatar_errors, peak_bytes, py2_array, py2_dict, read_all

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
        refused(message, read_pickled_npy, path)


@pytest.mark.parametrize("protocol", range(6))
def test_commands_are_refused_by_name_and_not_run(tmp_path: Path, protocol: int) -> None:
    canary = Canary(tmp_path)
    for name, data in canary.pickles(protocol).items():
        refused(rf"asks for \S*{name.partition('.')[2]}; refused", parse_pickle, data, "f")
        (tmp_path / "evil.pkl").write_bytes(data)
        refused("refused", read_pickle, tmp_path / "evil.pkl")
    assert not canary.file.exists()
    for read in (read_pickle, read_pickled_npy):
        refused("cannot be read", read, tmp_path / "none")


OPERATIONS = (
    *(b"\x80\x02" + rest for rest in (
        b"cposix\nsystem\nU\x04true\x85R.", b"\x82\x01.", b"\x83\x01\x00.", b"\x84\x01\x00\x00\x00.", b"K\x01Q.",
        b"K\x01K\x02\x85R.", b"cnumpy\nndarray\n)R.", b"cnumpy\nndarray\n.", b"cnumpy\ndtype\nU\x02f4\x85R}b.",
        b"]}b.", b"](K\x01K\x02u.", b"K\x01\x86.",
        b"cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\x00\x85U\x01b\x87RNb.",
        b"}(]K\x01u.", b"}K\x01a.", b"c_codecs\nencode\nX\x01\x00\x00\x00aX\x04\x00\x00\x00utf8\x86R.")),
    b"\x80\x04\x8c\x05posix\x8c\x06system\x93\x8c\x04true\x85R.", b"\x80\x04\x8c\x05numpy\x8c\x0bload.__call__\x93.",
    b"(S'true'\niposix\nsystem\n.", b"(cposix\nsystem\nS'true'\no.", b"\x80\x05\x97.", b"\x80\x04(\x91.", b"\x80\x06N.",
    b"Pabc\n.", b"", b".", b"N", b"(", b"0.", b"\x80", b"h\x05.", b"g9\n.", b"Fx\n.", b"t.",
    b"I" + b"9" * 5000 + b"\n.",
)  # fmt: skip


@pytest.mark.parametrize("data", OPERATIONS)
def test_operations_that_no_array_needs(data: bytes) -> None:
    refused(".", parse_pickle, data, "f")


CLAIMS = (
    (b"\x8e", "<Q", 2**62), (b"\x8d", "<Q", 2**64 - 1), (b"\x96", "<Q", 2**40), (b"B", "<I", 2**32 - 1),
    (b"X", "<I", 2**31), (b"T", "<i", 2**31 - 1), (b"T", "<i", -5), (b"\x8b", "<i", 2**31 - 1), (b"\x8b", "<i", -1),
    (b"Nr", "<I", 2**32 - 1), (b"\x95", "<Q", 2**63),
)  # fmt: skip


@pytest.mark.parametrize("claim", [code + struct.pack(kind, length) for code, kind, length in CLAIMS])
def test_a_length_is_believed_only_if_the_bytes_are_there(tmp_path: Path, claim: bytes) -> None:
    path = tmp_path / "x.pkl"
    path.write_bytes(b"\x80\x04" + claim + b"abc")
    assert peak_bytes(lambda: only_avatar_errors(lambda: read_pickle(path))) < 1_000_000
    refused(r"claims \d+ bytes more where 3 are left|negative|damaged|\d+ bytes; refused", read_pickle, path)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"a": np.array([1, "x"], object)}, "a: an array of 'O8' is refused"),
        ({"a": np.array(["x"])}, "a: an array of 'U1' is refused"),
        ({"a": np.zeros(2, [("x", "f4")])}, "dtype has fields"),
        ({(1, 2): 3}, "neither a name nor a number"),
        ({"a": datetime.date(2020, 1, 1)}, r"datetime\.date; refused"),
        (Reduced(copyreg._reconstructor, dict, object, None), "refused"),
    ],
)
def test_what_is_no_plain_number_is_refused(wrong: object, message: str) -> None:
    refused(message, parse_pickle, pickle.dumps(wrong, 4), "f")


def test_an_array_whose_size_is_not_its_data() -> None:
    good = pickle.dumps(np.arange(1000, dtype="<f8").reshape(10, 100), 3)
    assert good.count(b"K\nKd\x86") == 1
    huge, negative = b"J\xff\xff\xff\x7fJ\xff\xff\xff\x7f\x86", b"J\xff\xff\xff\xffKd\x86"
    for shape in (b"K\nKe\x86", b"K\nKc\x86", huge, negative):
        data = good.replace(b"K\nKd\x86", shape)
        assert peak_bytes(lambda d=data: only_avatar_errors(lambda: parse_pickle(d, "f"))) < 1_000_000
        refused("bytes, but there are 8000|has an invalid shape", parse_pickle, data, "f")


def test_depth_is_limited() -> None:
    looped: list[object] = []
    looped.append(looped)
    nested: list[object] = []
    for _ in range(200):
        nested = [nested]
    refused("contains itself", parse_pickle, pickle.dumps(looped), "f")
    refused("nested too deeply", parse_pickle, pickle.dumps(nested), "f")
    refused(".", parse_pickle, b"(" * 100_000 + b"t" * 100_000 + b".", "f")


def test_a_small_pickle_does_not_unfold_into_a_large_tree() -> None:
    shared_part: object = [np.zeros(3)]
    for _ in range(40):
        shared_part = [shared_part, shared_part]
    parse_pickle(pickle.dumps(shared_part), "f")


@pytest.mark.parametrize("call", [b"ccollections\nOrderedDict\nh\x00\x85R0", b"N0h\x00h\x000"])
def test_steps_are_limited(call: bytes) -> None:
    """A long list that is passed again and again must not cost its length each time: this would never end."""
    pairs = pickle.dumps([("a", 1)] * 20_000, 2)[:-1]
    refused("steps", parse_pickle, pairs + call * 400_000 + b".", "f")
