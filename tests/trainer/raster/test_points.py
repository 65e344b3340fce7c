"""Point splatting: Eq. 3 by hand, the definition by differences, the kernels by the definition."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
import torch

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_trainer.raster.points import rasterise
from avatar_trainer.tensors import Points, Rendered
from tests.measured import Measure
from tests.trainer.raster.point_scenes import INPUTS, drawn, gradients, harsh, scene
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


@pytest.mark.parametrize("name", SCENES)
def test_kernels_are_the_definition(name: str, measured: Measure) -> None:
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
