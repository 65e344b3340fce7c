"""Stage `sort` of the `cpu` backend: a stable radix sort of the drawn splats by view z."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, I32, U32
from avatar_runtime.backends.cpu.arrays import read_only
from avatar_runtime.backends.cpu.jit import called, inlined, kernel
from avatar_runtime.backends.cpu.lanes import float_bits

u32, u64 = np.uint32, np.uint64
U64 = npt.NDArray[np.uint64]
DIGIT = 12  # bits of a digit at most: 4096 counters stay in the first-level cache
NOT_A_NUMBER = u32(0xFFFFFFFF)


def sort(depth: F32, radius: I32) -> U32:
    """Ids of the splats whose radius is not 0, front to back: by depth, ties by id; NaN last."""
    keys, spare = (np.empty(len(depth), np.uint64) for _ in range(2))
    order = np.empty(len(depth), np.uint32)
    return order[: sort_splats(read_only(depth), read_only(radius, np.int32), keys, spare, order)]


@kernel()
def sort_splats(
    depth: F32,  # [N]
    radius: I32,  # [N]
    keys: U64,  # [N] scratch
    spare: U64,  # [N] scratch
    order: U32,  # [N] out
) -> int:
    """Fill the front of `order`; returns how many are drawn."""
    count, low, high = 0, NOT_A_NUMBER, u32(0)
    for i in range(len(depth)):
        if radius[i] != 0:
            key = _key(depth[i])
            low, high = min(low, key), max(high, key)
            keys[count] = u64(key) << u64(32) | u64(i)
            count += 1
    bits, spread = 0, np.int64(high) - np.int64(low)
    while spread > 0:
        bits, spread = bits + 1, spread >> 1
    passes = -(-bits // DIGIT)
    width = -(-bits // max(passes, 1))
    for k in range(passes):
        _pass(keys[:count], spare, u64(low) << u64(32), u64(32 + k * width), width)
        keys, spare = spare, keys
    for i in range(count):
        order[i] = u32(keys[i])
    return count


@inlined
def _key(depth: np.float32) -> np.uint32:
    """An unsigned integer that orders as the float does; -0 is 0."""
    if depth != depth:
        return NOT_A_NUMBER
    bits = float_bits(depth + np.float32(0))
    return u32(~bits) if bits < 0 else u32(bits) | u32(0x80000000)


@called
def _pass(keys: U64, out: U64, low: np.uint64, shift: np.uint64, width: int) -> None:
    """One stable counting sort by `width` bits from `shift` on of key - low."""
    mask = u64((1 << width) - 1)
    places = np.zeros((1 << width) + 1, np.int64)
    for key in keys:
        places[((key - low) >> shift & mask) + u64(1)] += 1
    for digit in range(1 << width):
        places[digit + 1] += places[digit]
    for key in keys:
        digit = (key - low) >> shift & mask
        out[places[digit]] = key
        places[digit] += 1
