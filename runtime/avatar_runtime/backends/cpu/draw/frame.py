"""Stages `project`, `sort` and `raster` of the `cpu` backend: splats to an image."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, I64, U32, Avatar, RasterSettings
from avatar_runtime.backends import Arrays
from avatar_runtime.backends.cpu.arrays import read_only
from avatar_runtime.backends.cpu.deform.facing import Facing
from avatar_runtime.backends.cpu.draw.light import Lit, light
from avatar_runtime.backends.cpu.draw.project import project
from avatar_runtime.backends.cpu.draw.raster import composite_tiles
from avatar_runtime.backends.cpu.draw.screen import (
    CENTRE_X,
    COLUMNS,
    CONIC_XX,
    OPACITY,
    RED,
    Screen,
    count_all,
    fill_screen,
)
from avatar_runtime.backends.cpu.draw.shadow import shadow_map
from avatar_runtime.backends.cpu.draw.sort import sort
from avatar_runtime.backends.cpu.draw.tiles import tile_lists
from avatar_runtime.camera import Camera
from avatar_runtime.light import SHADOW_SIZE, LightArrays, turned
from avatar_runtime.posed import Clock
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.light import casting
from avatar_runtime.stages.project import TILE, Projected
from avatar_runtime.stages.raster import PROFILES, Image
from avatar_schema import constants

# Of each profile: the transmittance that ends a pixel instead of being reached, and that below which a block of
# pixels takes no more splats. `engine` has no stop; what the block leaves out is 1e-8 of a colour.
STOP = {"trainer": constants()["transmittance_min"], "engine": 0.0}
CLOSED = {"trainer": 0.0, "engine": 1e-8}


def draw(
    splats: Splats,
    camera: Camera,
    settings: RasterSettings,
    sh_degree: int,
    background: F32,  # [3]
    profile: str,
    threads: int,
    clock: Clock,
    lit: Callable[[Screen], None] | None = None,
) -> Image:
    """The splats over `background`; the same bits for every number of threads. `lit` changes the screen's colours.

    Raises ValueError for an unknown profile, and for arrays that do not fit together.
    """
    _check(profile)
    _check_splats(splats, sh_degree)
    screen = clock.timed("project", lambda: project(splats, camera, settings, sh_degree, profile, threads))
    if lit is not None:
        lit(screen)
    order = clock.timed("sort", lambda: sort(screen.depth, screen.radius))
    return clock.timed("raster", lambda: composite(screen, order, camera, background, profile, threads))


def composite(
    screen: Screen, order: U32, camera: Camera, background: F32, profile: str, threads: int
) -> Image:
    """Stage `raster`: the splats that `order` [drawn] names, front to back, over `background` [3]."""
    _fit("background", background, (3,))
    height, width = camera.height, camera.width
    members, starts = tile_lists(screen.tiles, order, screen.counts.sum(axis=0), -(-width // TILE), threads)
    colour, transmittance = np.empty((height, width, 3), np.float32), np.empty((height, width), np.float32)
    last = np.empty((height, width), np.int32)
    evaluations = composite_tiles(
        screen.splats,
        members,
        starts,
        read_only(background),
        np.float32(STOP[profile]),
        np.float32(CLOSED[profile]),
        threads,
        colour,
        transmittance,
        last,
    )
    return Image(colour, transmittance, last, int(evaluations))


def screen_of(projected: Projected, order: I64, camera: Camera, profile: str) -> tuple[Screen, U32]:
    """The inputs of `composite`, from outputs of stages. Raises ValueError for arrays or an order that do not fit."""
    count = len(projected.radius)
    _fit("radius", projected.radius, (count,))
    _fit("centre", projected.centre, (count, 2))
    _fit("conic", projected.conic, (count, 3))
    _fit("opacity", projected.opacity, (count,))
    _fit("rgb", projected.rgb, (count, 3))
    if np.any((order < 0) | (order >= count)):
        raise ValueError(f"order names splats beyond the {count} that there are")
    screen, ids = Screen.empty(count, camera, 1), order.astype(np.uint32)
    fill_screen(
        read_only(projected.centre),
        read_only(projected.conic),
        read_only(projected.opacity),
        read_only(projected.rgb),
        read_only(projected.radius, np.int32),
        camera.width,
        camera.height,
        profile == "engine",
        screen.splats,
        screen.tiles,
    )
    count_all(screen.tiles, ids, -(-camera.width // TILE), screen.counts)
    return screen, ids


def _check(profile: str) -> None:
    if profile not in PROFILES:
        raise ValueError(f"{profile!r} is not one of {', '.join(PROFILES)}")


def _check_splats(splats: Splats, sh_degree: int) -> None:
    """Raise ValueError for arrays that a kernel would read beyond their ends."""
    n, stored = len(splats.mean), splats.sh.shape[1]
    _fit("mean", splats.mean, (n, 3))
    _fit("scale", splats.scale, (n, 3))
    _fit("quat_wxyz", splats.quat_wxyz, (n, 4))
    _fit("opacity", splats.opacity, (n,))
    _fit("sh", splats.sh, (n, max(stored, (sh_degree + 1) ** 2), 3))
    if splats.sh_rotation is not None:
        _fit("sh_rotation", splats.sh_rotation, (n, 3, 3))


def _fit(name: str, array: npt.NDArray[Any], shape: tuple[int, ...]) -> None:
    if array.shape != shape:
        raise ValueError(f"{name} is {array.shape}, not {shape}")


def _project(avatar: Avatar, x: Arrays, camera: Camera | None, profile: str, threads: int) -> dict[str, Any]:
    assert camera is not None
    splats = Splats.of(x)
    _check_splats(splats, avatar.sh_degree)
    screen = project(splats, camera, avatar.raster, avatar.sh_degree, profile, threads)
    return {
        "centre": screen.splats[:, CENTRE_X : CENTRE_X + 2],
        "depth": screen.depth,
        "conic": screen.splats[:, CONIC_XX : CONIC_XX + 3],
        "opacity": screen.splats[:, OPACITY],
        "rgb": screen.splats[:, RED : RED + 3],
        "radius": screen.radius,
    }


def _shadow(avatar: Avatar, x: Arrays, camera: Camera | None, profile: str, threads: int) -> dict[str, Any]:
    splats = Splats(x["mean"], x["scale"], x["quat_wxyz"], x["opacity"], np.zeros((0, 0, 3), np.float32))
    mesh = casting(avatar, x.get("posed_vertices"), x["world_from_avatar"])
    return {"shadow": shadow_map(splats, LightArrays.of(x), mesh, threads).ravel()}


def _light(avatar: Avatar, x: Arrays, camera: Camera | None, profile: str, threads: int) -> dict[str, Any]:
    assert avatar.relight is not None
    n = len(x["radius"])
    for name, width in (("mean", 3), ("quat_wxyz", 4), ("rgb", 3)):
        _fit(name, x[name], (n, width))
    shadow = x["shadow"].reshape(SHADOW_SIZE, SHADOW_SIZE) if "shadow" in x else None
    rows = np.zeros((n, COLUMNS), np.float32)
    rows[:, RED : RED + 3] = x["rgb"]
    quat, normal = x["quat_wxyz"], None
    if turned(avatar):
        facing = Facing(avatar)
        quat, normal = facing.quat_wxyz, facing.normals(x["posed_vertices"], x["world_from_avatar"])
    lit = Lit.of(avatar.relight, LightArrays.of(x), shadow, normal)
    light(x["mean"], quat, lit, rows, x["radius"], threads)
    return {"rgb": rows[:, RED : RED + 3]}


def _sort(avatar: Avatar, x: Arrays, camera: Camera | None, profile: str, threads: int) -> dict[str, Any]:
    _fit("depth", x["depth"], x["radius"].shape)
    return {"order": sort(x["depth"], x["radius"]).astype(np.int64)}


def _raster(avatar: Avatar, x: Arrays, camera: Camera | None, profile: str, threads: int) -> dict[str, Any]:
    assert camera is not None
    _check(profile)
    n = len(x["radius"])
    none, no_tiles = np.zeros(n, np.float32), np.zeros((n, 4), np.int32)
    projected = Projected(x["centre"], none, x["conic"], x["opacity"], x["rgb"], x["radius"], none, no_tiles)
    screen, order = screen_of(projected, x["order"], camera, profile)
    image = composite(screen, order, camera, x["background"], profile, threads)
    return {"colour": image.colour, "transmittance": image.transmittance}


Run = Callable[[Avatar, Arrays, "Camera | None", str, int], dict[str, Any]]
RUN: dict[str, Run] = {
    "shadow": _shadow,
    "project": _project,
    "light": _light,
    "sort": _sort,
    "raster": _raster,
}
