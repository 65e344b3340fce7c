"""Rasteriser `cpu`: the runtime's image to the bit; gradients by the definition and by the textbook."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.backends.cpu.draw.frame import draw
from avatar_runtime.camera import Camera
from avatar_runtime.posed import Clock
from avatar_runtime.stages.activate import Splats as RuntimeSplats
from avatar_trainer.raster.renderer import render
from avatar_trainer.tensors import Splats
from tests.golden import rasteriser_case, rasteriser_names
from tests.measured import Measure
from tests.oracles import one_splat
from tests.runtime.stages.golden_scene import camera_of
from tests.trainer.raster.scenes import INPUTS, drawn, gradients, harsh, leaves, scene, splats_of
from tests.trainer.tensors import relative

TOLERANCE = 1e-4  # of the largest gradient of an input
NO_FLIP = 1e-5  # a splat that one side adds and the other does not shows by more
BOTH = {"cpu": torch.float32, "torch": torch.float64}
SCENES = {
    "degree 0": partial(scene, 11, 150, 0, (70, 50)),
    "degree 1, turned": partial(scene, 12, 150, 1, (70, 50), rotated=True),
    "degree 2, off-centre": partial(scene, 13, 120, 2, (50, 70), principal=(0.25, 0.8)),
    "degree 3, turned": partial(scene, 14, 100, 3, (33, 47), rotated=True),
    "degree 1 of 3": partial(scene, 15, 100, 1, (40, 40), stored_degree=3),
    "opaque": partial(scene, 16, 300, 0, (48, 48), opacity=(0.9, 1.0)),
    "faint": partial(scene, 17, 300, 1, (48, 48), opacity=(0.002, 0.02)),
    "harsh": harsh,
}


@pytest.mark.parametrize("name", SCENES)
def test_gradients_are_the_definitions(name: str, measured: Measure) -> None:
    of = SCENES[name]()
    images = [drawn(of, leaves(of, dtype), by) for by, dtype in BOTH.items()]
    assert float((images[0].colour - images[1].colour).detach().abs().max()) < NO_FLIP
    assert torch.equal(images[0].radius, images[1].radius)
    got, want = (gradients(of, by, dtype) for by, dtype in BOTH.items())
    assert set(got) == set(want) == set(INPUTS)
    for key in INPUTS:
        assert want[key].any(), key
        error = relative(got[key].double(), want[key])
        measured(f"rasteriser cpu, gradient of {key}, relative to the definition's largest", error, TOLERANCE)
        assert error <= TOLERANCE, key


@pytest.mark.parametrize("name", rasteriser_names())
def test_draws_what_the_runtime_draws(name: str) -> None:
    case = rasteriser_case(name).arrays
    arrays = splats_of(case)
    camera, degree = camera_of(case), int(case["sh_degree"])
    want = draw(RuntimeSplats(*arrays), camera, RasterSettings(), degree, case["bg"], "trainer", 1, Clock())
    splats = Splats(*(torch.tensor(array).requires_grad_() for array in arrays))
    got = render(splats, camera, RasterSettings(), degree, torch.tensor(case["bg"]), threads=2)
    np.testing.assert_array_equal(got.colour.detach().numpy(), want.colour)
    np.testing.assert_array_equal(got.alpha.detach().numpy(), 1 - want.transmittance)
    (got.colour.sum() + got.alpha.sum()).backward()
    for tensor in (splats.mean, splats.scale, splats.quat_wxyz, splats.opacity, splats.sh):
        assert tensor.grad is not None
        assert torch.isfinite(tensor.grad).all()


@pytest.mark.parametrize("degree", range(4))
def test_one_splat_by_the_textbook(degree: int, measured: Measure) -> None:
    rng = np.random.default_rng(degree)
    view = Camera.orbit(np.zeros(3), 1.5, 0.5, -0.3, 0.8, 40, 30).camera_from_world.astype(np.float64)
    k = np.array([[50, 0, 17.3], [0, 50, 16.1], [0, 0, 1]])
    camera = Camera.from_opencv(view[:3, :3], view[:3, 3], k, 40, 30)
    quat = rng.normal(size=4)
    values = {
        "mean": rng.normal(0, 0.05, 3),
        "scale": rng.uniform(0.05, 0.15, 3),
        "quat_wxyz": quat / np.linalg.norm(quat),
        "opacity": np.array(0.8),
        "sh": rng.normal(0, 0.2, ((degree + 1) ** 2, 3)),
    }
    inputs = {name: value.astype(np.float32).astype(np.float64) for name, value in values.items()}
    background, weight = np.array([0.25, 0.5, 0.75]), rng.normal(size=4)

    def value(**given: np.ndarray) -> float:
        at = np.array([18.5, 13.5])
        return float(one_splat.pixel({**inputs, **given}, degree, view, k, background, at) @ weight)

    tensors = {name: torch.tensor(v[None]).float().requires_grad_() for name, v in inputs.items()}
    behind = torch.tensor(background).float()
    rendered = render(Splats(**tensors), camera, RasterSettings(), degree, behind, threads=1)
    seen = (
        torch.cat([rendered.colour, rendered.alpha[..., None]], dim=2)[13, 18] @ torch.tensor(weight).float()
    )
    assert float(seen.detach()) == pytest.approx(value(), abs=1e-5)
    seen.backward()
    for name, tensor in tensors.items():
        assert tensor.grad is not None
        gradient, step = tensor.grad[0].double().numpy(), 1e-6
        for _ in range(5):
            along = rng.normal(size=inputs[name].shape)
            if (
                name == "quat_wxyz"
            ):  # the oracle takes any length for a turn; the trainer has a formula of its own
                along -= (along @ inputs[name]) * inputs[name]
            ends = [value(**{name: inputs[name] + sign * step * along}) for sign in (1, -1)]
            off = float((gradient * along).sum()) - (ends[0] - ends[1]) / (2 * step)
            error = abs(off) / float(np.linalg.norm(gradient))
            measured("rasteriser cpu, one splat against textbook differences, relative", error, TOLERANCE)
            assert error <= TOLERANCE, name


def test_same_bits_on_any_number_of_threads() -> None:
    of = scene(31, 3000, 2, (130, 90), rotated=True)
    one, two = (gradients(of, "cpu", torch.float32, threads) for threads in (1, 2))
    for name in INPUTS:
        assert torch.equal(one[name], two[name]), name


def test_nothing_to_draw_has_no_gradient() -> None:
    of = SCENES["degree 0"]()
    s = of.splats
    for mean in (s.mean + 100, s.mean[:0]):
        n = len(mean)
        empty = replace(of, splats=Splats(mean, s.scale[:n], s.quat_wxyz[:n], s.opacity[:n], s.sh[:n]))
        got = gradients(empty, "cpu", torch.float32)
        assert not any(got[name].any() for name in INPUTS[:5])
        assert got["background"].all()
