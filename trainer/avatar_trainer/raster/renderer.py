"""The differentiable renderer: splats over a background, in the runtime's `trainer` profile."""

from __future__ import annotations

from collections.abc import Callable

from torch import Tensor

from avatar_runtime import Camera, RasterSettings
from avatar_trainer.raster import cpu, definition, gsplat, points
from avatar_trainer.tensors import Points, Rendered, Splats

Rasterise = Callable[[Splats, Camera, RasterSettings, int, Tensor, Tensor | None, int | None], Rendered]
RASTERISERS: dict[str, Rasterise] = {
    "cpu": cpu.rasterise,
    "torch": definition.rasterise,
    "gsplat": gsplat.rasterise,
}

NEEDS: dict[str, Callable[[], None]] = {"gsplat": gsplat.expect_gsplat}


def expect_rasteriser(name: str) -> None:
    """Raise ValueError for an unknown rasteriser, AvatarError if something that it needs is not installed."""
    if name not in RASTERISERS:
        raise ValueError(f"{name!r} is not one of {', '.join(RASTERISERS)}")
    if name in NEEDS:
        NEEDS[name]()


def render(
    splats: Splats | Points,
    camera: Camera,
    settings: RasterSettings,
    sh_degree: int,
    background: Tensor,  # [3] display-referred
    rasteriser: str = "cpu",
    screen_offset: Tensor | None = None,  # [N, 2] pixels
    threads: int | None = None,
) -> Rendered:
    """The image of `splats`, differentiable in them (except for sh_rotation), the background and the offset.

    `screen_offset` is added to the projected centres after the tiles of each splat are determined: if it is zero, its
    gradient is that of the splats' positions on the screen. `threads`: as for the runtime's backend `cpu`.
    Points have one rasteriser, whatever `rasteriser` says. Raises ValueError for an unknown rasteriser and for tensors
    that do not fit together, TypeError for a type that the rasteriser does not take.
    """
    if rasteriser not in RASTERISERS:
        raise ValueError(f"{rasteriser!r} is not one of {', '.join(RASTERISERS)}")
    if isinstance(splats, Points):
        return points.rasterise(splats, camera, settings, background, screen_offset, threads)
    _check(splats, sh_degree, background, screen_offset)
    return RASTERISERS[rasteriser](splats, camera, settings, sh_degree, background, screen_offset, threads)


def _check(splats: Splats, sh_degree: int, background: Tensor, screen_offset: Tensor | None) -> None:
    n, stored = len(splats.mean), splats.sh.shape[1] if splats.sh.ndim == 3 else 0
    expected: list[tuple[str, Tensor | None, tuple[int, ...]]] = [
        ("mean", splats.mean, (n, 3)),
        ("scale", splats.scale, (n, 3)),
        ("quat_wxyz", splats.quat_wxyz, (n, 4)),
        ("opacity", splats.opacity, (n,)),
        ("sh", splats.sh, (n, max(stored, (sh_degree + 1) ** 2), 3)),
        ("sh_rotation", splats.sh_rotation, (n, 3, 3)),
        ("background", background, (3,)),
        ("screen_offset", screen_offset, (n, 2)),
    ]
    for name, tensor, shape in expected:
        if tensor is not None and tuple(tensor.shape) != shape:
            raise ValueError(f"{name} is {tuple(tensor.shape)}, not {shape}")
