"""Rasteriser `cpu`: the runtime's image to the bit; gradients by the definition, by differences, by hand."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.backends.cpu.draw.frame import draw
from avatar_runtime.backends.cpu.jit import SOURCES
from avatar_runtime.camera import Camera
from avatar_runtime.posed import Clock
from avatar_runtime.stages.activate import Splats as RuntimeSplats
from avatar_trainer.raster.composite_backward import composite_tiles_backward
from avatar_trainer.raster.renderer import render
from avatar_trainer.stages.project import project
from avatar_trainer.tensors import Rendered, Splats
from tests.golden import Array, rasteriser_case, rasteriser_names
from tests.measured import Measure
from tests.oracles import one_splat
from tests.oracles.splat import Splat, image
from tests.runtime.stages.golden_scene import camera_of
from tests.trainer.raster.scenes import INPUTS, Scene, drawn, gradients, harsh, leaves, loss, scene
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
    """float32 against float64, each input by itself."""
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


def test_a_splat_wide_of_the_jacobians_clamp() -> None:
    """Alone, since its gradient is small compared with the others."""
    got, want = (gradients(harsh(), by, dtype)["mean"][2] for by, dtype in BOTH.items())
    assert relative(got.double(), want) <= TOLERANCE


@pytest.mark.parametrize("of", [scene(18, 40, 1, (36, 30), rotated=True), harsh()], ids=["random", "harsh"])
def test_gradients_are_differences_of_the_image(of: Scene) -> None:
    """Along random directions through all splats, float64 images on both sides; no autograd."""
    got = gradients(of, "cpu", torch.float32)
    step = 1e-7
    for at, key in enumerate(INPUTS):
        inputs = leaves(of, torch.float64)
        generator = torch.Generator().manual_seed(at)
        along = torch.randn(inputs[at].shape, generator=generator, dtype=torch.float64) * got[key].abs()
        along /= along.norm()
        values = []
        for sign in (1, -1):
            moved = [
                value.detach() + sign * step * along if k == at else value for k, value in enumerate(inputs)
            ]
            values.append(float(loss(of, drawn(of, moved, "torch")).detach()))
        want = (values[0] - values[1]) / (2 * step)
        assert float((got[key] * along).sum()) == pytest.approx(
            want, rel=2e-4, abs=1e-4 * float(got[key].norm())
        )


def test_one_splat_by_hand() -> None:
    """o and c of alpha c + (1 - alpha) b, alpha = o e^p, right at the centre of a lone round splat."""
    camera = Camera.from_opencv(np.eye(3), np.array([0, 0, 2.0]), _k(32, 20.5, 10.5), 40, 20)
    opacity, sh, background = (torch.tensor(v) for v in ([0.6], [[[1.0, -0.5, 0.25]]], [0.1, 0.2, 0.9]))
    offset = torch.zeros(1, 2)
    inputs = [v.requires_grad_() for v in (opacity, sh, background, offset)]
    splats = Splats(torch.zeros(1, 3), torch.full((1, 3), 0.05), torch.tensor([[1.0, 0, 0, 0]]), opacity, sh)
    rendered = render(splats, camera, RasterSettings(), 0, background, screen_offset=offset, threads=1)
    colour = 0.28209479177387814 * np.array([1.0, -0.5, 0.25]) + 0.5
    np.testing.assert_allclose(
        rendered.colour[10, 20].detach(), 0.6 * colour + 0.4 * background.detach().numpy(), rtol=1e-6
    )
    # Two pixels to the right: variance (16 * 0.05)^2 + 0.3 along both axes.
    fall = np.exp(-0.5 * 4 / (0.8**2 + 0.3))
    by_opacity, by_sh, by_background, by_offset = torch.autograd.grad(rendered.colour[10, 22].sum(), inputs)
    difference = colour.sum() - float(background.detach().sum())
    assert float(by_opacity[0]) == pytest.approx(fall * difference, rel=1e-5)
    np.testing.assert_allclose(by_sh[0, 0], [0.6 * fall * 0.28209479177387814] * 3, rtol=1e-5)
    np.testing.assert_allclose(by_background, [1 - 0.6 * fall] * 3, rtol=1e-6)
    np.testing.assert_allclose(
        by_offset[0], [0.6 * fall * difference * 2 / (0.8**2 + 0.3), 0], rtol=1e-5, atol=1e-9
    )


@pytest.mark.parametrize("degree", range(4))
def test_one_splat_by_the_textbook(degree: int, measured: Measure) -> None:
    """Central differences of one pixel of an oracle that shares no code, through projection and SH."""
    rng = np.random.default_rng(degree)
    view = Camera.orbit(np.zeros(3), 1.5, 0.5, -0.3, 0.8, 40, 30).camera_from_world.astype(np.float64)
    k = _k(50, 17.3, 16.1)
    camera = Camera.from_opencv(view[:3, :3], view[:3, 3], k, 40, 30)
    quat = rng.normal(size=4)
    inputs = {
        "mean": rng.normal(0, 0.05, 3),
        "scale": rng.uniform(0.05, 0.15, 3),
        "quat_wxyz": quat / np.linalg.norm(quat),
        "opacity": np.array(0.8),
        "sh": rng.normal(0, 0.2, ((degree + 1) ** 2, 3)),
    }
    inputs = {name: value.astype(np.float32).astype(np.float64) for name, value in inputs.items()}
    background, grad_colour, grad_alpha = np.array([0.25, 0.5, 0.75]), rng.normal(size=3), rng.normal()
    column, row = 18, 13

    def value(**given: Array) -> float:
        at = {**inputs, **given}
        shape = (at["mean"], at["scale"], at["quat_wxyz"], float(at["opacity"]), at["sh"], degree)
        colour, alpha = one_splat.pixel(*shape, view[:3, :3], view[:3, 3], k, background, column, row)
        return float(colour @ grad_colour + alpha * grad_alpha)

    tensors = {
        name: torch.tensor(v[None], dtype=torch.float32).requires_grad_() for name, v in inputs.items()
    }
    rendered = render(
        Splats(**tensors), camera, RasterSettings(), degree, torch.tensor(background).float(), threads=1
    )
    got = float(rendered.colour[row, column].detach() @ torch.tensor(grad_colour).float())
    assert got + float(rendered.alpha[row, column].detach()) * grad_alpha == pytest.approx(value(), abs=1e-5)
    (
        rendered.colour[row, column] @ torch.tensor(grad_colour).float()
        + rendered.alpha[row, column] * grad_alpha
    ).backward()
    for name, tensor in tensors.items():
        assert tensor.grad is not None
        gradient, step = tensor.grad[0].double().numpy(), 1e-6
        for _ in range(5):
            along = rng.normal(size=inputs[name].shape)
            if (
                name == "quat_wxyz"
            ):  # a unit quaternion stays one; the formula for others is the trainer's own
                along -= (along @ inputs[name]) * inputs[name]
            ends = [value(**{name: inputs[name] + sign * step * along}) for sign in (1, -1)]
            want = (ends[0] - ends[1]) / (2 * step)
            error = abs(float((gradient * along).sum()) - want) / np.linalg.norm(gradient)
            measured("rasteriser cpu, one splat against textbook differences, relative", error, TOLERANCE)
            assert error <= TOLERANCE, name


def test_screen_gradient_is_that_of_nested_loops() -> None:
    """Differences of the oracle's image when one splat moves on the screen; its tiles stay."""
    of = scene(21, 12, 0, (40, 36))
    inputs = leaves(of, torch.float32)
    rendered = drawn(of, inputs, "cpu")
    loss(of, rendered).backward()
    screen = _screen(of)
    for i in torch.nonzero(rendered.radius)[:6, 0].tolist():
        for axis, name in enumerate(("x", "y")):
            ends = []
            for sign in (1, -1):
                moved = [replace(s) for s in screen]
                moved[i] = replace(moved[i], **{name: getattr(screen[i], name) + sign * 1e-5})
                ends.append(_loss_of_loops(of, moved))
            want = (ends[0] - ends[1]) / 2e-5
            assert inputs[6].grad is not None
            assert float(inputs[6].grad[i, axis]) == pytest.approx(want, rel=1e-3, abs=1e-3)


