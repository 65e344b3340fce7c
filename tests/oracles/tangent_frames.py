"""RGBAvatar's formulas, Gaussian by Gaussian, as its code states them. Shares nothing with the rest."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def network(flat: Array, widths: tuple[int, ...], values: Array) -> Array:
    """The output of linear layers with ReLU between, from parameters in a row: weight [out, in], then bias."""
    at = 0
    for layer, (size_in, size_out) in enumerate(pairwise(widths)):
        if layer:
            values = np.array([max(value, 0.0) for value in values])
        rows = []
        for out in range(size_out):
            begin = at + out * size_in
            rows.append(float(np.dot(flat[begin : begin + size_in], values)))
        at += size_in * size_out
        values = np.array([row + flat[at + out] for out, row in enumerate(rows)])
        at += size_out
    return values


def driving_values(expression: Array, turns: Array, eyelids: Array) -> Array:
    """129 values: 100 expressions, two rows of four rotations [4, 3, 3], two eyelids, no translation."""
    padded = np.zeros(100)
    padded[: len(expression)] = expression
    rows = [turn[row] for turn in turns for row in (0, 1)]
    return np.concatenate([padded, *rows, eyelids, np.zeros(3)])


def tangent_frame(corner: Array, uv: Array) -> Array:
    """[3, 3] columns T, B, N of one triangle."""
    edge1, edge2 = corner[1] - corner[0], corner[2] - corner[0]
    (du1, dv1), (du2, dv2) = uv[1] - uv[0], uv[2] - uv[0]
    f = 1 / (du1 * dv2 - dv1 * du2)
    columns = (f * (dv2 * edge1 - dv1 * edge2), f * (du1 * edge2 - du2 * edge1), np.cross(edge1, edge2))
    return np.stack([column / math.sqrt(column @ column) for column in columns], axis=1)


def quaternion(m: Array) -> Array:
    """wxyz of a matrix that need not be a rotation, by its largest entry of the diagonal or its trace."""
    trace = m[0, 0] + m[1, 1] + m[2, 2]
    diagonal = [m[0, 0], m[1, 1], m[2, 2]]
    q = np.zeros(4)
    i = int(np.argmax(diagonal))
    if trace > diagonal[i]:
        q[:] = 1 + trace, m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]
    else:
        j, k = (i + 1) % 3, (i + 2) % 3
        q[1 + i] = 1 - trace + 2 * m[i, i]
        q[1 + j] = m[j, i] + m[i, j]
        q[1 + k] = m[k, i] + m[i, k]
        q[0] = m[k, j] - m[j, k]
    return q / math.sqrt(q @ q)


def product(p: Array, q: Array) -> Array:
    """Hamilton product of two quaternions wxyz."""
    scalar = p[0] * q[0] - p[1:] @ q[1:]
    return np.concatenate([[scalar], p[0] * q[1:] + q[0] * p[1:] + np.cross(p[1:], q[1:])])


def gaussian(row: dict[str, Array], corner: Array, uv: Array, weights: Array) -> tuple[Array, Array, Array]:
    """(mean, unit quaternion, DC) of one Gaussian on a triangle [3, 3] with the weights [K] of its bases."""
    mean, quat, dc = row["mean"].copy(), row["quat"].copy(), row["dc"].copy()
    for weight, by_mean, by_quat, by_dc in zip(
        weights, row["mean_basis"], row["quat_basis"], row["dc_basis"], strict=True
    ):
        mean += weight * by_mean
        quat += weight * by_quat
        dc += weight * by_dc
    frame = tangent_frame(corner, uv)
    place = frame @ mean + row["bary"] @ corner
    turned = product(quaternion(frame), quat / math.sqrt(quat @ quat))
    return place, turned, dc
