"""Stage `raster`: composites sorted splats into an image, in one of two profiles.

`trainer` is the CUDA rasteriser that the avatars were trained with: the tiles of the 3-sigma radius, and a
pixel stops before its transmittance falls below 1e-4. `engine` is what a GPU can do that draws one quad
a splat: every pixel with alpha >= 1/255, no stop. Both run tile by tile here, in float32, front to back.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, I32
from avatar_runtime.camera import Camera
from avatar_runtime.stages.project import TILE, Projected, touched_tiles
from avatar_schema import constants

PROFILES = ("trainer", "engine")
# Splats composited at once: large enough to vectorise, small enough for the cache and the trainer's early stop.
CHUNK = {"trainer": 64, "engine": 256}
# Pixels along the edge of a tile. `engine` gives the same result for any size; smaller tiles hold fewer useless pairs.
TILES = {"trainer": TILE, "engine": TILE // 2}

f32 = np.float32
Index = npt.NDArray[np.int64]


@dataclass(frozen=True)
class Image:
    """Display-referred colour over the background, not clamped."""

    colour: F32  # [H, W, 3]
    transmittance: F32  # [H, W] share of the background that remains; alpha = 1 - this
    # Both are None for backends that do not count them.
    last: I32 | None = None  # [H, W] 1-based position in the tile's list of the last splat added; 0: none
    evaluations: int | None = None  # splat-pixel pairs whose exponent was computed


def raster(
    projected: Projected, order: Index, camera: Camera, background: F32, profile: str = "trainer"
) -> Image:
    """Composite the splats that `order` names over `background` [3]. Raises ValueError for an unknown profile."""
    if profile not in PROFILES:
        raise ValueError(f"{profile!r} is not one of {', '.join(PROFILES)}")
    tile = TILES[profile]
    rects = projected.tiles if profile == "trainer" else engine_tiles(projected, camera, tile)
    ids, ranges = tile_lists(rects, order, camera, tile)
    height, width = camera.height, camera.width
    columns = -(-width // tile)
    colour = np.zeros((height, width, 3), np.float32)
    transmittance = np.ones((height, width), np.float32)
    last = np.zeros((height, width), np.int32)
    evaluations = 0
    for index, (begin, end) in enumerate(ranges):
        if begin == end:
            continue
        y0, x0 = tile * (index // columns), tile * (index % columns)
        window = (slice(y0, min(y0 + tile, height)), slice(x0, min(x0 + tile, width)))
        shape = transmittance[window].shape
        composited = _composite_tile(projected, ids[begin:end], x0, y0, shape, profile)
        colour[window], transmittance[window], last[window] = composited[:3]
        evaluations += composited[3]
    image = colour + transmittance[..., None] * background.astype(np.float32)
    return Image(image, transmittance, last, evaluations)


def engine_tiles(projected: Projected, camera: Camera, tile: int) -> I32:
    """Tiles of the axis-aligned box in which alpha can reach 1/255, [N, 4]."""
    a, b, c = projected.conic.T.astype(np.float64)
    with np.errstate(all="ignore"):
        reach = 2 * np.log(np.maximum(projected.opacity * constants()["alpha_min_denominator"], 1.0))
        det = a * c - b * b
        # An indefinite conic (cancelled determinant) bounds nothing: such a splat may reach the whole image.
        half = np.sqrt(np.stack([c, a], axis=1) / det[:, None] * reach[:, None]) + 1.0
        half = np.where(det[:, None] > 0, half, 1e6).astype(np.float32)
    rects = touched_tiles(projected.centre, half, camera, tile)
    rects[projected.radius == 0] = 0
    return rects


def tile_lists(rects: I32, order: Index, camera: Camera, tile: int) -> tuple[Index, npt.NDArray[np.int64]]:
    """(ids, [tiles, 2] begin and end in ids): every tile's splats in compositing order, tiles row by row."""
    columns, rows = -(-camera.width // tile), -(-camera.height // tile)
    x0, y0, x1, y1 = rects[order].astype(np.int64).T
    wide = x1 - x0
    count = wide * (y1 - y0)
    owner = np.repeat(np.arange(len(order)), count)
    step = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    across = np.maximum(wide, 1)[owner]
    key = (y0[owner] + step // across) * columns + x0[owner] + step % across
    by_tile = np.argsort(key, kind="stable")
    edges = np.searchsorted(key[by_tile], np.arange(columns * rows + 1))
    return order[owner[by_tile]], np.stack([edges[:-1], edges[1:]], axis=1)


def _composite_tile(
    projected: Projected, ids: Index, x0: int, y0: int, shape: tuple[int, ...], profile: str
) -> tuple[F32, F32, I32, int]:
    """(colour, transmittance, last, evaluations) of one tile of `shape` (rows, columns) at (x0, y0)."""
    ys, xs = np.mgrid[y0 : y0 + shape[0], x0 : x0 + shape[1]].reshape(2, -1).astype(np.float32)
    colour = np.zeros((len(xs), 3), np.float32)
    left = np.ones(len(xs), np.float32)
    last = np.zeros(len(xs), np.int32)
    live = np.arange(len(xs))
    evaluations, stop, size = 0, profile == "trainer", CHUNK[profile]
    for at in range(0, len(ids), size):
        chunk = ids[at : at + size]
        alpha = _alpha(projected, chunk, xs[live], ys[live])
        evaluations += alpha.size
        after = np.multiply.accumulate(np.concatenate([left[None, live], 1 - alpha]), axis=0)
        before, after = after[:-1], after[1:]
        if stop:
            open_ = after >= f32(constants()["transmittance_min"])
            alpha *= open_
        weighted = projected.rgb[chunk].T[:, :, None] * alpha * before  # [3, C, P]
        weighted[:, 0] += colour[live].T
        colour[live] = np.add.reduce(weighted, axis=1).T  # along a middle axis NumPy adds in order
        added = alpha > 0
        reached = np.where(added.any(axis=0), at + len(chunk) - np.argmax(added[::-1], axis=0), last[live])
        last[live] = reached
        if stop:
            kept = np.where(open_, after, np.inf).min(axis=0, initial=np.inf)
            left[live] = np.minimum(left[live], kept)
            live = live[open_[-1]]
            if not len(live):
                break
        else:
            left[live] = after[-1]
    return colour.reshape(*shape, 3), left.reshape(shape), last.reshape(shape), evaluations


def _alpha(projected: Projected, ids: Index, xs: F32, ys: F32) -> F32:
    """[C, P] min(0.99, o e^p), 0 where the exponent is positive or alpha is below 1/255."""
    dx = projected.centre[ids, 0, None] - xs
    dy = projected.centre[ids, 1, None] - ys
    a, b, c = (projected.conic[ids, k, None] for k in range(3))
    power = f32(-0.5) * (a * dx * dx + c * dy * dy) - b * dx * dy
    alpha_min = f32(1) / f32(constants()["alpha_min_denominator"])
    opacity = projected.opacity[ids]
    alpha = np.zeros(power.shape, np.float32)
    with np.errstate(divide="ignore", over="ignore"):
        faintest = np.log(alpha_min / opacity) - f32(1e-3)  # surely below 1/255; most pairs are
    pair = np.flatnonzero((power <= 0) & (power >= faintest[:, None]))
    # Rounded from float64: NumPy's float32 exp is up to 2 ulp off, which would show in the golden images.
    exp = np.exp(power.ravel()[pair], dtype=np.float64).astype(np.float32)
    value = np.minimum(f32(constants()["alpha_max"]), opacity[pair // power.shape[1]] * exp)
    value[value < alpha_min] = 0
    alpha.ravel()[pair] = value
    return alpha
