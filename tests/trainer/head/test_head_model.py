"""The head model: the files that `python -m tools.ict_head` made, and heads made of them."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from avatar_export.bodies.body_model import read_body_model
from avatar_trainer.head import (
    HEAD_LICENCE,
    build_body_model,
    head_for,
    load_head_model,
    load_tracking_head,
    tracking_body,
    write_body,
)
from avatar_trainer.head.model import DATA

Array = npt.NDArray[Any]

SAMPLES = Path(__file__).parents[3] / "samples" / "data"
SHA256 = {
    DATA / "head_model.npz": "d13c81173836bfba2c4547bd643995d2d73f27cbfed76b92f8f88b45ee8e3726",
    DATA / "tracking_mesh.npz": "ce8f3df5f38937ec5b8a26e31bf70724683839d0f624fb3ff65ea637e3b4bd1e",
    DATA / "LICENSE.ict-facekit.txt": "b20a78d8fc51657e14f3e00c8abb538d786ad00aa63210328c22565e583167e1",
    SAMPLES / "film_heads.npz": "388ce3ead7696dd7d591aad5baf143894dbd27c6dc9d4e6f9a35f5ecf1ae784c",
    SAMPLES / "head.npz": "f9cadb900f339ef5af7e2488f39f5bd55f75089ce9a39ce1fb756932d2b8aa25",
}


@pytest.mark.parametrize("path", SHA256, ids=lambda path: path.name)
def test_data_is_what_its_tool_made(path: Path) -> None:
    assert hashlib.sha256(path.read_bytes()).hexdigest() == SHA256[path]


def test_every_file_of_the_model_is_known() -> None:
    assert {*DATA.iterdir()} == {path for path in SHA256 if path.parent == DATA}
    assert "USC Institute" in (DATA / "LICENSE.ict-facekit.txt").read_text()


def test_the_model_is_a_head_in_metres() -> None:
    head = load_head_model()
    assert head.vertices.shape == (22_991, 3)
    assert head.identity.shape == (60, 22_991, 3)
    left, right = head.eye_centres
    assert left == pytest.approx(right * (-1, 1, 1), abs=1e-5)  # ICT's head is the same on both sides
    assert 0.06 < left[0] - right[0] < 0.065
    ball = np.linalg.norm(head.vertices[head.in_part("left_eye")] - left, axis=1)
    assert (ball > 0.011).all()
    assert (ball < 0.017).all()


@pytest.mark.parametrize("person", [None, 0, 1, 2])
def test_lids_close(person: int | None) -> None:
    """Seen from the front, skin covers every point of both eyeballs at eyeBlink 1, and few of them at 0."""
    head = load_head_model() if person is None else head_for(np.random.default_rng(person).normal(size=60))
    balls = head.in_part("left_eye", "right_eye") & (head.vertices[:, 2] > head.eye_centres[0, 2] + 0.009)
    blink = head.expression("eyeBlinkLeft") + head.expression("eyeBlinkRight")
    skin = head.triangles[head.triangles_in("face", "eye_sockets")]
    assert covered(head.vertices, skin, head.vertices[balls]) < 0.5
    assert covered(head.vertices + blink, skin, head.vertices[balls]) == 1


def test_one_persons_head(tmp_path: Path) -> None:
    model, identity = load_head_model(), np.array([1.0, -2.0])
    head = head_for(identity)
    moved = model.identity[0].astype(float) - 2 * model.identity[1]
    assert head.vertices - model.vertices == pytest.approx(moved, abs=1e-9)
    write_body(head, tmp_path)
    body = read_body_model(tmp_path / "body_model.npz")
    rows = load_tracking_head(head)[1]
    assert body.v_template == pytest.approx(head.vertices[rows], abs=1e-6)
    assert body.identity_dirs.shape == (6000, 3, 0)
    assert body.licence == HEAD_LICENCE
    assert not (tmp_path / "shape.npy").exists()
    with pytest.raises(ValueError, match=r"\(61,\); the head model has 60"):
        head_for(np.zeros(61))


def covered(vertices: Array, triangles: Array, points: Array) -> float:
    """The share of the points [N, 3] that have a triangle before them, along +z."""
    x = points[:, None, :2]
    a, b, c = (vertices[triangles[:, k]] for k in range(3))
    near = np.linalg.norm(a[:, None, :2] - points[None, ::20, :2], axis=2).min(axis=1) < 0.01
    a, b, c = a[near], b[near], c[near]

    def area(p: Array, q: Array, r: Array) -> Array:
        u, v = q - p, r - p
        return u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]

    whole = area(a[:, :2], b[:, :2], c[:, :2])
    whole = np.where(np.abs(whole) < 1e-15, np.nan, whole)
    u, v = area(x, b[:, :2], c[:, :2]) / whole, area(a[:, :2], x, c[:, :2]) / whole
    depth = u * a[:, 2] + v * b[:, 2] + (1 - u - v) * c[:, 2]
    before = (u >= 0) & (v >= 0) & (u + v <= 1) & (depth > points[:, 2:])
    return float(before.any(axis=1).mean())


def test_the_tracking_body_has_the_joints_of_the_whole_one() -> None:
    head = load_head_model()
    body = build_body_model(head)
    coarse = tracking_body(head, body)
    assert len(coarse.v_template) == 6000
    assert coarse.joints == pytest.approx(body.joints, abs=1e-6)
