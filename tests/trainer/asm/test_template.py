from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import numpy as np
import pytest
import torch
from samples.asm.data import COMPONENTS, TOPOLOGIES, AsmHead, load_asm_head

from avatar_export.asm.check import check_face
from avatar_export.asm.files import load
from avatar_runtime.io.errors import AvatarError
from avatar_trainer import cli
from avatar_trainer.asm.gmm import fit, misfit
from avatar_trainer.asm.model import Face, TemplateTensors, posed, weights
from avatar_trainer.asm.template.files import at_rest
from avatar_trainer.asm.template.make import landmark_rows, make_template, plane_areas
from avatar_trainer.asm.template.place import MIRRORED, PLACES, place, skeleton, symmetric_landmarks
from avatar_trainer.asm.template.unwrap import folded, unwrap
from avatar_trainer.asm.template.weights import initial_weights
from tests.measured import Measure

SMALL = "rocketbox"


@pytest.fixture(scope="module", params=TOPOLOGIES)
def head(request: pytest.FixtureRequest) -> AsmHead:
    return load_asm_head(request.param)


@pytest.fixture(scope="module")
def small() -> AsmHead:
    return load_asm_head(SMALL)


def test_bones_are_the_papers() -> None:
    bones = skeleton()
    assert len(set(bones.names)) == 84 and bones.names[19] == "lip_corner.R" and bones.parents[0] == -1
    assert all(0 <= parent < j for j, parent in enumerate(bones.parents) if j)
    assert all(MIRRORED[MIRRORED[k]] == k for k in range(68))
    left = {name for name in bones.names if not name.endswith(".R")}
    assert set(PLACES) | {"ear.L"} == left
    assert all(abs(sum(spot.landmarks.values()) - 1) < 1e-12 for spot in PLACES.values())


def test_sample_templates_are_sound(head: AsmHead) -> None:
    check_face(at_rest(head.name, head.template, head.bindings[2]))
    np.testing.assert_allclose(head.weights.sum(axis=1), 1, atol=1e-6)
    assert not folded(head.template.uv, head.template.triangles.astype(np.int64)).any()
    assert len(np.unique(head.template.vertices, axis=0)) == len(head.template.vertices)


def test_bones_stand_where_their_names_say(head: AsmHead) -> None:
    template, names = head.template, head.template.bone_names
    spot = dict(zip(names, template.rest_position, strict=True))
    marks = template.vertices[landmark_rows(template)]
    eyes = np.linalg.norm(marks[45] - marks[36])
    for name in names:
        if name.endswith(".L"):
            other = spot[name[:-2] + ".R"]
            assert spot[name][0] > other[0], name  # the subject's left is at +X
            np.testing.assert_allclose(spot[name][1:], other[1:], atol=1e-7, err_msg=name)
    middle = (spot["lip_corner.L"] + spot["lip_corner.R"])[0] / 2
    for name in ("nose_tip", "chin", "forehead", "head", "root"):
        assert abs(spot[name][0] - middle) < 1e-6, name
    assert spot["forehead"][1] > spot["eyebrow_center"][1] > spot["eye.L"][1] > spot["nose_tip"][1]
    assert spot["nose_tip"][1] > spot["lip_upper_mid"][1] > spot["lip_lower_mid"][1] > spot["chin"][1]
    assert spot["nose_tip"][2] > spot["eye.L"][2] > spot["ear.L"][2]
    for name, mark in {"lip_corner.L": 54, "eye_inner_corner.R": 39, "nose_wing.R": 31}.items():
        assert np.linalg.norm(spot[name] - marks[mark]) < 0.15 * eyes, name


def test_first_mixtures_resemble_first_weights(head: AsmHead, measured: Measure) -> None:
    template = TemplateTensors.of(head.template, torch.float64)
    area, found = plane_areas(head.template), {}
    for components in COMPONENTS:
        face = Face.of(head.bindings[components], dtype=torch.float64)
        found[components] = misfit(area, head.weights, weights(template, face).numpy()).mean
        measured(f"asm first W^g misplaces, {head.name} K={components} of the weight", found[components])
        assert float((posed(template, face) - template.vertices).abs().max()) < 1e-12
    assert found[2] < 0.13 and found[5] < 0.07 and found[5] < found[2]


