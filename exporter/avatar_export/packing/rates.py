"""Rounding that weighs the error that is seen against the bits that a code costs."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64

I16 = npt.NDArray[np.int16]
SWEEPS = 4
BLOCK = 4096  # entries that are rounded at once: they fit a processor's cache
BIT = 0.12  # squared steps of error, seen as much as the mean, that one bit is worth
LARGE = 4  # numbers from here on start at the nearest, the others at 0: each then finds what pays
RARE = 0.2  # how often a number counts as used that never was
LEAST_BITS = 1.0  # on the average: Deflate takes one bit a number at least, unless all of a term are 0


def rounded(values: F32, weight: F64, metric: F64, half: int) -> I16:
    """Whole numbers [E, T, C] for `values` [E, T, C] in steps, within -half..half.

    An error e [T] of entry i in one colour costs weight[i] * e^T metric e, and each number as many bits as its
    frequency among all numbers of its term asks for. The terms are chosen in turn, so that one makes up for the errors
    of others; a term that hardly pays becomes 0 throughout.
    """
    count, terms, colours = values.shape
    nearest = np.clip(np.rint(values), -half, half)
    codes = np.where(np.abs(nearest) < LARGE, 0, nearest).astype(np.int16)
    if not count:
        return codes
    weight32 = (weight / weight.mean()).astype(np.float32)
    size = np.abs(np.arange(-half, half + 1))
    bits = np.tile(np.where(size > 0, 1.5 + 1.5 * np.log2(1 + size), 0.5).astype(np.float32), (terms, 1))
    for _ in range(SWEEPS):
        for start in range(0, count, BLOCK):
            block = slice(start, start + BLOCK)
            wanted = np.ascontiguousarray(values[block].transpose(1, 2, 0)).reshape(terms, -1)
            found = codes[block].transpose(1, 2, 0).reshape(terms, -1).astype(np.float32)
            _sweep(wanted, found, np.tile(weight32[block], colours), metric, bits, half)
            codes[block] = found.reshape(terms, colours, -1).transpose(2, 0, 1)
        bits = _bits(codes, half)
    return codes


def _sweep(wanted: F32, found: F32, weight: F32, metric: F64, bits: F32, half: int) -> None:
    """Chooses each row of `found` [T, n] anew, given the others."""
    error = wanted - found
    for term in np.argsort(-metric.diagonal(), kind="stable"):
        others = (metric[term] / metric[term, term]).astype(np.float32)
        others[term] = 0
        best = wanted[term] + others @ error
        scale = weight * np.float32(metric[term, term] / BIT)
        nearest = np.clip(np.rint(best), -half, half)
        chosen, least = nearest, _cost(nearest, best, scale, bits[term], half)
        for other in (nearest - np.sign(nearest), np.zeros_like(nearest)):
            cost = _cost(other, best, scale, bits[term], half)
            better = cost < least
            chosen, least = np.where(better, other, chosen), np.where(better, cost, least)
        found[term] = chosen
        error[term] = wanted[term] - chosen


def _cost(codes: F32, best: F32, scale: F32, bits: F32, half: int) -> F32:
    cost: F32 = scale * (codes - best) ** 2 + bits[codes.astype(np.int32) + half]
    return cost


def _bits(codes: I16, half: int) -> F32:
    """[T, 2 half + 1] bits that each number takes in each term, from how often it is used."""
    found = np.empty((codes.shape[1], 2 * half + 1), np.float32)
    for term, bits in enumerate(found):
        used = np.bincount(codes[:, term].reshape(-1).astype(np.int64) + half, minlength=2 * half + 1) + RARE
        share = used / used.sum()
        bits[:] = -np.log2(share)
        if float(share @ bits) < LEAST_BITS:
            bits[:] = np.inf
            bits[half] = 0
    return found
