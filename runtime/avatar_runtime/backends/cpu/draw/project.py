"""Stage `project` of the `cpu` backend: EWA and SH colour, in the definition's order of operations.

Sixteen splats are a group: their geometry and SH basis are computed lane by lane, which the compiler turns
into vectors; what depends on being drawn follows splat by splat.
"""

from __future__ import annotations

import numpy as np
from numba import prange

from avatar_runtime.avatar import F32, I32, I64, RasterSettings
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
    read_only,
    tile_grid,
    touch_engine,
)
from avatar_runtime.backends.cpu.jit import inlined, kernel
from avatar_runtime.backends.cpu.lanes import take_next
from avatar_runtime.camera import Camera
from avatar_runtime.stages.activate import Splats

f32 = np.float32
CHUNK = 64  # groups that a worker takes at once
INT32_END = f32(2**31)


def project(
    splats: Splats, camera: Camera, settings: RasterSettings, sh_degree: int, profile: str, workers: int
) -> Screen:
    """Screen-space splats, and the tiles that `profile` touches."""
    screen = Screen.empty(len(splats.mean), camera, workers)
    rotation = splats.sh_rotation
    lens = (camera.tan_half_fov_x, camera.tan_half_fov_y, settings.low_pass, settings.near)
    project_splats(
        read_only(splats.mean),
        read_only(splats.scale),
        read_only(splats.quat_wxyz),
        read_only(splats.opacity),
        read_only(splats.sh),
        read_only(np.zeros((0, 3, 3)) if rotation is None else rotation),
        read_only(camera.camera_from_world),
        read_only(camera.clip_from_world),
        read_only(camera.centre),
        read_only(np.array(lens)),
        camera.width,
        camera.height,
        (sh_degree + 1) ** 2,
        profile == "engine",
        screen.splats,
        screen.depth,
        screen.radius,
        screen.tiles,
        screen.counts,
    )
    return screen


@kernel(parallel=True)
def project_splats(
    mean: F32,  # [N, 3]
    scale: F32,  # [N, 3]
    quat_wxyz: F32,  # [N, 4]
    opacity: F32,  # [N]
    sh: F32,  # [N, K, 3]
    sh_rotation: F32,  # [N, 3, 3], or [0, 3, 3]: colour is seen along d itself
    view: F32,  # [4, 4] camera_from_world
    clip: F32,  # [4, 4] clip_from_world
    eye: F32,  # [3] world
    lens: F32,  # [4] tan_half_fov_x, tan_half_fov_y, low_pass, near
    width: int,
    height: int,
    coefficients: int,  # of the SH degree
    engine: bool,  # the engine profile's tiles, not the trainer's
    splats: F32,  # [N, COLUMNS] out, like all that follow
    depth: F32,  # [N]
    radius: I32,  # [N]
    tiles: I32,  # [N, 4]
    counts: I64,  # [workers, tiles] how many splats a worker found in each tile; comes as zeros
) -> None:
    """Fill the screen's arrays. The workers take chunks of groups from one counter."""
    counter = np.zeros(1, np.int64)
    for worker in prange(len(counts)):
        _work(
            counter,
            mean,
            scale,
            quat_wxyz,
            opacity,
            sh,
            sh_rotation,
            view,
            clip,
            eye,
            lens,
            width,
            height,
            coefficients,
            engine,
            splats,
            depth,
            radius,
            tiles,
            counts,
            worker,
        )


@kernel()
def _work(
    counter: I64,
    mean: F32,
    scale: F32,
    quat_wxyz: F32,
    opacity: F32,
    sh: F32,
    sh_rotation: F32,
    view: F32,
    clip: F32,
    eye: F32,
    lens: F32,
    width: int,
    height: int,
    coefficients: int,
    engine: bool,
    splats: F32,
    depth: F32,
    radius: I32,
    tiles: I32,
    counts: I64,
    worker: int,
) -> None:
    """Project chunks until none is left."""
    group = np.empty(GROUP_FLOATS, np.float32)
    columns, rows = tile_grid(width, height)
    while True:
        chunk = LANES * CHUNK * take_next(counter)
        if chunk >= len(mean):
            return
        for begin in range(chunk, min(chunk + LANES * CHUNK, len(mean)), LANES):
            count = min(LANES, len(mean) - begin)
            for lane in range(count):
                _load(group, lane, begin + lane, mean, scale, quat_wxyz, opacity)
                set_direction(group, lane, begin + lane, eye, sh_rotation)
            covariances(group)
            conics(group, view, lens, width, height)
            centres(group, clip, width, height)
            extents(group, columns, rows)
            bases(group)
            for lane in range(count):
                i = begin + lane
                if _store(i, group, lane, splats, depth, radius, tiles):
                    set_colour(splats, i, group, lane, sh, coefficients)
                    if engine:
                        touch_engine(tiles, splats, i, columns, rows)
                    count_tiles(counts, worker, tiles, i, columns)


@inlined
def _load(group: F32, lane: int, i: int, mean: F32, scale: F32, quat_wxyz: F32, opacity: F32) -> None:
    """Put splat i into its lane."""
    for k in range(3):
        group[MEAN + LANES * k + lane], group[SCALE + LANES * k + lane] = mean[i, k], scale[i, k]
    for k in range(4):
        group[QUAT + LANES * k + lane] = quat_wxyz[i, k]
    group[SPLAT + LANES * OPACITY + lane] = opacity[i]


@inlined
def _store(i: int, group: F32, lane: int, splats: F32, depth: F32, radius: I32, tiles: I32) -> bool:
    """Write splat i of the screen but for its colour, zeros where it is not drawn; returns whether it is."""
    drawn: bool = group[DRAWN + lane] != f32(0)
    depth[i] = group[DEPTH + lane] if drawn else f32(0)
    radius[i] = _whole(group[RADIUS + lane]) if drawn else np.int32(0)
    for k in range(4):
        tiles[i, k] = np.int32(group[TILES + LANES * k + lane]) if drawn else np.int32(0)
    for k in range(COLUMNS):
        splats[i, k] = group[SPLAT + LANES * k + lane] if drawn else f32(0)
    return drawn


@inlined
def _whole(radius: np.float32) -> np.int32:
    """A radius as int32; beyond its range the least, as NumPy converts."""
    return np.int32(radius) if radius < INT32_END else np.int32(-(2**31))
