"""Point splatting: Eq. 3 by hand, the definition by differences, the kernels by the definition."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
import torch

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_trainer.raster.points import rasterise
from avatar_trainer.raster.renderer import render
from avatar_trainer.tensors import Points, Rendered
from tests.measured import Measure
from tests.trainer.raster.point_scenes import INPUTS, PointScene, drawn, gradients, harsh, loss, scene
from tests.trainer.tensors import relative

TOLERANCE = 1e-4  # of the largest gradient of an input
IMAGE_TOLERANCE = 1e-5
SCENES = {
    "a few pixels": partial(scene, 21, 150, (70, 50)),
    "large": partial(scene, 22, 80, (50, 70), radius=0.4),
    "small": partial(scene, 23, 300, (40, 40), radius=0.005),
    "opaque": partial(scene, 24, 250, (48, 48), opacity=(0.9, 1.0)),
    "faint": partial(scene, 25, 250, (33, 47), opacity=(0.001, 0.02)),
    "harsh": harsh,
}
SIZE = 16
# Looks along +z, 16 pixels of 1/100 metre at one metre: a point at (x, y, 1) is seen at (100 x + 7.5, 100 y + 7.5).
STRAIGHT = Camera.from_opencv(
    np.eye(3), np.zeros(3), np.array([[100, 0, 8], [0, 100, 8], [0, 0, 1]]), SIZE, SIZE
)


def points(*rows: tuple[float, ...], dtype: torch.dtype = torch.float64) -> Points:
    """Rows of x, y, z, radius, opacity, red, green, blue."""
    table = torch.tensor(rows, dtype=dtype).reshape(-1, 8)
    return Points(table[:, :3], table[:, 3], table[:, 4], table[:, 5:])


def straight(given: Points) -> Rendered:
    """Over a background of 0.5, 0.25, 0."""
    background = torch.tensor([0.5, 0.25, 0.0], dtype=given.mean.dtype)
    return rasterise(given, STRAIGHT, RasterSettings(), background, threads=1)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_equation_3_by_hand(dtype: torch.dtype) -> None:
    """Two points a pixel apart, the later listed in front; R = 100 * 0.03 / 1 = 3 and 100 * 0.08 / 2 = 4 pixels."""
    behind = (0.01, 0.01, 2.0, 0.08, 0.5, 0.0, 1.0, 0.0)  # at (8, 8)
    front = (0.015, 0.005, 1.0, 0.03, 0.8, 1.0, 0.0, 0.0)  # at (9, 8)
    got = straight(points(behind, front, dtype=dtype))
    front_alpha, behind_alpha = 0.8 * (1 - 2.0 / 9), 0.5 * (1 - 1.0 / 16)  # at (8, 7): r^2 = 2 and 1
    through = (1 - front_alpha) * (1 - behind_alpha)
    want = [front_alpha + 0.5 * through, (1 - front_alpha) * behind_alpha + 0.25 * through, 0]
    np.testing.assert_allclose(got.colour[7, 8].numpy(), want, rtol=0, atol=1e-5)
    assert float(got.alpha[7, 8]) == pytest.approx(1 - through, abs=1e-5)
    assert float(got.alpha[8, 12]) == 0  # 4 and 3 pixels away
    assert float(got.alpha[8, 11]) == pytest.approx(1 - (1 - 0.8 * 5 / 9) * (1 - 0.5 * 7 / 16), abs=1e-5)
    assert got.radius.tolist() == [4, 3]
    # The front one's weight is largest on its own pixel, the other's where it sees less of the front one.
    assert got.visibility is not None
    assert float(got.visibility[1]) == pytest.approx(0.8, abs=1e-5)
    others = [
        (1 - 0.8 * max(0, 1 - ((x - 9) ** 2 + (y - 8) ** 2) / 9))
        * 0.5
        * max(0, 1 - ((x - 8) ** 2 + (y - 8) ** 2) / 16)
        for x in range(SIZE)
        for y in range(SIZE)
    ]
    assert float(got.visibility[0]) == pytest.approx(max(others), abs=1e-5)


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_limits(dtype: torch.dtype) -> None:
    """A tiny point between four pixels is seen on each; 0.99 is the most; the near plane is not drawn itself."""
    tiny = straight(points((0.0, 0.0, 1.0, 1e-6, 0.8, 1, 1, 1), dtype=dtype))  # at (7.5, 7.5)
    assert int((tiny.alpha > 0).sum()) == 4
    assert float(tiny.alpha[7, 8]) == pytest.approx(0.8 * 0.5, abs=1e-5)
    opaque = straight(points((0.005, 0.005, 1.0, 0.03, 1.0, 1, 1, 1), dtype=dtype))
    assert float(opaque.alpha[8, 8]) == pytest.approx(0.99, abs=1e-6)
    near = float(np.float32(0.2))
    rows = [(0.0, 0.0, z, 0.01, 1.0, 1, 1, 1) for z in (-1.0, near, near * 1.001)]
    assert [int(r) > 0 for r in straight(points(*rows, dtype=dtype)).radius] == [False, False, True]


@pytest.mark.parametrize("dtype", [torch.float32, torch.float64])
def test_a_point_that_would_leave_too_little_ends_the_pixel(dtype: torch.dtype) -> None:
    """At the centre the first leaves 0.01, of which the second would leave 5e-5: what is behind is not seen there."""
    rows = [
        (0.005, 0.005, 1.0 + k / 100, 0.03, beta, k == 0, k == 1, k == 2)
        for k, beta in enumerate((1, 0.995, 0.1))
    ]
    got = straight(points(*rows, dtype=dtype))
    assert float(got.alpha[8, 8]) == pytest.approx(0.99, abs=1e-6)
    np.testing.assert_allclose(got.colour[8, 8].numpy(), [0.995, 0.0025, 0], rtol=0, atol=1e-6)
    assert (got.colour[8, [7, 9], 1:] > 1e-3).all()  # a pixel further out all three are


def test_equal_depths_by_id() -> None:
    """Red before green, whichever type."""
    rows = [(0.005, 0.005, 1.0, 0.03, 0.9, 1, 0, 0), (0.005, 0.005, 1.0, 0.03, 0.9, 0, 1, 0)]
    for dtype in (torch.float32, torch.float64):
        colour = straight(points(*rows, dtype=dtype)).colour[8, 8]
        assert float(colour[0]) > 0.9 > float(colour[1])


@pytest.mark.parametrize("name", ["a few", "opaque"])
def test_gradcheck(name: str) -> None:
    """The definition: colour and alpha by every input."""
    of = {"a few": scene(1, 8), "opaque": scene(5, 14, opacity=(0.9, 0.98))}[name]

    def image(*inputs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        rendered = drawn(of, list(inputs))
        return rendered.colour, rendered.alpha

    assert torch.autograd.gradcheck(image, of.leaves(torch.float64), fast_mode=True)


@pytest.mark.parametrize("name", SCENES)
def test_kernels_are_the_definition(name: str, measured: Measure) -> None:
    """float32 against float64: image, visibility, gradients."""
    of = SCENES[name]()
    got, want = (drawn(of, of.leaves(dtype)) for dtype in (torch.float32, torch.float64))
    assert torch.equal(got.radius > 0, want.radius > 0)
    for key in ("colour", "alpha", "visibility"):
        error = float((getattr(got, key).double() - getattr(want, key)).detach().abs().max())
        measured(
            "points, image and visibility, float32 kernels against the definition", error, IMAGE_TOLERANCE
        )
        assert error <= IMAGE_TOLERANCE, key
    found, wanted = (gradients(of, dtype) for dtype in (torch.float32, torch.float64))
    assert set(found) == set(wanted) == set(INPUTS)
    for key in INPUTS:
        if name == "small" and key == "radius":  # all at the least radius
            assert not wanted[key].any()
            assert not found[key].any()
            continue
        error = relative(found[key].double(), wanted[key])
        measured(f"points, gradient of {key}, relative to the definition's largest", error, TOLERANCE)
        assert error <= TOLERANCE, key


def test_what_is_not_drawn_has_no_gradient() -> None:
    of = harsh()
    for dtype in (torch.float32, torch.float64):
        got, rendered = gradients(of, dtype), drawn(of, of.leaves(dtype))
        unseen = rendered.radius == 0
        assert set(torch.nonzero(unseen)[:, 0].tolist()) >= {0, 1, 2}
        assert rendered.visibility is not None
        assert not rendered.visibility[unseen].any()
        for key in ("mean", "radius", "opacity", "rgb", "screen_offset"):
            assert torch.isfinite(got[key]).all(), key
            assert not got[key][unseen].any(), key
        assert not got["radius"][60:70].any()


def test_same_bits_whatever_the_threads() -> None:
    of = scene(26, 3000, (160, 150), radius=0.02)
    images = [drawn(of, of.leaves(torch.float32), threads) for threads in (1, 2, 2)]
    found = [gradients(of, torch.float32, threads) for threads in (1, 2, 2)]
    for other, its in zip(images[1:], found[1:], strict=True):
        for key in ("colour", "alpha", "visibility", "radius"):
            assert torch.equal(getattr(other, key), getattr(images[0], key)), key
        for key in INPUTS:
            assert torch.equal(its[key], found[0][key]), key


def test_order_of_the_points_is_of_no_matter() -> None:
    """Except for ties: gradients are in the order of their points."""
    of = scene(27, 200, (40, 30))
    turn = torch.randperm(200, generator=torch.Generator().manual_seed(1))
    shuffled = replace(of, inputs=tuple(v[turn] if len(v) == 200 else v for v in of.inputs))
    plain, other = gradients(of, torch.float32), gradients(shuffled, torch.float32)
    for key in set(INPUTS) - {"background"}:
        assert torch.equal(plain[key][turn], other[key]), key


@pytest.mark.parametrize("count", [0, 5])
def test_nothing_to_draw_is_the_background(count: int) -> None:
    for dtype in (torch.float32, torch.float64):
        rows = [(5.0, 0.0, 1.0, 0.01, 1.0, 1.0, 1.0, 1.0)] * count
        given = points(*rows, dtype=dtype)
        got = straight(given)
        assert torch.equal(got.colour, torch.tensor([0.5, 0.25, 0.0], dtype=dtype).expand(SIZE, SIZE, 3))
        assert not got.alpha.any()
        assert got.visibility is not None
        assert got.visibility.tolist() == [0.0] * count


def test_render_draws_points() -> None:
    of = scene(28, 20)
    *values, background, offset = of.leaves(torch.float32)
    got = render(Points(*values), of.camera, RasterSettings(), 0, background, screen_offset=offset, threads=1)
    assert torch.equal(got.colour, drawn(of, of.leaves(torch.float32)).colour)


def test_shapes_that_do_not_fit() -> None:
    given = points((0.0, 0.0, 1.0, 0.01, 1.0, 1.0, 1.0, 1.0))
    with pytest.raises(ValueError, match=r"rgb is \(1, 2\), not \(1, 3\)"):
        straight(replace(given, rgb=given.rgb[:, :2]))


def test_loss_sees_every_input() -> None:
    """The oracle's own check: no input's gradient is missing from the sum that the others are judged by."""
    of: PointScene = scene(29, 30)
    inputs = of.leaves(torch.float64)
    loss(of, drawn(of, inputs)).backward()
    assert all(leaf.grad is not None and leaf.grad.any() for leaf in inputs)