def _screen(of: Scene) -> list[Splat]:
    p = project(of.splats, of.camera, of.settings, of.sh_degree)
    return [
        Splat(
            *(float(v) for v in (*p.centre[i], p.depth[i], *p.conic[i], p.opacity[i])),
            tuple(p.rgb[i].tolist()),
            int(p.radius[i]),
        )
        for i in range(len(p.radius))
    ]


def _loss_of_loops(of: Scene, screen: list[Splat]) -> float:
    colour, left = image(screen, of.camera.width, of.camera.height, of.background.numpy(), "trainer")
    rendered = Rendered(torch.tensor(colour), 1 - torch.tensor(left), torch.zeros(0))
    return float(loss(of, rendered))


@pytest.mark.parametrize("name", rasteriser_names())
def test_draws_what_the_runtime_draws(name: str) -> None:
    case = rasteriser_case(name).arrays
    sh = case.get("shs", np.full((len(case["means3D"]), 1, 3), 0.2, np.float32))
    arrays = (
        case["means3D"],
        case["scales"] * case["scale_modifier"],
        case["rotations"],
        case["opacities"],
        sh,
    )
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


def test_same_bits_on_any_number_of_threads() -> None:
    of = scene(31, 3000, 2, (130, 90), rotated=True)
    one, two = (gradients(of, "cpu", torch.float32, threads) for threads in (1, 2))
    for name in INPUTS:
        assert torch.equal(one[name], two[name]), name


