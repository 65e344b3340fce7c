"""Gaussians on a mesh: the runtime's and the released code's numbers, and gradients that agree with differences."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor
from torch.autograd import gradcheck

from avatar_runtime.avatar import Rules
from avatar_runtime.stages import surface as runtime
from avatar_trainer.stages.surface import bary_vertex_rotation, check_rules, embed, pose_mesh, surface_mesh
from tests.measured import Measure
from tests.shared_data import shared
from tests.trainer.stages.surfaces import NAMES, RULES, embedded, surface_case
from tests.trainer.tensors import largest, leaves, tensor


@pytest.mark.parametrize("rules", RULES, ids=NAMES)
def test_the_runtimes_numbers(rules: Rules, measured: Measure) -> None:
    given = surface_case(rules)
    avatar = given.avatar
    assert avatar.embedding is not None
    surface = runtime.prepare(avatar.embedding, rules, avatar.training_per_bundle)
    for vertices, matrix in zip(given.posed, given.matrix, strict=True):
        linear = None if matrix is None else matrix.numpy()
        expected = runtime.pose_embedded(surface, vertices.numpy(), avatar.gaussians.log_scale, linear)
        for name, value in embedded(given, matrix, vertices, *given.values()).items():
            difference = largest(value, getattr(expected, name))
            measured(f"trainer surface: largest difference of {name} to the runtime", difference)
            assert difference <= 4e-6 * max(1, float(np.abs(getattr(expected, name)).max())), name


@pytest.mark.parametrize("rules", RULES[:12:3], ids=NAMES[:12:3])
def test_the_floors_of_a_fine_mesh(rules: Rules) -> None:
    """Triangles so small that sums are divided by the floors, which shortens what they give."""
    given = surface_case(rules)
    e, u = given.avatar.embedding, given.avatar.training_per_bundle
    assert e is not None
    fine = replace(e, canonical_vertices=e.canonical_vertices * np.float32(1.5e-3))
    surface = runtime.prepare(fine, rules, u)
    posed = 1.5e-3 * given.posed[0]
    own = pose_mesh(posed, surface_mesh(fine.canonical_vertices, fine.triangles, u), rules)
    normals = runtime.vertex_normals(surface, posed.numpy())
    shape = runtime.triangle_shape(posed.numpy(), fine.triangles, rules)
    by_rule = {
        "vertex_quaternion": runtime.vertex_quaternions,
        "vertex_quaternion_mean": runtime.mean_quaternions,
    }
    quats = by_rule[rules.rotation](surface, shape)
    assert np.linalg.norm(normals, axis=1).min() < 0.9
    if rules.rotation == "vertex_quaternion":
        assert np.linalg.norm(quats, axis=1).min() < 0.9
    assert largest(own.vertex_normal, normals) <= 1e-7 and largest(own.vertex_turn, quats) <= 1e-7


@pytest.mark.parametrize("rules", RULES[:12], ids=NAMES[:12])
def test_gradients_agree_with_differences(rules: Rules) -> None:
    given = surface_case(rules)
    some = replace(given, triangle=given.triangle[:5])

    def stage(vertices: Tensor, *values: Tensor) -> tuple[Tensor, ...]:
        result = embedded(some, given.matrix[1], vertices, *values)
        assert not result["rotation"].requires_grad
        return result["mean"], result["quat_wxyz"], result["log_scale"]

    values = [value[:5] for value in given.values()]
    assert gradcheck(stage, leaves([given.posed[1], *values]), atol=1e-4)


@pytest.mark.parametrize("rules", RULES[12:], ids=NAMES[12:])
def test_gradients_of_rigged_rules_but_for_the_turn(rules: Rules) -> None:
    """Those of the mean and of the local quaternion; matrices and what lies under them get none."""
    given = surface_case(rules)
    some, matrix = replace(given, triangle=given.triangle[:5]), given.matrix[1]
    assert matrix is not None
    vertices, barycentric, displacement, local, log_scale = (
        given.posed[1],
        *(value[:5] for value in given.values()),
    )

    def mean(*moving: Tensor) -> Tensor:
        return embedded(some, matrix.double(), *moving, local.double(), log_scale.double())["mean"]

    def turned(quat: Tensor) -> Tensor:
        result = embedded(some, matrix, vertices, barycentric, displacement, quat, log_scale)
        assert not result["rotation"].requires_grad
        return result["quat_wxyz"].double()

    assert gradcheck(mean, leaves([vertices, barycentric, displacement]), atol=1e-4)
    assert gradcheck(turned, leaves([local]), atol=1e-4)


def test_a_rotation_under_each_gaussian_has_gradients() -> None:
    """`bary_vertex_rotation` alone, for those who move joints or barycentrics."""
    given = surface_case(RULES[12])
    matrix, corners = given.matrix[1], given.mesh.triangles[given.triangle[:5]]
    assert matrix is not None
    inputs = leaves([matrix, given.values()[0][:5]])
    turn = bary_vertex_rotation(inputs[0], corners, inputs[1]).detach()
    assert largest(turn @ turn.transpose(1, 2), np.broadcast_to(np.eye(3), (5, 3, 3))) <= 1e-5
    assert gradcheck(lambda m, b: bary_vertex_rotation(m, corners, b), inputs, atol=1e-4)


def test_matrices_go_with_the_rule_that_reads_them() -> None:
    given, matrix = surface_case(RULES[12]), surface_case(RULES[12]).matrix[0]
    assert matrix is not None
    for rules, linear in ((RULES[12], None), (RULES[0], matrix)):
        with pytest.raises(ValueError, match="vertex_matrix goes with bary_vertex_lbs"):
            pose_mesh(given.posed[0], given.mesh, rules, linear)
    with pytest.raises(ValueError, match=r"vertex_matrix is \(19, 3, 3\), not \[20, 3, 3 or 4\]"):
        pose_mesh(given.posed[0], given.mesh, RULES[12], matrix[1:])


@pytest.mark.parametrize("rules", RULES, ids=NAMES)
def test_the_canonical_mesh_changes_nothing(rules: Rules) -> None:
    given = surface_case(rules)
    e, values = given.avatar.embedding, given.values()
    assert e is not None
    still = None if given.matrix[0] is None else torch.eye(3).expand(given.mesh.vertices, 3, 3)
    result = embedded(given, still, tensor(e.canonical_vertices), *values)
    assert torch.allclose(result["quat_wxyz"], values[2], atol=1e-5)
    assert torch.allclose(result["log_scale"], values[3], atol=1e-6)
    assert torch.allclose(result["rotation"], torch.eye(3).expand(48, 3, 3), atol=1e-6)


@pytest.mark.parametrize(
    "changed",
    [
        {"rotation": "triangle_frame"},
        {"position": "triangle_frame"},
        {"scale": "triangle_linear"},
        {"quaternion_sign": "largest_positive"},
    ],
)
def test_rules_that_are_not_trained_are_refused(changed: dict[str, str]) -> None:
    given, rules = surface_case(RULES[0]), replace(RULES[0], **changed)
    (name,) = changed
    with pytest.raises(ValueError, match=name):
        check_rules(rules)
    with pytest.raises(ValueError, match="is not trained"):
        pose_mesh(given.posed[0], given.mesh, rules)
    under = pose_mesh(given.posed[0], given.mesh, RULES[0])
    with pytest.raises(ValueError, match="is not trained"):
        embed(under, given.mesh, given.triangle, *given.values(), rules)


@pytest.mark.parametrize("rules", RULES[:12:6], ids=NAMES[:12:6])
def test_what_no_triangle_has_and_what_is_flat_stay_finite(rules: Rules) -> None:
    """A vertex alone, a triangle without area, and a triangle in another pose without area."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [2, 0, 0], [9, 9, 9]], np.float32)
    mesh = surface_mesh(corners, np.array([[0, 1, 2], [0, 1, 3]], np.uint32), 1.0)
    (vertices,) = leaves([tensor(corners)])
    under = pose_mesh(vertices, mesh, rules)
    assert torch.isfinite(under.vertex_normal).all() and torch.isfinite(under.vertex_turn).all()
    assert not under.vertex_normal[4].any() and not under.vertex_turn[4].any()
    third = torch.full((1, 3), 1 / 3, dtype=torch.float64)
    quat, scale = torch.ones(1, 4).double(), torch.zeros(1, 3).double()
    result = embed(under, mesh, torch.tensor([0]), third, third[:, 0], quat, scale, rules)
    (slope,) = torch.autograd.grad(result.mean.sum() + result.log_scale.sum(), vertices)
    assert torch.isfinite(slope).all()


