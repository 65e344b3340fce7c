"""ASM files: written faces are read again, with the same bytes every time; other files are refused in one line."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.asm import files
from avatar_export.asm.files import is_person, load, load_person, save, save_person, template_hash
from avatar_export.asm.model import AsmFace, Template
from tests.asm_faces import small_face
from tests.exporter.refusals import put, refused
from tests.measured import Measure

Array = npt.NDArray[Any]
Arrays = dict[str, Array]

TEMPLATE = (
    "vertices",
    "triangles",
    "uv",
    "parents",
    "rest_position",
    "rest_linear",
    "anchor_vertex",
    "colour",
)
TAKE = ("rotation_vector", "translation", "scale")


def assert_same_template(a: Template, b: Template) -> None:
    for name in TEMPLATE:
        x, y = getattr(a, name), getattr(b, name)
        assert (x is None) == (y is None) and getattr(x, "dtype", None) == getattr(y, "dtype", None)
        np.testing.assert_array_equal(x, y)
    for name in ("bone_names", "weight_rule", "landmarks"):
        assert getattr(a, name) == getattr(b, name)


def assert_same_person(a: AsmFace, b: AsmFace) -> None:
    assert a.name == b.name
    for name in ("zeta", "pi", "mu", "covariance"):
        np.testing.assert_array_equal(getattr(a.binding, name), getattr(b.binding, name))
    for one, other in zip(a.takes, b.takes, strict=True):
        assert (one.name, one.fps) == (other.name, other.fps)
        for name in TAKE:
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def test_a_face_comes_back(tmp_path: Path) -> None:
    whole = small_face(components=3)
    bare = small_face(coloured=False, weight_rule="softplus")
    bare = replace(bare, template=replace(bare.template, landmarks={}))
    for face in (whole, bare):
        save(face, tmp_path / "a.npz")
        found = load(tmp_path / "a.npz")
        assert_same_template(found.template, face.template)
        assert_same_person(found, face)
        assert_same_person(load_person(tmp_path / "a.npz", whole.template), face)  # needs no template


def test_numpy_reads_it_and_the_page_has_every_key(tmp_path: Path) -> None:
    save(small_face(), tmp_path / "a.npz")
    save_person(small_face(), tmp_path / "p.npz")
    page = Path("schema/ASM.md").read_text()
    for file in ("a.npz", "p.npz"):
        with np.load(tmp_path / file, allow_pickle=False) as arrays:
            assert arrays["asm_version"].tolist() in (1, [1])
            assert arrays["binding"].shape == (12, 14) and arrays["tau"].shape == (7, 12, 9)
            for key in arrays.files:
                assert f"| `{key}` |" in page or (f"`{key}`" in page and key == files.TEMPLATE_HASH)


def test_a_person_alone_is_small_and_goes_with_its_template(tmp_path: Path, measured: Measure) -> None:
    face = small_face(components=2)
    neutral = replace(face, takes=face.takes[:1])
    save_person(neutral, tmp_path / "p.npz")
    size = (tmp_path / "p.npz").stat().st_size
    numbers = 4 * len(face.template.bone_names) * (11 + 6 * 2)  # Table 1 of the paper
    measured("a person's .npz beyond its float32 numbers, bytes", size - numbers)
    assert size - numbers < 3000
    assert is_person(tmp_path / "p.npz")
    assert_same_person(load_person(tmp_path / "p.npz", face.template), neutral)
    refused(r"p\.npz: holds a person without the template; a face with its", load, tmp_path / "p.npz")


def test_a_person_does_not_go_with_another_template(tmp_path: Path) -> None:
    face = small_face()
    save_person(face, tmp_path / "p.npz")
    for other in (
        replace(face.template, weight_rule="softplus"),
        replace(face.template, bone_names=("a", *face.template.bone_names[1:])),
        replace(face.template, uv=face.template.uv + np.float32(1e-3)),
        replace(face.template, colour=None),
    ):
        assert template_hash(other) != template_hash(face.template)
        refused("fitted with another template", load_person, tmp_path / "p.npz", other)


def changed(folder: Path, change: Callable[[Arrays], object]) -> Path:
    """A face's file with some of its arrays changed."""
    save(small_face(), folder / "good.npz")
    with np.load(folder / "good.npz") as stored:
        arrays = dict(stored)
    change(arrays)
    np.savez(folder / "bad.npz", **arrays)
    return folder / "bad.npz"


