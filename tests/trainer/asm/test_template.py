from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from samples.asm.data import COMPONENTS, TOPOLOGIES, AsmHead, load_asm_head

from avatar_export.asm.check import check_face
from avatar_export.asm.files import load
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.asm.gmm import fit, misfit
from avatar_trainer.asm.model import Face, TemplateTensors, posed, weights
from avatar_trainer.asm.template.files import at_rest
from avatar_trainer.asm.template.make import landmark_rows, make_template, plane_areas
from avatar_trainer.asm.template.place import MIRRORED, place, symmetric_landmarks
from avatar_trainer.asm.template.unwrap import cotangent_edges, folded, unwrap, weld
from avatar_trainer.asm.template.weights import CONDUCTED, LEAST, NEAREST, initial_weights, vertex_areas
from tests.measured import Measure

SMALL = "rocketbox"


@pytest.fixture(scope="module", params=TOPOLOGIES)
def head(request: pytest.FixtureRequest) -> AsmHead:
    return load_asm_head(request.param)


@pytest.fixture(scope="module")
def small() -> AsmHead:
    return load_asm_head(SMALL)


def test_sample_templates_are_sound(head: AsmHead) -> None:
    check_face(at_rest(head.name, head.template, head.bindings[2]))
    np.testing.assert_allclose(head.weights.sum(axis=1), 1, atol=1e-6)
    assert not folded(head.template.uv, head.template.triangles.astype(np.int64)).any()
    assert len(np.unique(head.template.vertices, axis=0)) == len(head.template.vertices)


def test_first_mixtures_resemble_first_weights(head: AsmHead, measured: Measure) -> None:
    template = TemplateTensors.of(head.template, torch.float64)
    area, found = plane_areas(head.template), {}
    for components in COMPONENTS:
        face = Face.of(head.bindings[components], dtype=torch.float64)
        found[components] = misfit(area, head.weights, weights(template, face).numpy()).mean
        measured(f"asm first W^g misplaces, {head.name} K={components} of the weight", found[components])
        assert float((posed(template, face) - template.vertices).abs().max()) < 1e-12
    assert found[2] < 0.13 and found[5] < 0.07 and found[5] < found[2]


def test_mixtures_of_known_weights_are_found() -> None:
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


def test_the_command_makes_a_template(
    small: AsmHead, tmp_path: Path, avatar_train: Callable[..., tuple[int, str, str]]
) -> None:
    stored = small.template
    mesh, marks, out = tmp_path / "head.obj", tmp_path / "landmarks.json", tmp_path / "template.npz"
    lines = [f"v {x} {y} {z}" for x, y, z in (100 * stored.vertices).tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in stored.triangles.tolist()]
    mesh.write_text("\n".join(lines) + "\n")
    rows = landmark_rows(stored).tolist()
    marks.write_text(json.dumps([*rows[:60], *(100 * stored.vertices[rows[60:]]).tolist()]))
    command = ("asm", "template", str(mesh), "--landmarks", str(marks), "-o", str(out), "--units", "100")
    assert avatar_train(*command)[0] == 0
    face = load(out)
    assert face.template.bone_names == stored.bone_names and face.takes[0].name == "neutral"
    np.testing.assert_allclose(face.template.rest_position, stored.rest_position, atol=1e-5)
    assert landmark_rows(face.template).tolist() == rows
    for units, apart in ((1, "8.71"), (10000, "0.000871")):
        code, _, err = avatar_train(*command[:-1], str(units), "--force")
        assert code == 2 and re.search(
            rf"head\.obj: the outer corners .* are {re.escape(apart)} m apart; .*is --units", err
        )
    marks.write_text("[1, 2]")
    code, _, err = avatar_train(*command, "--force")
    assert code == 2 and err.splitlines()[-1].startswith(f"avatar-train: {marks}: is not a list of 68")


SIDE = 9  # vertices along a sheet


def test_heat_is_the_solution_of_its_linear_system(measured: Measure) -> None:
    x, y = np.meshgrid(np.linspace(0, 0.1, SIDE), np.linspace(0, 0.1, SIDE))
    vertices = np.stack([x.ravel(), y.ravel(), 0.02 * np.sin(40 * x.ravel())], axis=1)
    corner = (np.arange(SIDE - 1)[:, None] * SIDE + np.arange(SIDE - 1)).ravel()
    triangles = np.concatenate([
        np.stack([corner, corner + 1, corner + SIDE + 1], axis=1),
        np.stack([corner, corner + SIDE + 1, corner + SIDE], axis=1),
    ])  # fmt: skip
    bones = np.array([[0.01, 0.02, 0.0], [0.08, 0.03, 0.01], [0.05, 0.09, -0.01]])
    mesh = weld(vertices, triangles)
    distance = np.linalg.norm(mesh.vertices[:, None] - bones, axis=2)
    conducted = vertex_areas(mesh) * CONDUCTED / np.maximum(distance.min(axis=1), NEAREST) ** 2
    matrix = np.diag(conducted)
    for (a, b), weight in zip(*cotangent_edges(mesh), strict=True):
        matrix[[a, b], [a, b]] += weight
        matrix[[a, b], [b, a]] -= weight
    heat = np.linalg.solve(matrix, conducted[:, None] * (distance.argmin(axis=1)[:, None] == np.arange(3)))
    heat = np.maximum(heat, 0) / np.maximum(heat, 0).sum(axis=1, keepdims=True)
    heat[heat < LEAST] = 0
    heat /= heat.sum(axis=1, keepdims=True)
    worst = float(np.abs(initial_weights(vertices, triangles, bones) - heat[mesh.row]).max())
    measured("first skin weights against a dense solution", worst)
    assert worst < 1e-6
