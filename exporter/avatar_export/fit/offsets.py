"""Offsets of Gaussians from the vertices of their mesh (LAM): do they make one surface, as they stand or mirrored?"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from avatar_export.fit.neighbours import LEAST
from avatar_export.notes.note import Note, doubt
from avatar_runtime.avatar import F32, F64, I64, U32, Avatar

LEAST_OFFSET = 1e-4  # metres, the median of offsets that are judged
SCATTERED = 0.5  # of an offset's length along an axis: its difference from the mean of its neighbours
SMOOTH = 0.5  # the same of scales, without which the avatar is no evidence
SMOOTHER = 0.55  # bends of the mirrored surface over those of the one given
BLOCKS, BENDS = 8, 1000  # of rows, judged alone; edges of one
CELLS, FAR, STEPS, PAIRS = 2.5, 3.0, 16, 300  # edges; in a cell, neighbours in the order of rows; pairs
MORE_ALIKE = 0.25  # correlation of brightness and hue together
VISIBLE = -2.0  # logit of an opacity
MIRRORED: Mapping[str, tuple[int, int, int]] = {
    "all": (-1, -1, -1), "x": (-1, 1, 1), "y": (1, -1, 1), "z": (1, 1, -1),
}  # fmt: skip


def doubts(avatar: Avatar) -> list[Note]:
    """A doubt about offsets unlike their neighbours', or about a mirrored axis, if each vertex carries one Gaussian."""
    rig = avatar.rig
    if rig is None or avatar.gaussians.count != len(rig.vertices) or len(rig.vertices) < LEAST:
        return []
    if not np.array_equal(rig.skin.row_ptr, avatar.skin.row_ptr):
        return []  # as many by chance
    vertices = rig.vertices.astype(np.float64)
    offset = avatar.gaussians.mean - vertices
    edges, pairs = _edges(rig.triangles)
    if not len(pairs) or not np.isfinite(offset).all() or np.abs(offset).mean() < LEAST_OFFSET:
        return []
    scattered = _scattered(offset, edges)
    if scattered.max() > SCATTERED and _scattered(avatar.gaussians.log_scale, edges).max() < SMOOTH:
        return [doubt("offsets_scattered", axis="xyz"[int(scattered.argmax())], share=float(scattered.max()))]
    length = CELLS * float(np.median(np.linalg.norm(vertices[edges[:, 0]] - vertices[edges[:, 1]], axis=1)))
    own, alike = _bends(vertices + offset, rig.triangles, pairs), _alike(avatar, vertices + offset, length)
    for axes, signs in MIRRORED.items():
        points = vertices + offset * signs
        smoother = (_bends(points, rig.triangles, pairs) < SMOOTHER * own).any()
        if smoother or _alike(avatar, points, length) > alike + MORE_ALIKE:
            return [doubt("offsets_mirrored", axes=axes)]
    return []


def _edges(triangles: U32) -> tuple[I64, I64]:
    """([E, 2] vertices of each edge, once a triangle; [P, 2] triangles that share an edge)."""
    corner = triangles.astype(np.int64)
    edges = np.sort(np.concatenate([corner[:, [0, 1]], corner[:, [1, 2]], corner[:, [2, 0]]]), axis=1)
    key = edges[:, 0] * (int(corner.max(initial=0)) + 1) + edges[:, 1]
    order = np.argsort(key, kind="stable")
    same = np.flatnonzero(key[order][1:] == key[order][:-1])
    row = order % len(corner)
    return edges, np.stack([row[same], row[same + 1]], axis=1)


def _scattered(values: F32 | F64, edges: I64) -> F64:
    """[3] how much `values` [V, 3] differ from the mean of their neighbours, of their own size; 0 where they are 0."""
    a, b = np.concatenate([edges, edges[:, ::-1]]).T
    values = values - values.mean(axis=0)
    count = np.maximum(np.bincount(a, minlength=len(values)), 1)[:, None]
    mean = np.stack([np.bincount(a, values[b, axis], len(values)) for axis in range(3)], axis=1) / count
    share: F64 = np.abs(values - mean).mean(axis=0) / np.maximum(np.abs(values).mean(axis=0), LEAST_OFFSET)
    return share


def _bends(vertices: F64, triangles: U32, pairs: I64) -> F64:
    """[B] the mean of 1 - cosine between triangles that share an edge, in each block of rows; NaN of few."""
    corner = vertices[triangles]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    bend = 1 - np.einsum("ij,ij->i", normal[pairs[:, 0]], normal[pairs[:, 1]])
    block = (triangles.max(axis=1).astype(np.int64) * BLOCKS // len(vertices))[pairs].max(axis=1)
    count = np.bincount(block, minlength=BLOCKS).astype(np.float64)
    count[count < BENDS] = np.nan
    mean: F64 = np.bincount(block, bend, BLOCKS) / count
    return mean


def _alike(avatar: Avatar, points: F64, length: float) -> float:
    """The correlation of brightness plus that of hue between Gaussians within `length`, the median edge, of each other
    that are no neighbours on the mesh; NaN if there are few."""
    assert avatar.rig is not None
    rows = np.flatnonzero(avatar.gaussians.opacity_logit > VISIBLE)
    cell = np.floor((points[rows] - points.min(axis=0)) / length).astype(np.int64)
    key = cell @ np.array([1 << 42, 1 << 21, 1])
    order = np.argsort(key, kind="stable")
    pairs = np.concatenate([np.stack([order[:-step], order[step:]]) for step in range(1, STEPS)], axis=1)
    a, b = rows[pairs[:, key[pairs[0]] == key[pairs[1]]]]
    far = np.linalg.norm(avatar.rig.vertices[a] - avatar.rig.vertices[b], axis=1) > FAR * length
    if np.count_nonzero(far) < PAIRS:
        return float("nan")
    colour = avatar.gaussians.sh[:, 0].astype(np.float64)
    values = np.stack([colour.mean(axis=1), colour[:, 0] - colour[:, 2]], axis=1)
    values = (values - values[rows].mean(axis=0)) / np.maximum(values[rows].std(axis=0), 1e-30)
    return float((values[a[far]] * values[b[far]]).mean(axis=0).sum())
