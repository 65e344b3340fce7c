"""Skin weights of a few joints that show a mesh as all of its joints would, in given poses.

The strongest joints of a vertex, their weights scaled up, are what engines take of too many; where bones pull against
each other, as those of a fitted face do, the others are missed. Here the weights of the few are those that come
nearest to the whole skin: least squares over the poses on the simplex, by accelerated projected gradient, with the
joint left out again and again that costs least (a weight's square by its entry of the inverse Gram matrix).
"""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32, F64, I64

CANDIDATES = 12  # strongest joints of a vertex that are tried
KEEP = 1e-3  # metres that a changed weight counts for, so that what no pose tells stays as it was
ROUNDS, LAST_ROUNDS = 25, 100  # of a solution before a joint is left out, and with those that stay
ROWS = 4096  # vertices at a time


def few(vertices: F32, joints: I64, weights: F64, matrices: F64, most: int) -> tuple[I64, F64]:
    """(joints [v, most], weights [v, most]) for vertices [v, 3] whose joints [v, n] have weights [v, n], which add up
    to 1, strongest first; `matrices` [P, J, 4, 4] are the poses' skin matrices. Strongest first again.
    """
    found = [
        _few(vertices[at : at + ROWS].astype(np.float64), joints[at : at + ROWS], weights[at : at + ROWS],
             matrices, most)
        for at in range(0, len(vertices), ROWS)
    ]  # fmt: skip
    return np.concatenate([j for j, _ in found]), np.concatenate([w for _, w in found])


def _few(vertices: F64, joints: I64, weights: F64, matrices: F64, most: int) -> tuple[I64, F64]:
    tried, first = joints[:, :CANDIDATES], weights[:, :CANDIDATES]
    gram = np.tile(KEEP**2 * np.eye(tried.shape[1]), (len(vertices), 1, 1))
    for matrix in matrices:
        placed = np.einsum("vkab,vb->vka", matrix[joints, :3, :3], vertices) + matrix[joints, :3, 3]
        off = placed[:, : tried.shape[1]] - np.einsum("vk,vka->va", weights, placed)[:, None]
        gram += off @ np.swapaxes(off, 1, 2)
    wanted, solved = KEEP**2 * first, _simplex(first)
    rows = np.arange(len(vertices))[:, None]
    for count in range(tried.shape[1], most, -1):
        solved = _solved(gram, wanted, solved, ROUNDS)
        cost = solved**2 / np.diagonal(np.linalg.inv(gram), axis1=1, axis2=2)
        left = np.sort(np.argsort(-cost, axis=1, kind="stable")[:, : count - 1], axis=1)
        gram = gram[rows[..., None], left[:, :, None], left[:, None]]
        tried, wanted, solved = tried[rows, left], wanted[rows, left], _simplex(solved[rows, left])
    solved = _solved(gram, wanted, solved, LAST_ROUNDS)
    order = np.argsort(-solved, axis=1, kind="stable")
    return tried[rows, order], solved[rows, order]


def _solved(gram: F64, wanted: F64, start: F64, rounds: int) -> F64:
    """[v, k] on the simplex where w G w / 2 - wanted w is least (FISTA)."""
    step = 1 / np.trace(gram, axis1=1, axis2=2)[:, None]
    weights, ahead, pace = start, start, 1.0
    for _ in range(rounds):
        moved = _simplex(ahead - step * ((gram @ ahead[..., None])[..., 0] - wanted))
        faster = (1 + np.sqrt(1 + 4 * pace * pace)) / 2
        ahead = moved + (pace - 1) / faster * (moved - weights)
        weights, pace = moved, faster
    return weights


def _simplex(values: F64) -> F64:
    """The nearest rows [v, k] that are not negative and add up to 1."""
    falling = -np.sort(-values, axis=1)
    over = np.cumsum(falling, axis=1) - 1
    counts = np.arange(1, values.shape[1] + 1)
    last = (falling - over / counts > 0).sum(axis=1) - 1
    shift = over[np.arange(len(values)), last] / (last + 1)
    result: F64 = np.maximum(values - shift[:, None], 0)
    return result
