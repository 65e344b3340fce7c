"""Skin weights of a few joints that deform a mesh like all of its joints, in given poses.

Of too many joints, engines keep the strongest of a vertex and rescale their weights. Where bones oppose each other, as
in a fitted face, the missing joints matter. Here the weights of the few joints approximate the full skin: least squares
over the poses on the simplex, by accelerated projected gradient; the joint with the smallest cost is removed repeatedly
(the cost is the square of a weight divided by its entry of the inverse Gram matrix).
"""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32, F64, I64

CANDIDATES = 12  # strongest joints of a vertex that are considered
KEEP = 1e-3  # metres; the cost of changing a weight, so that weights that no pose determines do not change
ROUNDS, LAST_ROUNDS = 25, 100  # iterations before a joint is removed, and for the joints that remain
ROWS = 4096  # vertices per block


def few(vertices: F32, joints: I64, weights: F64, matrices: F64, most: int) -> tuple[I64, F64]:
    """(joints [v, most], weights [v, most]) that approximate the joints [v, n] with weights [v, n] of vertices [v, 3].

    Weights add up to 1, strongest first, in and out; `matrices` [P, J, 4, 4] are the skin matrices of the poses.
    """
    found = [
        _few(vertices[at : at + ROWS].astype(np.float64), joints[at : at + ROWS], weights[at : at + ROWS],
             matrices, most)
        for at in range(0, len(vertices), ROWS)
    ]  # fmt: skip
    return np.concatenate([j for j, _ in found]), np.concatenate([w for _, w in found])


def _few(vertices: F64, joints: I64, weights: F64, matrices: F64, most: int) -> tuple[I64, F64]:
    tried, first = joints[:, :CANDIDATES], weights[:, :CANDIDATES]
    off = _moved(vertices, tried, matrices) - _moved_by_all(vertices, joints, weights, matrices)
    gram = off.swapaxes(1, 2) @ off + KEEP**2 * np.eye(tried.shape[1])
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


def _moved(vertices: F64, joints: I64, matrices: F64) -> F64:
    """[v, 3 P, k] where each joint [v, k] alone puts each vertex in each pose."""
    count = joints.shape[1]
    found = np.empty((len(vertices), 3 * len(matrices), count))
    for pose, matrix in enumerate(matrices):
        placed = matrix[joints, :3, :3] @ vertices[:, None, :, None]
        found[:, 3 * pose : 3 * pose + 3] = (placed[..., 0] + matrix[joints, :3, 3]).swapaxes(1, 2)
    return found


def _moved_by_all(vertices: F64, joints: I64, weights: F64, matrices: F64) -> F64:
    """[v, 3 P, 1] where all joints together put each vertex in each pose."""
    poses, count = matrices.shape[:2]
    dense = np.zeros((len(vertices), count))
    np.add.at(dense, (np.arange(len(vertices))[:, None], joints), weights)
    blended = dense @ matrices[:, :, :3].transpose(1, 0, 2, 3).reshape(count, -1)
    points = np.append(vertices, np.ones((len(vertices), 1)), axis=1)
    result: F64 = blended.reshape(len(vertices), 3 * poses, 4) @ points[..., None]
    return result


def _solved(gram: F64, wanted: F64, start: F64, rounds: int) -> F64:
    """[v, k] weights on the simplex that minimise w G w / 2 - wanted w (FISTA)."""
    step = 1 / np.trace(gram, axis1=1, axis2=2)[:, None]
    weights, ahead, pace = start, start, 1.0
    for _ in range(rounds):
        moved = _simplex(ahead - step * ((gram @ ahead[..., None])[..., 0] - wanted))
        faster = (1 + np.sqrt(1 + 4 * pace * pace)) / 2
        ahead = moved + (pace - 1) / faster * (moved - weights)
        weights, pace = moved, faster
    return weights


def _simplex(values: F64) -> F64:
    """The rows [v, k] projected to the simplex: not negative, adding up to 1."""
    falling = -np.sort(-values, axis=1)
    over = np.cumsum(falling, axis=1) - 1
    counts = np.arange(1, values.shape[1] + 1)
    last = (falling - over / counts > 0).sum(axis=1) - 1
    shift = over[np.arange(len(values)), last] / (last + 1)
    result: F64 = np.maximum(values - shift[:, None], 0)
    return result