def test_a_template_is_made_again(small: AsmHead) -> None:
    stored = small.template
    colour = np.full((len(stored.vertices), 3), 0.5)
    template, first = make_template(
        stored.vertices, stored.triangles.astype(np.int64), None, landmark_rows(stored), colour
    )
    np.testing.assert_allclose(template.uv, stored.uv, atol=1e-5)
    np.testing.assert_allclose(template.rest_position, stored.rest_position, atol=1e-7)
    assert np.abs(first - small.weights).sum(axis=1).mean() < 0.05  # eight a vertex are stored
    uv = np.random.default_rng(0).random((len(stored.vertices), 2))
    assert np.array_equal(
        make_template(stored.vertices, stored.triangles.astype(np.int64), uv, landmark_rows(stored))[0].uv,
        uv.astype(np.float32),
    )


def test_doubled_vertices_move_alike(small: AsmHead) -> None:
    """A uv seam: vertices at one place get one uv and one set of weights."""
    stored = small.template
    triangles = stored.triangles.astype(np.int64)
    half = stored.vertices[triangles].mean(axis=1)[:, 0] > 0
    split = triangles.copy()
    split[half] += len(stored.vertices)
    doubled, flat = np.unique(split, return_inverse=True)
    vertices = np.concatenate([stored.vertices] * 2)[doubled]
    rows = np.searchsorted(doubled, np.where(np.isin(landmark_rows(stored), doubled), landmark_rows(stored),
                                             landmark_rows(stored) + len(stored.vertices)))  # fmt: skip
    template, first = make_template(vertices, flat.reshape(-1, 3), None, rows)
    pairs = np.flatnonzero(np.isin(doubled + len(stored.vertices), doubled))
    twins = np.searchsorted(doubled, doubled[pairs] + len(stored.vertices))
    assert len(pairs) > 20
    assert np.array_equal(template.uv[pairs], template.uv[twins])
    assert np.array_equal(first[pairs], first[twins])


def test_weights_belong_to_the_bones_nearby(small: AsmHead) -> None:
    stored = small.template
    share = initial_weights(stored.vertices, stored.triangles.astype(np.int64), stored.rest_position)
    assert share.min() >= 0
    np.testing.assert_allclose(share.sum(axis=1), 1, atol=1e-12)
    apart = np.linalg.norm(stored.vertices[:, None] - stored.rest_position, axis=2)
    assert np.mean(np.sum(share * apart, axis=1) < 2 * apart.min(axis=1)) > 0.9
    strongest = stored.bone_names[share[stored.landmarks["ibug_30"]].argmax()]
    assert strongest == "nose_tip"


def test_mixtures_of_known_weights_are_found() -> None:
    """Points of two bones whose weights are those of mixtures known beforehand."""
    rng = np.random.default_rng(1)
    uv = rng.random((4000, 2))
    centre, spread = np.float64([[0.3, 0.5], [0.7, 0.5]]), 0.08
    density = np.exp(-0.5 * np.square(uv[:, None] - centre).sum(axis=2) / spread**2)
    share = np.concatenate([density, np.full((len(uv), 1), 1e-3), np.zeros((len(uv), 1))], axis=1)
    share /= share.sum(axis=1, keepdims=True)
    found = fit(uv, np.ones(len(uv)), share, np.zeros((4, 2)), 1)
    np.testing.assert_allclose(found.mu[:2, 0, 1], 0.5, atol=0.02)
    assert found.mu[0, 0, 0] < 0.4 < 0.6 < found.mu[1, 0, 0]
    assert found.covariance[3, 0, 0] == 1.0  # moves nothing: thin everywhere
    assert misfit(np.ones(len(uv)), share, share).idle == (3,)
    with pytest.raises(ValueError, match="at least 1"):
        fit(uv, np.ones(len(uv)), share, np.zeros((4, 2)), 0)


