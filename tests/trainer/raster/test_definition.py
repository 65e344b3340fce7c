"""The definition: its gradients by finite differences, its image against the runtime and the golden scenes."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.stages.activate import Splats as RuntimeSplats
from avatar_runtime.stages.project import project as runtime_project
from avatar_runtime.stages.raster import raster as runtime_raster
from avatar_runtime.stages.sort import sort as runtime_sort
from avatar_trainer.raster.definition import raster
from avatar_trainer.stages.project import project
from avatar_trainer.stages.sort import sort
from avatar_trainer.tensors import Splats
from tests.golden import rasteriser_case, rasteriser_names
from tests.measured import Measure
from tests.runtime.stages.golden_scene import camera_of
from tests.trainer.raster.scenes import drawn, gradients, harsh, leaves, scene, splats_of

IMAGE_TOLERANCE = 1e-6
BIG = ("dense", "playbot_a")  # half a minute each
SCENES = {
    "degree 0": lambda: scene(1, 8, 0),
    "degree 1, off-centre": lambda: scene(2, 6, 1, principal=(0.3, 0.7)),
    "degree 2, turned": lambda: scene(3, 5, 2, rotated=True),
    "degree 3, turned": lambda: scene(4, 5, 3, rotated=True),
    "opaque": lambda: scene(5, 14, 0, opacity=(0.9, 1.0)),
}


@pytest.mark.parametrize("name", SCENES)
def test_gradcheck(name: str) -> None:
    of = SCENES[name]()

    def image(*inputs: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        rendered = drawn(of, list(inputs), "torch")
        return rendered.colour, rendered.alpha

    assert torch.autograd.gradcheck(image, leaves(of, torch.float64), fast_mode=True)


@pytest.mark.parametrize("name", [name for name in rasteriser_names() if name not in BIG])
def test_draws_the_golden_scenes(name: str, measured: Measure) -> None:
    case = rasteriser_case(name).arrays
    camera, degree = camera_of(case), int(case["sh_degree"])
    arrays = splats_of(case)
    want = runtime_project(RuntimeSplats(*arrays), camera, RasterSettings(), degree)
    want_image = runtime_raster(want, runtime_sort(want), camera, case["bg"])

    got = project(Splats(*map(torch.tensor, arrays)), camera, RasterSettings(), degree)
    colour, transmittance = raster(got, got.centre, sort(got), camera, torch.tensor(case["bg"]))
    for key in ("radius", "tiles", "depth", "centre", "conic", "opacity"):
        np.testing.assert_array_equal(getattr(got, key).numpy(), getattr(want, key), err_msg=key)
    np.testing.assert_allclose(got.rgb.numpy(), want.rgb, rtol=0, atol=IMAGE_TOLERANCE)
    np.testing.assert_array_equal(sort(got).numpy(), runtime_sort(want))
    for result, expected in ((colour, want_image.colour), (transmittance, want_image.transmittance)):
        difference = float(np.abs(result.numpy() - expected).max())
        measured(
            "rasteriser torch (float32) against the runtime, golden scenes, image difference",
            difference,
            IMAGE_TOLERANCE,
        )
        assert difference <= IMAGE_TOLERANCE


def test_clamps_and_culls_have_no_gradient() -> None:
    of = harsh()
    got = gradients(of, "torch", torch.float64)
    rendered = drawn(of, leaves(of, torch.float64), "torch")
    unseen = rendered.radius == 0
    assert set(torch.nonzero(unseen)[:, 0].tolist()) >= {0, 1, 3}
    for name in ("mean", "scale", "quat_wxyz", "opacity", "sh", "screen_offset"):
        assert torch.isfinite(got[name]).all(), name
        assert not got[name][unseen].any(), name
    assert not got["sh"][14:20].any()
    assert not got["sh"][20:26, :, 1].any()
    assert got["sh"][20:26, :, 0].any()
    assert got["mean"][2].any()  # the Jacobian is clamped there, the centre is not
    assert not got["quat_wxyz"][26].any()