def new(key: str, value: Any) -> Callable[[Arrays], None]:
    return put(key, np.asarray(value))


FAR = "is not finite, or larger than 10000"
BAD: list[tuple[Callable[[Arrays], object], str]] = [
    (new("asm_version", 2), "has version 2; this program reads version 1"),
    (lambda arrays: arrays.pop("binding"), "binding: is missing"),
    (new("vertices", np.float32(1)), r"vertices: expected \[rows, 3\], got \[\]"),
    *((put("vertices", (3, 1), value), rf"vertices\[3\]: {FAR}") for value in (1e20, np.nan)),
    (put("tau", (3, 2, 4), 2e4), rf"take talk: translation\[1\]: {FAR}"),
    (put("triangles", (5, 2), 999), r"triangles\[5\]: is \[.*\], but there are 143 vertices"),
    (put("anchor_vertex", 2, 143), r"anchor_vertex\[2\]: is 143, but"),
    (new("triangles", np.zeros((4, 3))), "triangles: expected whole numbers"),
    (put("parents", 1, 5), r"parents\[1\]: is 5; a parent"),
    (put("bone_names", 1, "root"), "'root' is .*duplicate"),
    (put("rest_linear", (4, 1), 0), r"rest_linear\[4\]: has no inverse"),
    (put("colour", (0, 0), 1.5), "colour: is not a display-referred"),
    (new("weight_rule", ["softmax"]), "weight_rule: 'softmax' is not one of normalised, softplus"),
    (new("binding", np.zeros((12, 13), "f4")), r"binding: expected \[12, 2 \+ 6 K\]"),
    (put("binding", (7, 2), 5), r"pi\[7\]: holds a negative weight or does not add up to 1"),
    (new("tau", np.zeros((6, 12, 9), "f4")), r"tau: expected \[7, 12, 9\]"),
    (new("take_frames", [1, 1]), "take_frames: does not match take_names and take_fps"),
    (new("take_frames", [1, -1, 7]), r"take_frames\[1\]: is negative"),
    (put("take_fps", 1, 0), "take smile: fps is 0"),
    *((change, "the first take must be 'neutral', of one frame")
      for change in (put("take_names", 0, "rest"), new("take_frames", [2, 1, 4]))),
    (new("name", ["\x1b"]), "name: .*unprintable"),
    *((put("tau", at, value), "bone nose_tip: has a scale in the neutral that, times")
      for at, value in (((0, 3, 7), 0), ((0, slice(0, 4), 7), 0.1), ((0, slice(0, 4), 6), -9))),
    (new("landmark_vertices", [1, 999]), r"landmark_vertices\[1\]: is 999"),
    (new("landmark_vertices", [1]), "landmark_vertices: does not match landmark_names"),
    (new("triangles", np.zeros((0, 3), "u4")), "triangles: is empty"),
    (new("bone_names", np.arange(12)), "expected a list of names"),
    (new("vertices", np.array([{"a": 1}], object)), "pickled objects"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "message"), BAD, ids=[message for _, message in BAD])
def test_bad_files(tmp_path: Path, change: Callable[[Arrays], object], message: str) -> None:
    refused(f"bad.npz.*{message}", load, changed(tmp_path, change))


def test_an_entry_that_claims_more_than_it_has(tmp_path: Path) -> None:
    save(small_face(), tmp_path / "good.npz")
    stream = io.BytesIO()
    header = {"descr": "<f4", "fortran_order": False, "shape": (1 << 40, 3)}
    np.lib.format.write_array_header_1_0(stream, header)
    with zipfile.ZipFile(tmp_path / "good.npz") as good, zipfile.ZipFile(tmp_path / "bad.npz", "w") as bad:
        for name in good.namelist():
            bad.writestr(name, stream.getvalue() + b"\0" * 100 if name == "vertices.npy" else good.read(name))
    refused("the file is damaged", load, tmp_path / "bad.npz")


def test_what_float32_breaks_is_not_written(tmp_path: Path) -> None:
    face = small_face()
    covariance = face.binding.covariance.copy()
    covariance[2, 1] = (1, 1 - 1e-12, 1)  # positive definite as doubles
    bad = replace(face, binding=replace(face.binding, covariance=covariance))
    refused(r"covariance\[2\]: is not a covariance", save, bad, tmp_path / "a.npz")
    assert not (tmp_path / "a.npz").exists()
    refused("cannot be written", save, face, tmp_path / "no" / "folder.npz")
