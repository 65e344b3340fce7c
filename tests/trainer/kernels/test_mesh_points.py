"""Points on and off a mesh that is trained: values, gradients by foot and by normal, and turns."""

from __future__ import annotations

from collections.abc import Mapping

import pytest
import torch
from torch import Tensor

from avatar_runtime.avatar import Rules
from avatar_trainer.kernels.mesh import kernel_mesh
from avatar_trainer.kernels.mesh_points import mesh_points_cpu, placed, turns_cpu
from avatar_trainer.stages.surface import bary_vertex_rotation, embed, pose_mesh, surface_mesh
from tests.measured import Measure
from tests.trainer.kernels.test_parity import compared, same_bits
from tests.trainer.stages.surfaces import SurfaceCase, surface_case

BY_VERTEX = Rules("vertex_quaternion", position="interpolated_normal", scale="none")
BY_JOINTS = Rules("bary_vertex_lbs", position="interpolated_normal", scale="none")


@pytest.mark.parametrize("large", [False, True], ids=["below the floor of normals", "above it"])
def test_it_is_embed_with_gradients_for_the_mesh(large: bool, measured: Measure) -> None:
    case = surface_case(BY_VERTEX)
    barycentric, displacement, quat, log_scale = case.values()
    size = 1.0 if large else 2e-3
    e = case.avatar.embedding
    assert e is not None
    mesh = surface_mesh(size * e.canonical_vertices, e.triangles, 4.0)
    at = placed(kernel_mesh(mesh), case.triangle, barycentric.float())

    def definition(vertices: Tensor, height: Tensor) -> Mapping[str, Tensor]:
        posed = pose_mesh(vertices, mesh, BY_VERTEX)
        return {
            "mean": embed(
                posed, mesh, case.triangle, barycentric, height, quat, log_scale, BY_VERTEX
            ).mean
        }  # fmt: skip

    def kernel(vertices: Tensor, height: Tensor) -> Mapping[str, Tensor]:
        return {"mean": mesh_points_cpu(vertices, height, at)}

    value = gradient = 0.0
    for posed in case.posed:
        inputs = [size * posed, size * displacement]
        worst = compared(kernel, definition, inputs)
        value, gradient = max(value, worst[0]), max(gradient, worst[1])
        assert same_bits(kernel, inputs)
    measured("points on a mesh against the stage, relative", value)
    measured("gradients of points on a mesh, relative", gradient)
    assert value < 1e-6 and gradient < 2e-6


def test_turns_are_those_of_the_stage(measured: Measure) -> None:
    case: SurfaceCase = surface_case(BY_JOINTS)
    barycentric = case.values()[0]
    at = placed(kernel_mesh(case.mesh), case.triangle, barycentric.float())
    worst = 0.0
    for matrix in case.matrix:
        assert matrix is not None
        whole = torch.cat([matrix, torch.ones(len(matrix), 3, 1)], dim=2).float()
        rotation, quat = turns_cpu(whole, at)
        wanted = bary_vertex_rotation(matrix.double(), case.mesh.triangles[case.triangle], barycentric)
        w, x, y, z = quat.double().unbind(1)
        top = torch.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], dim=1)
        worst = max(worst, float((rotation - wanted).abs().max()), float((top - wanted[:, 0]).abs().max()))
    measured("turns under points against the stage", worst, 2e-6)
    assert worst < 2e-6
