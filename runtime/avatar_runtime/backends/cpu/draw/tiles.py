"""Which splats each tile composites, in which order; the first half of stage `raster`."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import I32, I64, U32
from avatar_runtime.backends.cpu.jit import kernel
from avatar_runtime.backends.cpu.lanes import prefetch
from avatar_runtime.backends.cpu.workers import share

AHEAD = 16  # splats between asking for one and using it
WORTH_A_THREAD = 250_000  # pairs, about a millisecond; to start threads on a busy core can cost several


def tile_lists(tiles: I32, order: U32, counts: I64, columns: int, workers: int) -> tuple[U32, I64]:
    """(ids, starts [tiles + 1]): every tile's splats in compositing order, tiles row by row.

    `tiles` [N, 4] as a `Screen` has them; `counts` [tiles] how many splats of `order` touch each tile.
    """
    starts = np.zeros(len(counts) + 1, np.int64)
    np.cumsum(counts, out=starts[1:])
    members = np.empty(starts[-1], np.uint32)
    rows, next_place = len(counts) // columns, starts[:-1].copy()
    if len(members) < workers * WORTH_A_THREAD:
        fill_band(tiles, order, next_place, 0, rows, columns, members)
    else:
        bands = _bands(starts[::columns], workers)
        share(fill_band_of, workers, tiles, order, next_place, bands, columns, members)
    return members, starts


def _bands(row_starts: I64, workers: int) -> I64:
    """Tile rows [workers + 1] at which the bands begin and end, about as many pairs in each."""
    shares = row_starts[-1] * np.arange(workers + 1) // workers
    bands: I64 = np.searchsorted(row_starts, shares).astype(np.int64)
    return bands


@kernel()
def fill_band_of(
    worker: int,
    tiles: I32,  # [N, 4]
    order: U32,  # [drawn] ids, front to back
    next_place: I64,  # [tiles] where each tile's list begins; changed
    bands: I64,  # [workers + 1] tile rows
    columns: int,
    members: U32,  # [P] out
) -> None:
    """Append each splat to the lists of its tiles that lie in the worker's band of tile rows."""
    fill_band(tiles, order, next_place, bands[worker], bands[worker + 1], columns, members)


@kernel()
def fill_band(
    tiles: I32, order: U32, next_place: I64, begin: int, end: int, columns: int, members: U32
) -> None:
    """Append each splat to the lists of its tiles in the tile rows from `begin` to `end`."""
    for k in range(len(order)):
        i = order[k]
        prefetch(tiles, 4 * np.int64(order[min(k + AHEAD, len(order) - 1)]))
        for row in range(max(tiles[i, 1], begin), min(tiles[i, 3], end)):
            for tile in range(row * columns + tiles[i, 0], row * columns + tiles[i, 2]):
                members[next_place[tile]] = i
                next_place[tile] += 1
