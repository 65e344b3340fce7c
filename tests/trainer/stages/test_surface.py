"""Gaussians on a mesh: the runtime's and the released code's numbers, and gradients that agree with differences."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
import torch

from avatar_runtime.avatar import Rules
from avatar_runtime.stages import surface as runtime
from avatar_trainer.stages.surface import check_rules, embed, pose_mesh, surface_mesh
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
    with pytest.raises(ValueError, match=next(iter(changed))):
        check_rules(replace(RULES[0], **changed))


@pytest.mark.parametrize("rules", RULES[:12:6], ids=NAMES[:12:6])
def test_what_no_triangle_has_and_what_is_flat_stay_finite(rules: Rules) -> None:
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


def test_the_released_codes_numbers(measured: Measure) -> None:
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
