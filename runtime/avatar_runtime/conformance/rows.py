"""Chooses the Gaussians, vertices and pixels that a reference keeps: few, spread evenly, always the same."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import I32, I64, Avatar, Embedding
from avatar_runtime.subset import Subset, subset

PATCHES = 8  # of a surface


def thinned(avatar: Avatar, most: int) -> Subset:
    """At most `most` Gaussians of all groups and at most about as many vertices, as an avatar of its own."""
    if avatar.embedding is not None:
        return _on_surface(avatar, avatar.embedding, most)
    vertices = 0 if avatar.rig is None else len(avatar.rig.vertices)
    return subset(avatar, _of_groups(avatar, most), spread(vertices, most))


def spread(count: int, most: int) -> I64:
    """Up to `most` of 0..count-1, evenly, the first and the last among them."""
    result: I64 = np.unique(np.linspace(0, count - 1, min(count, most)).astype(np.int64))
    return result


def kept_pixels(drawn: npt.NDArray[np.bool_], most: int) -> I32:
    """Up to `most` pixels, three quarters of them drawn, one quarter without a splat."""
    inside, outside = np.flatnonzero(drawn), np.flatnonzero(~drawn)
    blank = min(len(outside), most // 4)
    picked = (inside[spread(len(inside), most - blank)], outside[spread(len(outside), blank)])
    result: I32 = np.sort(np.concatenate(picked)).astype(np.int32)
    return result


def _of_groups(avatar: Avatar, most: int) -> I64:
    """Every group gets its share; a small group keeps all its rows, up to an even share."""
    left, rows = most, []
    by_size = sorted(avatar.groups, key=lambda group: group.count)
    for index, group in enumerate(by_size):
        share = min(group.count, left // (len(by_size) - index))
        rows.append(group.first + spread(group.count, share))
        left -= share
    return np.sort(np.concatenate(rows))


def _on_surface(avatar: Avatar, embedding: Embedding, most: int) -> Subset:
    """Patches of neighbours: each Gaussian needs the triangles around its three vertices, which patches share."""
    corners = embedding.canonical_vertices[embedding.vertex_ids]
    foot = np.einsum("nc,ncx->nx", embedding.barycentric, corners)
    seeds = foot[spread(len(foot), PATCHES)]
    nearest = [np.argsort(np.sum((foot - seed) ** 2, axis=1), kind="stable")[:most] for seed in seeds]
    each = -(-most // len(seeds))
    while True:
        rows = np.unique(np.concatenate([ids[:each] for ids in nearest]))[:most]
        part = subset(avatar, rows, np.zeros(0, np.int64))
        if len(part.vertices) <= most or each == 1:
            return part
        each = max(1, each * 3 // 4)
