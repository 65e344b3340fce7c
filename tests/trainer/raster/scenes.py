"""Small scenes for the rasterisers, and what a renderer's gradients with respect to every input are."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_trainer.raster.renderer import render
from avatar_trainer.tensors import Rendered, Splats

INPUTS = ("mean", "scale", "quat_wxyz", "opacity", "sh", "background", "screen_offset")


@dataclass(frozen=True)
class Scene:
    """Splats that nothing culls by a hair, float64, and the camera that sees them."""

    splats: Splats
    camera: Camera
    settings: RasterSettings
    sh_degree: int
    background: Tensor


def camera(width: int, height: int, principal: tuple[float, float] = (0.5, 0.5)) -> Camera:
    """From the side, rolled, two metres away; `principal` as a part of the image."""
    orbit = Camera.orbit(np.array([0.02, -0.03, 0.01]), 2.0, 0.4, 0.25, 0.7, width, height)
    view = orbit.camera_from_world.astype(np.float64)
    roll = np.array([[np.cos(0.3), -np.sin(0.3), 0], [np.sin(0.3), np.cos(0.3), 0], [0, 0, 1]])
    k = np.array([[1.9 * width, 0, principal[0] * width], [0, 2.1 * width, principal[1] * height], [0, 0, 1]])
    return Camera.from_opencv(roll @ view[:3, :3], roll @ view[:3, 3], k, width, height)


def scene(
    seed: int,
    count: int,
    sh_degree: int,
    size: tuple[int, int] = (24, 20),
    *,
    rotated: bool = False,
    principal: tuple[float, float] = (0.5, 0.5),
    opacity: tuple[float, float] = (0.05, 0.95),
    stored_degree: int | None = None,
) -> Scene:
    """`count` random splats around the origin, some of them partly or wholly outside the image."""
    generator = torch.Generator().manual_seed(seed)

    def normal(*shape: int) -> Tensor:
        return torch.randn(shape, generator=generator, dtype=torch.float64)

    stored = sh_degree if stored_degree is None else stored_degree
    low, high = opacity
    splats = Splats(
        0.2 * normal(count, 3),
        torch.exp(0.5 * normal(count, 3) - 2.8),
        normal(count, 4) + torch.tensor([1.5, 0, 0, 0]),
        low + (high - low) * torch.rand(count, generator=generator, dtype=torch.float64),
        0.35 * normal(count, (stored + 1) ** 2, 3),
        torch.linalg.qr(normal(count, 3, 3))[0] if rotated else None,
    )
    background = torch.rand(3, generator=generator, dtype=torch.float64)
    return Scene(
        rounded(splats), camera(*size, principal), RasterSettings(), sh_degree, background.float().double()
    )


def rounded(splats: Splats) -> Splats:
    """With values that float32 has, so that both types see the same scene."""
    return replace(splats, **{name: value.float().double() for name, value in parts(splats).items()})


def parts(splats: Splats) -> dict[str, Tensor]:
    return {name: value for name, value in vars(splats).items() if value is not None}


def harsh() -> Scene:
    """Everything that ends or clamps something: near plane, borders, 0.99, the stop, black, the Jacobian, no turn."""
    base = scene(7, 40, 1, (70, 50), principal=(0.4, 0.62))
    s = base.splats
    view = torch.tensor(base.camera.camera_from_world, dtype=torch.float64)
    forward, right, eye = view[2, :3], view[0, :3], torch.tensor(base.camera.centre, dtype=torch.float64)
    mean, scale, quat = s.mean.clone(), s.scale.clone(), s.quat_wxyz.clone()
    opacity, sh = s.opacity.clone(), s.sh.clone()
    mean[0] = eye - 0.5 * forward  # behind the camera
    mean[1] = eye + 0.15 * forward  # before the near plane
    mean[2] = eye + 2 * forward + 0.8 * right  # wide of the clamp, and large enough to be seen
    scale[2] = torch.tensor([0.2, 0.25, 0.15])
    opacity[2] = 0.8
    mean[3] = 40 * right  # outside
    opacity[4:14] = 0.999  # clamped, and together the end of many a pixel
    mean[4:14] *= 0.3
    scale[4:14] = 0.12
    sh[14:20, 0] = -2.5  # black
    sh[20:26, 0, 1] = -2.2  # without green
    quat[26] = 0
    splats = Splats(mean, scale, quat, opacity, sh)
    return replace(base, splats=rounded(splats))


def splats_of(case: dict[str, Any]) -> tuple[Any, ...]:
    """The arrays of a golden scene: mean, scale, quaternion, opacity and SH."""
    sh = case.get("shs", np.full((len(case["means3D"]), 1, 3), 0.2, np.float32))
    scale = case["scales"] * case["scale_modifier"]
    return case["means3D"], scale, case["rotations"], case["opacities"], sh


def leaves(of: Scene, dtype: torch.dtype) -> list[Tensor]:
    """The inputs as `INPUTS` names them, in `dtype`, ready for gradients."""
    s = of.splats
    offset = torch.zeros(len(s.mean), 2)
    tensors = (s.mean, s.scale, s.quat_wxyz, s.opacity, s.sh, of.background, offset)
    return [tensor.to(dtype).clone().requires_grad_() for tensor in tensors]


def drawn(of: Scene, inputs: list[Tensor], rasteriser: str, threads: int | None = 1) -> Rendered:
    """The scene with `inputs` in the place of its own."""
    *splats, background, offset = inputs
    rotation = of.splats.sh_rotation
    given = Splats(*splats, None if rotation is None else rotation.to(inputs[0].dtype))
    return render(given, of.camera, of.settings, of.sh_degree, background, rasteriser, offset, threads)


def loss(rendered: Rendered) -> Tensor:
    """A fixed random sum of colour and alpha."""
    generator, dtype = torch.Generator().manual_seed(99), rendered.colour.dtype
    images = (rendered.colour, rendered.alpha)
    weights = (torch.randn(i.shape, generator=generator, dtype=torch.float64).to(dtype) for i in images)
    return torch.stack([(image * weight).sum() for image, weight in zip(images, weights, strict=True)]).sum()


def gradients(of: Scene, rasteriser: str, dtype: torch.dtype, threads: int | None = 1) -> dict[str, Tensor]:
    """Of `loss` with respect to each input."""
    inputs = leaves(of, dtype)
    loss(drawn(of, inputs, rasteriser, threads)).backward()
    return {name: leaf.grad for name, leaf in zip(INPUTS, inputs, strict=True) if leaf.grad is not None}
