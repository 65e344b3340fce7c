"""Points lifted from a mesh that is trained: values, gradients by foot and by normal, and turns."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import pytest
import torch
from torch import Tensor

from avatar_runtime.avatar import Rules
from avatar_trainer.kernels.lifted import lifted_cpu, placed, turns_cpu
from avatar_trainer.stages.surface import bary_vertex_rotation, carriers, carry, surface_mesh
from tests.measured import Measure
from tests.trainer.stages.surfaces import Riding, riding
from tests.trainer.test_kernels import compared, same_bits

BY_VERTEX = Rules("vertex_quaternion", position="interpolated_normal", scale="none")
BY_JOINTS = Rules("bary_vertex_lbs", position="interpolated_normal", scale="none")


@pytest.mark.parametrize("large", [False, True], ids=["below the floor of normals", "above it"])
def test_it_is_carry_with_gradients_for_the_mesh(large: bool, measured: Measure) -> None:
    """The surface stage in float64 is the definition; a mesh so fine that normals stay short, and one that is not."""
    ride = riding(BY_VERTEX)
    barycentric, displacement, quat, log_scale = ride.values()
    size = 1.0 if large else 2e-3
    e = ride.avatar.embedding
    assert e is not None
    mesh = surface_mesh(size * e.canonical_vertices, e.triangles, 4.0)
    at = placed(mesh, ride.triangle, barycentric.float())

    def definition(vertices: Tensor, height: Tensor) -> Mapping[str, Tensor]:
        posed = carriers(vertices, mesh, BY_VERTEX)
        return {
            "mean": carry(
                posed, mesh, ride.triangle, barycentric, height, quat, log_scale, BY_VERTEX
            ).mean
        }  # fmt: skip

    def kernel(vertices: Tensor, height: Tensor) -> Mapping[str, Tensor]:
        return {"mean": lifted_cpu(vertices, height, at)}

    value = gradient = 0.0
    for posed in ride.posed:
        inputs = [size * posed, size * displacement]
        worst = compared(kernel, definition, inputs)
        value, gradient = max(value, worst[0]), max(gradient, worst[1])
        assert same_bits(kernel, inputs)
    measured("lifted points against the stage, relative", value)
    measured("gradients of lifted points, relative", gradient)
    assert value < 1e-6 and gradient < 2e-6


def test_turns_are_those_of_the_stage(measured: Measure) -> None:
    ride: Riding = riding(BY_JOINTS)
    barycentric = ride.values()[0]
    at = placed(ride.mesh, ride.triangle, barycentric.float())
    worst = 0.0
    for matrix in ride.matrix:
        assert matrix is not None
        whole = torch.cat([matrix, torch.ones(len(matrix), 3, 1)], dim=2).float()
        rotation, quat = turns_cpu(whole, at)
        wanted = bary_vertex_rotation(matrix.double(), ride.mesh.triangles[ride.triangle], barycentric)
        w, x, y, z = quat.double().unbind(1)
        top = torch.stack([1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)], dim=1)
        worst = max(worst, float((rotation - wanted).abs().max()), float((top - wanted[:, 0]).abs().max()))
    measured("turns under points against the stage", worst)
    assert worst < 2e-6


def test_a_triangle_that_is_not_there_is_refused() -> None:
    ride = riding(BY_VERTEX)
    triangle = ride.triangle.clone()
    triangle[1] = len(ride.mesh.triangles)
    with pytest.raises(ValueError, match="does not name one of"):
        placed(ride.mesh, triangle, replace(ride).values()[0].float())
