"""Which Gaussians become one: the pairs whose merging changes the picture least, round after round."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from avatar_export.levels.neighbours import close_pairs
from avatar_runtime.avatar import F32, F64, I64

SHAPE_WEIGHT = 0.04  # of the Bhattacharyya distance against squared differences of colour
MOTION_WEIGHT = 0.02  # of the distance in the pose that parts a pair most, in squared sizes
GROWTH_WEIGHT = 0.05  # of the largest difference of growth, squared
ROUND_SHARE = 0.3  # of the clusters that one round may merge away; more would take poor partners
BLOCK = 1 << 17  # pairs measured at once


@dataclass(frozen=True)
class Features:
    """What decides whether Gaussians may become one."""

    mass: F64  # [N] measured contribution, > 0
    mean: F64  # [N, 3] binding pose
    covariance: F64  # [N, 3, 3] binding pose
    rgb: F64  # [N, 3] DC colour
    posed: F32  # [P, N, 3] means in some poses
    growth: F32  # [P, N] mean log scale in those poses, less that of the binding pose
    group: npt.NDArray[np.int64]  # [N] merging never crosses groups


def clusters(features: Features, count: int, grain: float) -> I64:
    """[N] the cluster of each Gaussian, numbered by its first member's id; about `count` clusters.

    Each round merges the cheapest pairs of neighbours, no cluster twice. The cost of a pair is Ward's: the harmonic
    mass m1 m2 / (m1 + m2) times the distance of colours, shapes and motions. `grain` (bundle units) is the size
    below which shapes look alike. A group keeps at least one Gaussian.
    """
    label = np.arange(len(features.mass))
    state = features
    while len(state.mass) > count:
        pairs = _chosen(state, len(state.mass) - count, grain)
        if not len(pairs):
            break
        into = np.arange(len(state.mass))
        into[pairs[:, 1]] = pairs[:, 0]
        _, into = np.unique(into, return_inverse=True)
        label = into[label]
        state = _merged(state, into, len(state.mass) - len(pairs))
    return label


def _chosen(state: Features, most: int, grain: float) -> I64:
    """[P, 2] disjoint pairs of neighbours, cheapest first, at most `most`."""
    pairs = close_pairs(state.mean, state.group)
    if not len(pairs):
        return pairs
    cost = np.concatenate([_cost(state, pairs[at : at + BLOCK], grain) for at in range(0, len(pairs), BLOCK)])
    limit = min(most, max(1, int(ROUND_SHARE * len(state.mass))))
    return _disjoint(pairs[np.argsort(cost, kind="stable")], len(state.mass), limit)


def _disjoint(pairs: I64, count: int, limit: int) -> I64:
    """The first `limit` of `pairs` [P, 2] that a greedy walk takes, which skips pairs with a member taken before."""
    free = np.ones(count, bool)
    taken = []
    for index, (a, b) in enumerate(pairs.tolist()):
        if free[a] and free[b]:
            free[a] = free[b] = False
            taken.append(index)
            if len(taken) == limit:
                break
    return pairs[taken]


def _cost(state: Features, pairs: I64, grain: float) -> F64:
    i, j = pairs.T
    mass = state.mass[i] * state.mass[j] / (state.mass[i] + state.mass[j])
    colour = np.sum((state.rgb[i] - state.rgb[j]) ** 2, axis=1)
    floor = grain**2 * np.eye(3)
    a, b = state.covariance[i] + floor, state.covariance[j] + floor
    between, apart = (a + b) / 2, state.mean[i] - state.mean[j]
    solved = np.linalg.solve(between, apart[..., None])[..., 0]
    shape = np.sum(apart * solved, axis=1) / 8
    shape += 0.5 * np.log(np.linalg.det(between) / np.sqrt(np.linalg.det(a) * np.linalg.det(b)))
    reach = np.trace(between, axis1=1, axis2=2)
    parted = np.max(np.sum((state.posed[:, i] - state.posed[:, j]) ** 2, axis=2), axis=0, initial=0)
    parted = parted / reach
    grown = np.max((state.growth[:, i] - state.growth[:, j]) ** 2, axis=0, initial=0)
    result: F64 = mass * (colour + SHAPE_WEIGHT * shape + MOTION_WEIGHT * parted + GROWTH_WEIGHT * grown)
    return result


def _merged(state: Features, into: I64, count: int) -> Features:
    """Moments of the merged clusters; `into` [N] numbers them."""
    mass: F64 = np.bincount(into, state.mass, count).astype(np.float64)
    share = state.mass / mass[into]
    mean = summed(share[:, None] * state.mean, into, count)
    posed = np.stack([summed(share[:, None] * at, into, count) for at in state.posed]).astype(np.float32)
    growth = summed(share[:, None] * state.growth.T, into, count).T.astype(np.float32)
    group = np.zeros(count, np.int64)
    group[into] = state.group
    return Features(
        mass,
        mean,
        merged_covariance(share, state.mean, state.covariance, mean, into),
        summed(share[:, None] * state.rgb, into, count),
        posed,
        growth,
        group,
    )


def merged_covariance(share: F64, mean: F64, covariance: F64, centre: F64, into: I64) -> F64:
    """[C, 3, 3] second moments about the merged `centre` [C, 3] of Gaussians with the shares `share` [N]."""
    off = mean - centre[into]
    spread = covariance + off[:, :, None] * off[:, None, :]
    return summed(share[:, None] * spread.reshape(-1, 9), into, len(centre)).reshape(-1, 3, 3)


def summed(values: F64, into: I64, count: int) -> F64:
    """[count, C] sums of `values` [N, C] by cluster."""
    return np.stack([np.bincount(into, column, count) for column in values.T], axis=1)
