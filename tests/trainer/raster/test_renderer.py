"""`render`: what it refuses, and what a caller may leave out."""

from __future__ import annotations

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


def test_an_unknown_rasteriser_is_refused() -> None:
    with pytest.raises(ValueError, match="'vulkan' is not one of cpu, torch, gsplat"):
        shown(small(), rasteriser="vulkan")
    assert list(RASTERISERS) == ["cpu", "torch", "gsplat"]


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