def test_landmarks_that_are_none_are_refused(small: AsmHead) -> None:
    stored = small.template
    vertices, triangles, rows = stored.vertices, stored.triangles.astype(np.int64), landmark_rows(stored)
    middle, _ = symmetric_landmarks(vertices[rows].astype(np.float64))
    assert abs(middle) < 1e-3
    swapped = rows[list(MIRRORED)]
    with pytest.raises(AvatarError, match="subject's left"):
        place(vertices, triangles, swapped)
    astray = rows.copy()
    astray[54] = rows[8]
    with pytest.raises(AvatarError, match=r"landmarks\[\d+\]: .* mm from the mirrored mean"):
        place(vertices, triangles, astray)
    with pytest.raises(AvatarError, match="68 vertices"):
        make_template(vertices, triangles, None, rows[:5])


def test_meshes_that_cannot_be_unwrapped_are_refused(small: AsmHead) -> None:
    vertices, triangles = small.template.vertices, small.template.triangles.astype(np.int64)
    two = np.concatenate([vertices, vertices + 1]), np.concatenate([triangles, triangles + len(vertices)])
    with pytest.raises(AvatarError, match="2 pieces"):
        unwrap(*two, 0)
    closed = np.int64([[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]])
    with pytest.raises(AvatarError, match="is closed"):
        unwrap(np.eye(4, 3), closed, 0)
    with pytest.raises(AvatarError, match="more than two triangles"):
        unwrap(vertices, np.concatenate([triangles, triangles[:1]]), 0)
    with pytest.raises(AvatarError, match="no triangle uses"):
        unwrap(np.concatenate([vertices, [[9, 9, 9]]]), triangles, 0)


def test_scans_of_other_people_differ_by_their_coefficients() -> None:
    head = load_asm_head("ict")
    one = head.scan(np.array([0.0, 1.0]))
    np.testing.assert_allclose(one - head.template.vertices, head.identity[1], atol=1e-6)
    assert len(head.identity) == 20


def test_the_command_makes_a_template(
    small: AsmHead, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def train(*arguments: str) -> tuple[int, str]:
        monkeypatch.setattr(sys, "argv", ["avatar-train", *arguments])
        try:
            cli.main()
        except SystemExit as stop:
            return int(stop.code or 0), capfd.readouterr().err
        return 0, capfd.readouterr().err

    stored = small.template
    mesh, marks, out = tmp_path / "head.obj", tmp_path / "landmarks.json", tmp_path / "template.npz"
    lines = [f"v {x} {y} {z}" for x, y, z in (100 * stored.vertices).tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in stored.triangles.tolist()]
    mesh.write_text("\n".join(lines) + "\n")
    rows = landmark_rows(stored).tolist()
    marks.write_text(json.dumps([*rows[:60], *(100 * stored.vertices[rows[60:]]).tolist()]))
    command = ("asm", "template", str(mesh), "--landmarks", str(marks), "-o", str(out), "--units", "100")
    assert train(*command)[0] == 0
    face = load(out)
    assert face.template.bone_names == stored.bone_names and face.takes[0].name == "neutral"
    np.testing.assert_allclose(face.template.rest_position, stored.rest_position, atol=1e-5)
    assert landmark_rows(face.template).tolist() == rows
    for units, apart in ((1, "8.71"), (10000, "0.000871")):
        code, err = train(*command[:-1], str(units), "--force")
        assert code == 2 and re.search(
            rf"head\.obj: the outer corners .* are {re.escape(apart)} m apart; .*is --units", err
        )
    renamed = mesh.with_name("a\tb.obj")
    renamed.write_bytes(mesh.read_bytes())
    monkeypatch.setattr("avatar_trainer.asm.template.files.make_template", None)
    code, err = train(*command[:2], str(renamed), *command[3:], "--force")
    assert code == 2 and err.splitlines()[-1].endswith("name: 'a\\tb' is empty or unprintable")
    marks.write_text("[1, 2]")
    code, err = train(*command, "--force")
    assert code == 2 and err.splitlines()[-1].startswith(f"avatar-train: {marks}: is not a list of 68")