def test_a_shifted_splat_is_drawn_shifted() -> None:
    """Where nothing is near a tile's border the image moves by whole pixels."""
    of = scene(3, 1, 0, (48, 48))
    splats = replace(of.splats, mean=torch.zeros(1, 3).double(), scale=torch.full((1, 3), 0.01).double())
    of = replace(of, splats=splats)
    inputs = leaves(of, torch.float32)
    still = drawn(of, inputs, "cpu").alpha.detach()
    inputs[6] = torch.tensor([[2.0, -1.0]])
    for by in ("cpu", "torch"):
        moved = drawn(of, inputs, by).alpha.detach()
        np.testing.assert_allclose(moved[:-1, 2:], still[1:, :-2], atol=1e-6)
        assert still.max() > 0.05


def test_inputs_changed_in_place_are_noticed() -> None:
    of = SCENES["degree 0"]()
    inputs = leaves(of, torch.float32)
    value = loss(of, drawn(of, inputs, "cpu"))
    with torch.no_grad():
        inputs[0] += 1
    with pytest.raises(RuntimeError, match="modified by an inplace operation"):
        value.backward()


def test_backward_twice_and_whatever_the_caller_does_with_the_radius() -> None:
    of = SCENES["degree 0"]()
    inputs = leaves(of, torch.float32)
    rendered = drawn(of, inputs, "cpu")
    value = loss(of, rendered)
    first = torch.autograd.grad(value, inputs, retain_graph=True)
    rendered.radius.zero_()
    again = torch.autograd.grad(value, inputs)
    assert all(torch.equal(a, b) for a, b in zip(first, again, strict=True))


def test_strided_tensors_are_taken() -> None:
    of = SCENES["degree 1, turned"]()
    inputs = leaves(of, torch.float32)
    wide = [torch.stack([v.detach(), v.detach()], dim=-1)[..., 0].requires_grad_() for v in inputs]
    assert not wide[0].is_contiguous()
    results = [torch.autograd.grad(drawn(of, given, "cpu").colour.sum(), given) for given in (inputs, wide)]
    assert all(torch.equal(a, b) for a, b in zip(*results, strict=True))


def test_nothing_to_draw_has_no_gradient() -> None:
    of = SCENES["degree 0"]()
    s = of.splats
    for mean in (s.mean + 100, s.mean[:0]):
        n = len(mean)
        empty = replace(of, splats=Splats(mean, s.scale[:n], s.quat_wxyz[:n], s.opacity[:n], s.sh[:n]))
        got = gradients(empty, "cpu", torch.float32)
        assert not any(got[name].any() for name in INPUTS[:5])
        assert got["background"].all()


def test_the_alpha_alone_has_a_gradient() -> None:
    of = SCENES["degree 0"]()
    got, want = (
        torch.autograd.grad(drawn(of, inputs, by).alpha.square().sum(), inputs[:5])
        for by, inputs in ((by, leaves(of, dtype)) for by, dtype in BOTH.items())
    )
    for value, expected in zip(got, want, strict=True):
        assert float((value - expected).abs().max()) <= TOLERANCE * float(expected.abs().max())
    assert not got[4].any()


def test_other_types_are_refused() -> None:
    of = SCENES["degree 0"]()
    with pytest.raises(TypeError, match="float32 tensors on the CPU"):
        drawn(of, leaves(of, torch.float64), "cpu")


def test_kernels_are_compiled_anew_when_the_runtime_or_this_package_changes() -> None:
    stamp = composite_tiles_backward._cache._cache_file._source_stamp
    assert stamp[: len(SOURCES)] == SOURCES
    assert {entry.split()[0] for entry in stamp[len(SOURCES) :]} >= {"composite_backward.py", "reduce.py"}


def _k(focal: float, x: float, y: float) -> Array:
    return np.array([[focal, 0, x], [0, focal, y], [0, 0, 1]])