def test_a_triangle_of_missing_vertices_is_refused() -> None:
    with pytest.raises(ValueError, match="vertex 3, but there are 3"):
        surface_mesh(np.zeros((3, 3), np.float32), np.array([[0, 1, 3]], np.uint32), 1.0)


def test_the_released_codes_numbers(measured: Measure) -> None:
    """SplattingAvatar's own posed Gaussians of its small case."""
    folder = shared("golden/splatting_avatar/splatting_avatar/small_sh0")
    upstream = folder / "run/point_cloud/iteration_30000"
    lines = [line.split() for line in (upstream / "embedding.obj").read_text("utf-8").splitlines()]
    corners = np.array([line[1:4] for line in lines if line and line[0] == "v"], np.float32)
    embedding = json.loads((upstream / "embedding.json").read_text("utf-8"))
    with np.load(folder / "static.npz") as static:
        triangles, units = static["faces"].astype(np.uint32), float(static["units_per_metre"])
        log_scale = tensor(static["scale_log"] - np.log(units))
    mesh = surface_mesh(corners / np.float32(units), triangles, units)
    values = (
        tensor(np.array(embedding["sample_bary"])),
        tensor(np.array(embedding["_xyz"])[:, 2] / units),
        tensor(np.array(embedding["_rotation"])),
        log_scale,
    )
    at = torch.tensor(embedding["sample_fidxs"])
    rules = Rules("vertex_quaternion", position="normal", scale="log_area")
    found = sorted((folder / "expected").glob("*.npz"))
    assert found
    for path in found:
        with np.load(path) as expected:
            posed = tensor(expected["posed_vertices"] / units)
            result = embed(pose_mesh(posed, mesh, rules), mesh, at, *values, rules)
            moved = largest(units * result.mean, expected["xyz"])
            scale = units * result.log_scale.exp()
            grown = float(np.abs(scale.numpy() / expected["scale_on"] - 1).max())
            quat = torch.nn.functional.normalize(result.quat_wxyz, dim=1)
            quat = torch.where(quat[:, :1] < 0, -quat, quat)
            turned = largest(quat, expected["rotation"])
        measured("trainer surface: largest difference to the released code", max(moved, turned, grown))
        assert moved <= 2e-6 and turned <= 5e-6 and grown <= 1e-5, path.name
