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

from avatar_export.asm.files import (
    TEMPLATE_HASH,
    is_face,
    is_person,
    load,
    load_person,
    save,
    save_person,
    template_hash,
)
from avatar_export.asm.model import AsmFace, Template
from avatar_runtime.io.errors import AvatarError
from tests.asm_faces import small_face
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
        assert x.dtype == y.dtype
        np.testing.assert_array_equal(x, y)
    assert (a.bone_names, a.weight_rule, dict(a.landmarks)) == (
        b.bone_names,
        b.weight_rule,
        dict(b.landmarks),
    )


def assert_same_person(a: AsmFace, b: AsmFace) -> None:
    assert a.name == b.name
    for name in ("zeta", "pi", "mu", "covariance"):
        np.testing.assert_array_equal(getattr(a.binding, name), getattr(b.binding, name))
    for one, other in zip(a.takes, b.takes, strict=True):
        assert (one.name, one.fps) == (other.name, other.fps)
        for name in TAKE:
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name))


def entries(path: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def test_a_face_comes_back(tmp_path: Path) -> None:
    face = small_face(components=3)
    save(face, tmp_path / "a.npz")
    found = load(tmp_path / "a.npz")
    assert_same_template(found.template, face.template)
    assert_same_person(found, face)


def test_without_colour_and_landmarks(tmp_path: Path) -> None:
    face = small_face(coloured=False, weight_rule="softplus")
    face = replace(face, template=replace(face.template, landmarks={}))
    save(face, tmp_path / "a.npz")
    found = load(tmp_path / "a.npz").template
    assert found.colour is None and not found.landmarks and found.weight_rule == "softplus"


def test_the_same_face_is_the_same_bytes(tmp_path: Path) -> None:
    for name in ("a", "b"):
        save(small_face(), tmp_path / name)
    assert (tmp_path / "a").read_bytes() == (tmp_path / "b").read_bytes()
    with zipfile.ZipFile(tmp_path / "a") as archive:
        assert {i.date_time for i in archive.infolist()} == {(1980, 1, 1, 0, 0, 0)}


def test_numpy_reads_it_and_the_page_has_every_key(tmp_path: Path) -> None:
    save(small_face(), tmp_path / "a.npz")
    save_person(small_face(), tmp_path / "p.npz")
    page = Path("schema/ASM.md").read_text()
    for file in ("a.npz", "p.npz"):
        with np.load(tmp_path / file, allow_pickle=False) as arrays:
            assert arrays["asm_version"].tolist() in (1, [1])
            assert arrays["binding"].shape == (12, 14) and arrays["tau"].shape == (7, 12, 9)
            for key in arrays.files:
                assert f"| `{key}` |" in page or (f"`{key}`" in page and key == TEMPLATE_HASH)


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
    with pytest.raises(AvatarError, match=r"p\.npz: holds a person without the template; a face with its"):
        load(tmp_path / "p.npz")


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
        with pytest.raises(AvatarError, match="fitted with another template"):
            load_person(tmp_path / "p.npz", other)


def test_a_whole_face_needs_no_template(tmp_path: Path) -> None:
    save(small_face(1), tmp_path / "a.npz")
    assert_same_person(load_person(tmp_path / "a.npz", small_face().template), small_face(1))


def test_detection_never_raises(tmp_path: Path) -> None:
    save(small_face(), tmp_path / "a.npz")
    assert is_face(tmp_path / "a.npz")
    (tmp_path / "text.npz").write_text("PK no zip")
    np.savez(tmp_path / "other.npz", vertices=np.zeros(3))
    for path in ("text.npz", "other.npz", "absent.npz", ""):
        assert not is_face(tmp_path / path)


def changed(tmp_path: Path, change: Callable[[Arrays], None]) -> Path:
    """A face's file with some of its arrays changed."""
    save(small_face(), tmp_path / "good.npz")
    with np.load(tmp_path / "good.npz") as stored:
        arrays = dict(stored)
    change(arrays)
    path = tmp_path / "bad.npz"
    np.savez(path, **arrays)
    return path


def put(key: str, value: Any) -> Callable[[Arrays], None]:
    return lambda arrays: arrays.__setitem__(key, np.asarray(value))


def at(key: str, index: Any, value: Any) -> Callable[[Arrays], None]:
    def change(arrays: Arrays) -> None:
        arrays[key][index] = value

    return change


def drop(key: str) -> Callable[[Arrays], None]:
    return lambda arrays: arrays.__delitem__(key)


BAD: dict[str, tuple[Callable[[Arrays], None], str]] = {
    "newer": (put("asm_version", 2), "has version 2; this program reads version 1"),
    "missing": (drop("binding"), "binding: is missing"),
    "a number for a mesh": (put("vertices", np.float32(1)), r"vertices: expected \[rows, 3\], got \[\]"),
    "a number for corners": (put("triangles", np.uint32(1)), r"triangles: expected \[rows, 3\], got \[\]"),
    "far vertex": (at("vertices", (3, 1), 1e20), r"vertices\[3\]: is not finite, or larger than 10000"),
    "far bone": (
        at("rest_position", (4, 0), -2e4),
        r"rest_position\[4\]: is not finite, or larger than 10000",
    ),
    "far away": (
        at("tau", (3, 2, 4), 2e4),
        r"take talk: translation\[1\]: is not finite, or larger than 10000",
    ),
    "large bone": (at("tau", (1, 2, 8), 1e6), r"take smile: scale\[0\]: is not finite, or larger than 10000"),
    "nan": (at("vertices", (3, 1), np.nan), r"vertices\[3\]: is not finite"),
    "beyond float32": (put("uv", np.full((143, 2), 1e300)), r"uv\[0\]: is not finite"),
    "corner": (at("triangles", (5, 2), 999), r"triangles\[5\]: is \[.*\], but there are 143 vertices"),
    "anchor": (at("anchor_vertex", 2, 143), r"anchor_vertex\[2\]: is 143, but"),
    "floats for rows": (put("triangles", np.zeros((4, 3))), "triangles: expected whole numbers"),
    "rows for floats": (put("vertices", np.zeros((4, 3), int)), "vertices: expected floats"),
    "child first": (at("parents", 1, 5), r"parents\[1\]: is 5; a parent"),
    "twice": (at("bone_names", 1, "root"), "'root' is empty, unprintable, has a slash or is a duplicate"),
    "slash": (at("bone_names", 1, "a/b"), "bone_names: 'a/b'"),
    "flat bone": (at("rest_linear", (4, 1), 0), r"rest_linear\[4\]: has no inverse"),
    "colour": (at("colour", (0, 0), 1.5), "colour: is not a display-referred"),
    "rule": (put("weight_rule", ["softmax"]), "weight_rule: 'softmax' is not one of normalised, softplus"),
    "two rules": (put("weight_rule", ["a", "b"]), "weight_rule: expected one string, got 2"),
    "width": (put("binding", np.zeros((12, 13), "f4")), r"binding: expected \[12, 2 \+ 6 K\]"),
    "no component": (put("binding", np.zeros((12, 2), "f4")), r"binding: expected \[12"),
    "pi": (at("binding", (7, 2), 5), r"pi\[7\]: holds a negative weight or does not add up to 1"),
    "covariance": (at("binding", (7, 8), -1), r"covariance\[7\]: is not a covariance"),
    "tau": (put("tau", np.zeros((6, 12, 9), "f4")), r"tau: expected \[7, 12, 9\]"),
    "tau nan": (at("tau", (3, 2, 8), np.inf), r"take talk: scale\[1\]: is not finite"),
    "frames": (put("take_frames", [1, 1]), "take_frames: does not match take_names and take_fps"),
    "negative frames": (put("take_frames", [1, -1, 7]), r"take_frames\[1\]: is negative"),
    "fps": (at("take_fps", 1, 0), "take smile: fps is 0"),
    "no neutral": (at("take_names", 0, "rest"), "the first take must be 'neutral', of one frame"),
    "long neutral": (put("take_frames", [2, 1, 4]), "the first take must be 'neutral', of one frame"),
    "same takes": (at("take_names", 2, "smile"), "'smile' is empty, unprintable or a duplicate"),
    "flat neutral": (
        at("tau", (0, 3, 7), 0),
        "bone nose_tip: has a scale in the neutral that, times those of",
    ),
    "flat chain": (
        at("tau", (0, slice(0, 4), 7), 0.1),
        "bone nose_tip: has a scale in the neutral that, times",
    ),
    "steep chain": (
        at("tau", (0, slice(0, 4), 6), -9),
        "bone nose_tip: has a scale in the neutral that, times",
    ),
    "landmark": (put("landmark_vertices", [1, 999]), r"landmark_vertices\[1\]: is 999"),
    "landmarks": (put("landmark_vertices", [1]), "landmark_vertices: does not match landmark_names"),
    "no triangle": (put("triangles", np.zeros((0, 3), "u4")), "triangles: is empty"),
    "bones": (put("rest_position", np.zeros((11, 3), "f4")), "rest_position: expected floats"),
    "names": (put("bone_names", np.arange(12)), "expected a list of names"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_files_are_refused_in_one_line(tmp_path: Path, name: str) -> None:
    change, message = BAD[name]
    path = changed(tmp_path, change)
    with pytest.raises(AvatarError, match=message) as caught:
        load(path)
    assert "bad.npz" in str(caught.value) and "\n" not in str(caught.value)


def test_objects_are_not_unpickled(tmp_path: Path) -> None:
    with pytest.raises(AvatarError, match="pickled objects"):
        load(changed(tmp_path, put("vertices", np.array([{"a": 1}], object))))


def test_an_entry_that_claims_more_than_it_has(tmp_path: Path) -> None:
    save(small_face(), tmp_path / "good.npz")
    stored = entries(tmp_path / "good.npz")
    stream = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        stream, {"descr": "<f4", "fortran_order": False, "shape": (1 << 40, 3)}
    )
    stored["vertices.npy"] = stream.getvalue() + b"\0" * 100
    with zipfile.ZipFile(tmp_path / "bad.npz", "w") as archive:
        for name, data in stored.items():
            archive.writestr(name, data)
    with pytest.raises(AvatarError, match="the file is damaged"):
        load(tmp_path / "bad.npz")


def test_what_float32_breaks_is_not_written(tmp_path: Path) -> None:
    face = small_face()
    covariance = face.binding.covariance.copy()
    covariance[2, 1] = (1, 1 - 1e-12, 1)  # positive definite as doubles
    bad = replace(face, binding=replace(face.binding, covariance=covariance))
    with pytest.raises(AvatarError, match=r"covariance\[2\]: is not a covariance"):
        save(bad, tmp_path / "a.npz")
    assert not (tmp_path / "a.npz").exists()
    with pytest.raises(AvatarError, match="cannot be written"):
        save(face, tmp_path / "no" / "folder.npz")
