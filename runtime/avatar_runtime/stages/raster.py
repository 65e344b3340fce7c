"""Stage `raster`: composites sorted splats into an image, in one of two profiles.

`trainer` is the CUDA rasteriser that the avatars were trained with: the tiles of the 3-sigma radius, and a
pixel stops before its transmittance falls below 1e-4. `engine` is what a GPU can do that draws one quad
a splat: every pixel with alpha >= 1/255, no stop. Both run tile by tile here, in float32, front to back;
tiles of few splats side by side.
"""

from __future__ import annotations

from collections.abc import Iterator
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

PAIRS = 16384  # of a splat and a pixel that several tiles hold at once: about what one tile's chunk holds

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
    colour = np.zeros((height, width, 3), np.float32)
    transmittance = np.ones((height, width), np.float32)
    last = np.zeros((height, width), np.int32)
    evaluations, table = 0, _Table.of(projected)
    for tiles, shape in _alike(ranges, camera, tile, CHUNK[profile]):
        y0, x0 = tile * np.stack(np.divmod(tiles, -(-width // tile)))[:, :, None]
        y, x = y0 + np.arange(shape[0]), x0 + np.arange(shape[1])
        pixels = (y[:, :, None], x[:, None, :])  # [T, rows, columns]
        composited = _composite_tiles(table, _lists(ids, ranges[tiles], table.nobody), x, y, profile)
        colour[pixels], transmittance[pixels], last[pixels], pairs = composited
        evaluations += pairs
    image = colour + transmittance[..., None] * background.astype(np.float32)
    return Image(image, transmittance, last, evaluations)


def raster_depth(projected: Projected, clip_depth: F32, camera: Camera, depth_alpha: float) -> F32:
    """Depth [H, W] that splats leave for what an engine draws later, 0 near to 1 far.

    It is the least `clip_depth` [N] (clip z / w of the means) of the splats whose own alpha at the pixel, in profile
    `engine`, is at least `depth_alpha`, and 1 where there is none. Splats beyond 0 and 1 are clipped.
    """
    tile = TILES["engine"]
    shown = (projected.radius > 0) & (clip_depth >= 0) & (clip_depth <= 1)
    ids, ranges = tile_lists(engine_tiles(projected, camera, tile), np.flatnonzero(shown), camera, tile)
    table, far = _Table.of(projected), np.append(clip_depth, f32(1)).astype(np.float32)
    depth = np.ones((camera.height, camera.width), np.float32)
    for tiles, shape in _alike(ranges, camera, tile, 1):
        y0, x0 = tile * np.stack(np.divmod(tiles, -(-camera.width // tile)))[:, :, None]
        y, x = y0 + np.arange(shape[0]), x0 + np.arange(shape[1])
        lists = _lists(ids, ranges[tiles], table.nobody)
        alpha = _alpha(table, lists, x, y, np.arange(shape[0] * shape[1]))
        nearest = np.where(alpha >= f32(depth_alpha), far[lists][..., None], f32(1)).min(axis=1)
        depth[y[:, :, None], x[:, None, :]] = nearest.reshape(-1, *shape)
    return depth


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


def _alike(ranges: Index, camera: Camera, tile: int, chunk: int) -> Iterator[tuple[Index, tuple[int, int]]]:
    """(tiles, their rows and columns of pixels): tiles of one shape to composite at once, those of no splat left out.

    Lists that are longer than a chunk come alone; the others with those of about their length.
    """
    count = ranges[:, 1] - ranges[:, 0]
    row, column = np.divmod(np.arange(len(count)), -(-camera.width // tile))
    rows = np.minimum(tile, camera.height - tile * row)
    columns = np.minimum(tile, camera.width - tile * column)
    for shape in {*zip(rows.tolist(), columns.tolist(), strict=True)}:
        same = np.flatnonzero((rows == shape[0]) & (columns == shape[1]) & (count > 0))
        same = same[np.argsort(-count[same], kind="stable")]
        at = 0
        while at < len(same):
            longest = count[same[at]]
            many = 1 if longest > chunk else max(1, PAIRS // (longest * shape[0] * shape[1]))
            yield same[at : at + many], shape
            at += many


def _lists(ids: Index, ranges: Index, nobody: int) -> Index:
    """The splats of several tiles, front to back, [T, C]; shorter lists end with `nobody`."""
    begin, end = ranges[:, :1], ranges[:, 1:]
    at = begin + np.arange((end - begin).max())
    return np.where(at < end, ids[np.minimum(at, end - 1)], nobody)


@dataclass(frozen=True)
class _Table:
    """What the pixels of a splat share, and a last row that draws nothing."""

    centre: F32  # [N + 1, 2]
    conic: F32  # [N + 1, 3]
    opacity: F32  # [N + 1]
    rgb: F32  # [N + 1, 3]
    faintest: F32  # [N + 1] alpha is surely below 1/255 where the exponent is below this; most pairs are

    @staticmethod
    def of(projected: Projected) -> _Table:
        """The table of all projected splats."""
        centre, conic, opacity, rgb = (
            np.concatenate([part, np.zeros_like(part, shape=(1, *part.shape[1:]))])
            for part in (projected.centre, projected.conic, projected.opacity, projected.rgb)
        )
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            faintest = np.log(_alpha_min() / opacity) - f32(1e-3)
        return _Table(centre, conic, opacity, rgb, faintest)

    @property
    def nobody(self) -> int:
        """The row that draws nothing."""
        return len(self.opacity) - 1


def _alpha_min() -> np.float32:
    return f32(1) / f32(constants()["alpha_min_denominator"])


def _composite_tiles(
    table: _Table, lists: Index, x: Index, y: Index, profile: str
) -> tuple[F32, F32, I32, int]:
    """(colour, transmittance, last, evaluations) of tiles of columns `x` [T, W] and rows `y` [T, H]: [T, H, W, ...].

    Several tiles have lists of one chunk at most: which pixels go on to the next one differs from tile to tile.
    """
    shape = (len(lists), y.shape[1], x.shape[1])
    count = shape[1] * shape[2]
    colour = np.zeros((3, len(lists), count), np.float32)
    left = np.ones((len(lists), count), np.float32)
    last = np.zeros((len(lists), count), np.int32)
    live = np.arange(count)
    evaluations, stop, size = 0, profile == "trainer", CHUNK[profile]
    for at in range(0, lists.shape[1], size):
        chunk = lists[:, at : at + size]
        alpha = _alpha(table, chunk, x, y, live)
        evaluations += int(np.count_nonzero(chunk != table.nobody)) * len(live)
        seen = np.flatnonzero(alpha.any(axis=(0, 2)))  # about half of them: tiles are those of a circle
        if not len(seen):
            continue
        alpha, chunk = alpha[:, seen], chunk[:, seen]
        after = np.multiply.accumulate(np.concatenate([left[:, None, live], 1 - alpha], axis=1), axis=1)
        before, after = after[:, :-1], after[:, 1:]
        if stop:
            open_ = after >= f32(constants()["transmittance_min"])
            alpha *= open_
        weighted = table.rgb[chunk].transpose(2, 0, 1)[..., None] * alpha  # [3, T, C, P]
        weighted *= before
        weighted[:, :, 0] += colour[..., live]
        colour[..., live] = np.add.reduce(weighted, axis=2)  # along a middle axis NumPy adds in order
        added = alpha > 0
        reached = at + 1 + seen[len(seen) - 1 - np.argmax(added[:, ::-1], axis=1)]
        last[:, live] = np.where(added.any(axis=1), reached, last[:, live])
        if stop:
            kept = np.where(open_, after, np.inf).min(axis=1, initial=np.inf)
            left[:, live] = np.minimum(left[:, live], kept)
            live = live[open_[:, -1].any(axis=0)]
            if not len(live):
                break
        else:
            left[:, live] = after[:, -1]
    return colour.transpose(1, 2, 0).reshape(*shape, 3), left.reshape(shape), last.reshape(shape), evaluations


def _alpha(table: _Table, ids: Index, x: Index, y: Index, live: Index) -> F32:
    """[T, C, P] min(0.99, o e^p) of pixels `live`; 0 where p is positive or alpha below 1/255."""
    centre, conic = table.centre[ids], table.conic[ids]
    a, b, c = (conic[..., k, None] for k in range(3))
    wide = x.shape[1]
    dx = centre[..., 0, None] - x[:, None, live % wide].astype(np.float32)  # [T, C, P]
    dy = centre[..., 1, None] - y[:, None, live // wide].astype(np.float32)
    power = f32(-0.5) * (a * dx * dx + c * dy * dy) - b * dx * dy
    alpha = np.zeros(power.shape, np.float32)
    pair = np.flatnonzero((power <= 0) & (power >= table.faintest[ids, None]))
    # Rounded from float64: NumPy's float32 exp is up to 2 ulp off, which would show in the golden images.
    exp = np.exp(power.ravel()[pair], dtype=np.float64).astype(np.float32)
    opacity = table.opacity[ids.ravel()[pair // power.shape[2]]]
    value = np.minimum(f32(constants()["alpha_max"]), opacity * exp)
    value[value < _alpha_min()] = 0
    alpha.ravel()[pair] = value
    return alpha
