"""Stage `project` of the `cpu` backend: EWA and SH colour, in the definition's order of operations.

Sixteen splats are a group: their geometry and SH basis are computed lane by lane, which the compiler turns
into vectors. Work that only drawn splats need follows splat by splat.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from avatar_runtime.avatar import F32, I64, RasterSettings
from avatar_runtime.backends.cpu.arrays import read_only
from avatar_runtime.backends.cpu.draw.colour import bases, set_colour, set_direction
from avatar_runtime.backends.cpu.draw.geometry import centres, conics, covariances, extents
from avatar_runtime.backends.cpu.draw.group import (
    DEPTH,
    DRAWN,
    GROUP_FLOATS,
    LANES,
    MEAN,
    QUAT,
    RADIUS,
    SCALE,
    SPLAT,
    TILES,
)
from avatar_runtime.backends.cpu.draw.screen import (
    COLUMNS,
    OPACITY,
    Screen,
    count_tiles,
    tile_grid,
    touch_engine,
)
from avatar_runtime.backends.cpu.jit import inlined, kernel
from avatar_runtime.backends.cpu.lanes import take_next
from avatar_runtime.backends.cpu.workers import share
from avatar_runtime.camera import Camera
from avatar_runtime.stages.activate import Splats

f32 = np.float32
CHUNK = 64  # groups that a worker takes at a time
INT32_END = f32(2**31)


class SplatArrays(NamedTuple):
    """`Splats` as the kernels take them: read-only and contiguous."""

    mean: F32  # [N, 3]
    scale: F32  # [N, 3]
    quat_wxyz: F32  # [N, 4]
    opacity: F32  # [N]
    sh: F32  # [N, K, 3]
    sh_rotation: F32  # [N, 3, 3], or [0, 3, 3]: colour is seen along d itself

    @staticmethod
    def of(splats: Splats) -> SplatArrays:
        """The arrays of `splats`, copied only if necessary."""
        rotation = np.zeros((0, 3, 3)) if splats.sh_rotation is None else splats.sh_rotation
        arrays = (splats.mean, splats.scale, splats.quat_wxyz, splats.opacity, splats.sh, rotation)
        return SplatArrays(*map(read_only, arrays))


class View(NamedTuple):
    """A camera and the settings of the rasteriser, as the kernels take them."""

    camera_from_world: F32  # [4, 4]
    clip_from_world: F32  # [4, 4]
    eye: F32  # [3] world
    lens: F32  # [4] tan_half_fov_x, tan_half_fov_y, low_pass, near
    width: int
    height: int

    @staticmethod
    def of(camera: Camera, settings: RasterSettings) -> View:
        """What `project` reads of both."""
        lens = (camera.tan_half_fov_x, camera.tan_half_fov_y, settings.low_pass, settings.near)
        return View(
            read_only(camera.camera_from_world),
            read_only(camera.clip_from_world),
            read_only(camera.centre),
            read_only(lens),
            camera.width,
            camera.height,
        )


def project(
    splats: Splats, camera: Camera, settings: RasterSettings, sh_degree: int, profile: str, workers: int
) -> Screen:
    """Screen-space splats, and the tiles that `profile` touches."""
    screen = Screen.empty(len(splats.mean), camera, workers)
    view = View.of(camera, settings)
    counter, coefficients = np.zeros(1, np.int64), (sh_degree + 1) ** 2
    given, engine = SplatArrays.of(splats), profile == "engine"
    share(project_share, workers, counter, given, view, coefficients, engine, screen)
    return screen


@kernel()
def project_share(
    worker: int,
    counter: I64,  # [1] the next chunk of groups; all workers take from it
    given: SplatArrays,
    view: View,
    coefficients: int,  # of the SH degree
    engine: bool,  # the engine profile's tiles, not the trainer's
    screen: Screen,  # filled; its counts are zeros before
) -> None:
    """Project chunks until none is left."""
    group = np.empty(GROUP_FLOATS, np.float32)
    columns, rows = tile_grid(view.width, view.height)
    count_all = len(given.mean)
    while True:
        chunk = LANES * CHUNK * take_next(counter)
        if chunk >= count_all:
            return
        for begin in range(chunk, min(chunk + LANES * CHUNK, count_all), LANES):
            count = min(LANES, count_all - begin)
            for lane in range(count):
                _load(group, lane, begin + lane, given)
                set_direction(group, lane, begin + lane, view.eye, given.sh_rotation)
            covariances(group)
            conics(group, view.camera_from_world, view.lens, view.width, view.height)
            centres(group, view.clip_from_world, view.width, view.height)
            extents(group, columns, rows)
            bases(group)
            for lane in range(count):
                i = begin + lane
                if _store(i, group, lane, screen):
                    set_colour(screen.splats, i, group, lane, given.sh, coefficients)
                    if engine:
                        touch_engine(screen.tiles, screen.splats, i, columns, rows)
                    count_tiles(screen.counts, worker, screen.tiles, i, columns)


@inlined
def _load(group: F32, lane: int, i: int, given: SplatArrays) -> None:
    """Put splat i into its lane."""
    for k in range(3):
        group[MEAN + LANES * k + lane], group[SCALE + LANES * k + lane] = given.mean[i, k], given.scale[i, k]
    for k in range(4):
        group[QUAT + LANES * k + lane] = given.quat_wxyz[i, k]
    group[SPLAT + LANES * OPACITY + lane] = given.opacity[i]


@inlined
def _store(i: int, group: F32, lane: int, screen: Screen) -> bool:
    """Write splat i of the screen except its colour, zeros where it is not drawn; returns whether it is."""
    drawn: bool = group[DRAWN + lane] != f32(0)
    screen.depth[i] = group[DEPTH + lane] if drawn else f32(0)
    screen.radius[i] = _whole(group[RADIUS + lane]) if drawn else np.int32(0)
    for k in range(4):
        screen.tiles[i, k] = np.int32(group[TILES + LANES * k + lane]) if drawn else np.int32(0)
    for k in range(COLUMNS):
        screen.splats[i, k] = group[SPLAT + LANES * k + lane] if drawn else f32(0)
    return drawn


@inlined
def _whole(radius: np.float32) -> np.int32:
    """A radius as int32; the lowest int32 if it is out of range, as NumPy converts."""
    return np.int32(radius) if radius < INT32_END else np.int32(-(2**31))
