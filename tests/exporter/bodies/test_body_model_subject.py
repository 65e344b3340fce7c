"""The small files of one subject: shape coefficients from every container, eyelids, anchor faces."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from avatar_export.bodies.subject_files import read_eyelids, read_faces, read_shape
from avatar_runtime.io.errors import AvatarError
from tests.hostile import MANGLING, Torch, mangled, only_avatar_errors

SHAPE = np.linspace(-2, 3, 300, dtype="f4")


def test_shape_from_every_container(tmp_path: Path) -> None:
    frame = Torch().save(tmp_path / "00000.frame", {"flame": {"exp": SHAPE[:5], "shape": SHAPE[None]}})
    np.save(tmp_path / "row.npy", SHAPE[None].astype("f8"))
    np.savez(tmp_path / "betas.npz", betas=SHAPE, poses=np.zeros((9, 72)))
    np.savez(tmp_path / "one.npz", anything=SHAPE)
    (tmp_path / "list.json").write_text(json.dumps(SHAPE.tolist()))
    (tmp_path / "dict.json").write_text(json.dumps({"intrinsics": [1], "shape_params": [SHAPE.tolist()]}))
    names = ("row.npy", "betas.npz", "one.npz", "list.json", "dict.json")
    for path in (frame, *(tmp_path / name for name in names)):
        got = read_shape(path)
        assert got.dtype == np.float64 and got.shape == (300,)
        np.testing.assert_allclose(got, SHAPE, atol=1e-7)


@pytest.mark.parametrize(
    ("value", "message"),
    [
        (np.zeros((2, 10)), r"expected 1 to 300 coefficients, got shape \[2, 10\]"),
        (np.zeros(301), r"got shape \[301\]"),
        (np.zeros(0), r"got shape \[0\]"),
        (np.array([1, np.nan]), r"\[1\] is not a finite number"),
        (np.array([True]), "not an array of numbers"),
        (np.array(["x"]), "has type <U1"),
    ],
)
def test_what_is_no_shape_is_refused(tmp_path: Path, value: Any, message: str) -> None:
    np.save(tmp_path / "shape.npy", value)
    with pytest.raises(AvatarError, match=message):
        read_shape(tmp_path / "shape.npy")


@pytest.mark.parametrize(
    "text",
    ["", "{", "{}", "3", '{"shape": {}}', '["a"]', "[NaN]", "[1e999]", "[[1], [2]]", "[true]", "[" * 10**5,
     "[1" + "0" * 5000 + "]", "[1" + "0" * 500 + "]", '{"flame": 3}'],
)  # fmt: skip
def test_json_that_is_no_shape_is_refused(tmp_path: Path, text: str) -> None:
    path = tmp_path / "shape.json"
    path.write_text(text)
    with pytest.raises(AvatarError, match="shape"):
        read_shape(path)


def test_other_files_are_no_shape(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", poses=np.zeros(3), trans=np.zeros(3))
    with pytest.raises(AvatarError, match="has no array shape"):
        read_shape(tmp_path / "a.npz")
    with pytest.raises(AvatarError, match="has no key"):
        read_shape(Torch().save(tmp_path / "a.frame", {"flame": {"exp": SHAPE}}))
    with pytest.raises(AvatarError, match="not an array of numbers"):
        read_shape(Torch().save(tmp_path / "a.frame", {"flame": {"shape": "text"}}))
    (tmp_path / "latin").write_bytes(b"\xff\xfe")
    (tmp_path / "words").write_text("hello")
    no_shape = r"is not a \.frame, \.npy, \.npz or JSON file with the identity"
    for path, message in (
        (tmp_path / "latin", no_shape + ".* it is not UTF-8 text$"),
        (tmp_path / "words", no_shape + r".* \(line 1, column 1: "),
        (tmp_path / "missing", r"cannot be read \(No such file or directory\)$"),
        (tmp_path, r"cannot be read \(is not a regular file\)$"),
    ):
        with pytest.raises(AvatarError, match=message):
            read_shape(path)


def test_eyelids(tmp_path: Path) -> None:
    left, right = np.random.default_rng(1).normal(size=(2, 7, 3))
    np.save(tmp_path / "l_eyelid.npy", left)
    np.save(tmp_path / "r_eyelid.npy", right.astype("f4"))
    lids = read_eyelids(tmp_path, 7)
    assert list(lids) == ["left", "right"] and lids["left"].dtype == np.float32
    np.testing.assert_array_equal(lids["left"], left.astype("f4"))
    np.testing.assert_array_equal(lids["right"], right.astype("f4"))
    with pytest.raises(AvatarError, match=r"l_eyelid.npy: expected floats \[8, 3\].* got float64\[7, 3\]"):
        read_eyelids(tmp_path, 8)
    right[5, 1] = np.nan
    np.save(tmp_path / "r_eyelid.npy", right)
    with pytest.raises(AvatarError, match=r"r_eyelid\.npy: row 5 is not finite"):
        read_eyelids(tmp_path, 7)
    (tmp_path / "r_eyelid.npy").unlink()
    with pytest.raises(AvatarError, match=r"r_eyelid\.npy: cannot be read \(No such file or directory\)$"):
        read_eyelids(tmp_path, 7)


def test_faces(tmp_path: Path) -> None:
    path = tmp_path / "back_of_head.txt"
    path.write_text("5\n3\r\n5, 0\n")
    assert read_faces(path, 6).tolist() == [5, 3, 5, 0]
    assert read_faces(path, 6).dtype == np.int32
    for text, message in (
        ("5 6", r"entry 1 is '6', expected a face of the body model, 0\.\.5"),
        ("1 -1", "entry 1 is '-1'"),
        ("1.0", "entry 0 is '1.0'"),
        ("٣", "entry 0"),
        ("9" * 5000, "entry 0"),
        (" \n", "has no face index"),
    ):
        path.write_text(text)
        with pytest.raises(AvatarError, match=message):
            read_faces(path, 6)
    with pytest.raises(AvatarError, match=r"cannot be read \(No such file or directory\)$"):
        read_faces(tmp_path / "missing.txt", 6)
    path.write_bytes(b"\xff\xfe")
    with pytest.raises(AvatarError, match=r"is not a text file with face indices.* it is not UTF-8 text$"):
        read_faces(path, 6)


@MANGLING
@given(data=st.data())
def test_mangled_frames_give_a_shape_or_an_avatar_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.getbasetemp() / "mangled.frame"
    Torch().save(path, {"flame": {"shape": SHAPE[None, :9]}, "frame_id": "00000"})
    path.write_bytes(data.draw(mangled(path.read_bytes())))
    only_avatar_errors(lambda: read_shape(path))
