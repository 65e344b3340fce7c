"""Baking a body model against the golden vectors (plain sums: test_pose_files), and the small files of a subject."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.bodies.body_model import BodyModel, read_body_model
from avatar_export.bodies.body_rig import bake_rig
from avatar_export.bodies.subject_files import read_eyelids, read_faces, read_shape
from tests.exporter.bodies import body_files
from tests.exporter.refusals import refused
from tests.golden import BlendshapesGolden
from tests.hostile import Torch
from tests.rigs import dense


@pytest.fixture
def body(tmp_path: Path) -> BodyModel:
    model = body_files.body(body_files.FLAME_PARENTS)
    model["expression"][2] = model["expression"][3, :, 1] = model["expression"][4, :2, 0] = 0
    return read_body_model(body_files.write_body(tmp_path / "body.npz", model))


def test_what_does_not_go_with_the_body(body: BodyModel) -> None:
    refused(
        "shape: has 5 coefficients, but the body model has 4", bake_rig, body, np.array([1, 2, 0, 0, 1e-9])
    )
    short = {"left": np.zeros((5, 3), "f4")}
    refused(r"left: has shape \[5, 3\], .* 63 vertices", bake_rig, body, None, short)
    for face in (len(body.triangles), -1):
        refused(rf"anchor faces: \[1\] = {face}, ", bake_rig, body, None, None, np.array([0, face]))


def test_golden(blendshapes_golden: BlendshapesGolden) -> None:
    golden, static, plain = blendshapes_golden, blendshapes_golden.static(), blendshapes_golden.body_model()
    body = read_body_model(golden.body / "body_model.npz")
    lids = read_eyelids(golden.body, body.vertex_count)
    faces = read_faces(golden.body / "back_of_head.txt", len(body.triangles))
    rig = bake_rig(body, read_shape(golden.frame_file(0)), lids, faces)
    joints = -rig.inverse_bind_matrix[:, :3, 3]
    np.testing.assert_allclose(rig.vertices, static["vertices_neutral"], atol=1e-7)
    np.testing.assert_allclose(joints, static["joints_neutral"], atol=1e-7)
    assert rig.anchor_vertices.shape == (168,)
    for column, key in enumerate(("l_eyelid", "r_eyelid")):
        np.testing.assert_allclose(dense(rig.late_morphs, "position")[:, column], plain[key], atol=1e-8)
    for index in range(4):
        frame = golden.frame(index)
        basis = np.tensordot(frame["exp"][: len(body.expression_names)], rig.joint_basis, (0, 0))
        np.testing.assert_allclose(joints + basis, frame["joints_rest"], atol=1e-7)


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
        *((np.zeros(count), rf"got shape \[{count}\]") for count in (301, 0)),
        (np.array([1, np.nan]), r"\[1\] is not a finite number"),
        (np.array([True]), "not an array of numbers"),
        *((text, "shape") for text in (
            "", "{", "{}", "3", '{"shape": {}}', '["a"]', "[NaN]", "[1e999]", "[[1], [2]]", "[true]", "[" * 10**5,
            "[1" + "0" * 5000 + "]", "[1" + "0" * 500 + "]", '{"flame": 3}')),
        ("hello", r"is not a \.frame, \.npy, \.npz or JSON file .* \(line 1, column 1: "),
        (b"\xff\xfe", "it is not UTF-8 text$"),
        ({"exp": SHAPE}, "has no key"),
    ],
)  # fmt: skip
def test_what_is_no_shape(tmp_path: Path, value: Any, message: str) -> None:
    path = tmp_path / "shape"
    if isinstance(value, np.ndarray):
        np.save(path, value)
        path = path.with_suffix(".npy")
    elif isinstance(value, dict):
        Torch().save(path, {"flame": value})
    else:
        path.write_bytes(value if isinstance(value, bytes) else value.encode())
    refused(message, read_shape, path)


def test_eyelids(tmp_path: Path) -> None:
    left, right = np.random.default_rng(1).normal(size=(2, 7, 3))
    np.save(tmp_path / "l_eyelid.npy", left)
    np.save(tmp_path / "r_eyelid.npy", right.astype("f4"))
    lids = read_eyelids(tmp_path, 7)
    assert list(lids) == ["left", "right"] and lids["left"].dtype == np.float32
    np.testing.assert_array_equal(lids["left"], left.astype("f4"))
    np.testing.assert_array_equal(lids["right"], right.astype("f4"))
    refused(r"l_eyelid.npy: expected floats \[8, 3\].* got float64\[7, 3\]", read_eyelids, tmp_path, 8)
    right[5, 1] = np.nan
    np.save(tmp_path / "r_eyelid.npy", right)
    refused(r"r_eyelid\.npy: row 5 is not finite", read_eyelids, tmp_path, 7)
    (tmp_path / "r_eyelid.npy").unlink()
    refused(r"r_eyelid\.npy: cannot be read \(No such file or directory\)$", read_eyelids, tmp_path, 7)


def test_faces(tmp_path: Path) -> None:
    path = tmp_path / "back_of_head.txt"
    path.write_text("5\n3\r\n5, 0\n")
    assert read_faces(path, 6).tolist() == [5, 3, 5, 0] and read_faces(path, 6).dtype == np.int32
    for text, message in (
        ("5 6", r"entry 1 is '6', .* 0\.\.5"), ("1 -1", "entry 1 is '-1'"), ("1.0", "entry 0 is '1.0'"),
        ("٣", "entry 0"), ("9" * 5000, "entry 0"), (" \n", "has no face index"),
    ):  # fmt: skip
        path.write_text(text)
        refused(message, read_faces, path, 6)
    refused(r"cannot be read \(No such file or directory\)$", read_faces, tmp_path / "missing.txt", 6)
    path.write_bytes(b"\xff\xfe")
    refused("it is not UTF-8 text$", read_faces, path, 6)
