"""`render`: what it refuses, and what a caller may leave out."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import torch

from avatar_runtime.camera import Camera
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.raster import gsplat
from avatar_trainer.raster.renderer import RASTERISERS, render
from avatar_trainer.tensors import Splats
from tests.trainer.raster.scenes import Scene, scene


def small() -> Scene:
    of = scene(1, 6, 1)
    return replace(of, splats=Splats(*(value.float() for value in list(vars(of.splats).values())[:5])))


def shown(of: Scene, **changes: Any) -> Any:
    s, background = of.splats, of.background.float()
    return render(s, of.camera, of.settings, of.sh_degree, changes.pop("background", background), **changes)


@pytest.mark.parametrize("rasteriser", ["cpu", "torch"])
def test_images_and_radii(rasteriser: str) -> None:
    rendered = shown(small(), rasteriser=rasteriser)
    assert rendered.colour.shape == (20, 24, 3)
    assert rendered.alpha.shape == (20, 24)
    assert (rendered.radius.shape, rendered.radius.dtype) == ((6,), torch.int32)
    assert not rendered.colour.requires_grad
    plain = shown(small(), rasteriser=rasteriser, screen_offset=torch.zeros(6, 2))
    assert torch.equal(plain.colour, rendered.colour)


def test_an_unknown_rasteriser_is_refused() -> None:
    with pytest.raises(ValueError, match="'vulkan' is not one of cpu, torch, gsplat"):
        shown(small(), rasteriser="vulkan")
    assert list(RASTERISERS) == ["cpu", "torch", "gsplat"]


@pytest.mark.parametrize(
    ("name", "shape"),
    [
        ("mean", (6, 2)),
        ("scale", (5, 3)),
        ("quat_wxyz", (6, 3)),
        ("opacity", (6, 1)),
        ("sh", (6, 3, 3)),
        ("sh", (6, 12)),
        ("sh_rotation", (6, 9)),
    ],
)
def test_splats_that_do_not_fit_are_refused(name: str, shape: tuple[int, ...]) -> None:
    of = small()
    wrong = replace(of, splats=replace(of.splats, **{name: torch.zeros(shape)}))
    with pytest.raises(ValueError, match=rf"^{name} is \({shape[0]}, "):
        shown(wrong)


def test_other_tensors_that_do_not_fit_are_refused() -> None:
    with pytest.raises(ValueError, match=r"background is \(1,\), not \(3,\)"):
        shown(small(), background=torch.zeros(1))
    with pytest.raises(ValueError, match=r"screen_offset is \(6, 3\), not \(6, 2\)"):
        shown(small(), screen_offset=torch.zeros(6, 3))
    with pytest.raises(ValueError, match="at least 1 is needed"):
        shown(small(), threads=0)


def test_gsplat_says_what_it_needs(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gsplat.importlib.util, "find_spec", lambda _: None)
    with pytest.raises(AvatarError, match="needs gsplat: pip install gsplat"):
        shown(small(), rasteriser="gsplat")
    monkeypatch.setattr(gsplat.importlib.util, "find_spec", lambda _: object())
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    with pytest.raises(AvatarError, match="needs a GPU with CUDA"):
        shown(small(), rasteriser="gsplat")


def test_intrinsics_of_a_camera() -> None:
    k = np.array([[52.5, 0.75, 19.25], [0, 47.0, 30.5], [0, 0, 1]])
    view = Camera.orbit(np.zeros(3), 2.0, 0.3, 0.2, 0.8, 48, 40).camera_from_world
    camera = Camera.from_opencv(view[:3, :3], view[:3, 3], k, 48, 40)
    np.testing.assert_allclose(gsplat.intrinsics(camera), k, rtol=1e-5, atol=1e-4)


def test_torch_keeps_its_number_of_threads() -> None:
    """Numba's OpenMP, when it starts, sets that of the whole process."""
    program = (
        "import torch; torch.set_num_threads(1)\n"
        "from tests.trainer.raster.test_renderer import shown, small\n"
        "shown(small()); print(torch.get_num_threads())"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True, text=True)
    assert done.stdout.split() == ["1"]
