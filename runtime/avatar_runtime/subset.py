"""Cuts some rows out of an avatar. Every stage plays the result exactly as it plays those rows of the whole avatar."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import I64, Avatar, Blendshapes, Embedding, Gaussians, Group, Packed, Rig
from avatar_runtime.program.bake import bake
from avatar_runtime.program.coded import coded_of, taken
from avatar_runtime.topology import vertex_triangles


@dataclass(frozen=True)
class Subset:
    """The smaller avatar, and the ids that its rows have in the whole one."""

    avatar: Avatar
    rows: I64  # [n] Gaussian ids, increasing
    vertices: (
        I64  # [v] vertex ids, increasing: with their neighbours, so that normals are those of the whole mesh
    )


def subset(avatar: Avatar, rows: npt.NDArray[Any], vertices: npt.NDArray[Any]) -> Subset:
    """The Gaussians `rows` (increasing ids) and the mesh's `vertices`.

    Vertices that a surface Gaussian or its neighbouring normals need are added. Groups keep their place and may
    become empty; names, joints and clips stay whole.
    """
    rows = np.asarray(rows, np.int64)
    vertices = np.unique(np.asarray(vertices, np.int64))
    embedding, triangles = avatar.embedding, None
    if embedding is not None:
        under = np.unique(embedding.vertex_ids[rows])
        triangles = _triangles_of(embedding, under, rows)
        vertices = np.unique(np.concatenate([vertices, embedding.triangles[triangles].ravel()]))
        embedding = _embedding(embedding, rows, vertices, triangles)
    g, b = avatar.gaussians, avatar.blendshapes
    part = replace(
        avatar,
        gaussians=Gaussians(
            g.mean[rows], g.log_scale[rows], g.quat_wxyz[rows], g.opacity_logit[rows], g.sh[rows]
        ),
        groups=tuple(_group(group, rows) for group in avatar.groups),
        blendshapes=Blendshapes(
            b.geometry.take(rows), b.appearance.take(rows), b.correctives.take(rows), b.late_morphs.take(rows)
        ),
        skin=avatar.skin.take(rows),
        rig=None if avatar.rig is None else _rig(avatar.rig, vertices, embedding),
        embedding=embedding,
        relight=None
        if avatar.relight is None
        else replace(avatar.relight, normal=avatar.relight.normal[rows]),
    )
    return Subset(_with_codes(avatar, part, rows, vertices), rows, vertices)


def _with_codes(avatar: Avatar, part: Avatar, rows: I64, vertices: I64) -> Avatar:
    """`part` with a program of the same integers as that of `avatar`, if it has one from a pack."""
    packed = avatar.packed
    if packed is None or not packed.fits(avatar):
        return replace(part, packed=None)
    coded = taken(coded_of(packed.program, packed.level, avatar), avatar, rows, vertices)
    return replace(part, packed=Packed.of(part, bake(part, coded), 0, 1, lambda _: part))


def _group(group: Group, rows: I64) -> Group:
    first, end = np.searchsorted(rows, [group.first, group.first + group.count])
    return replace(group, first=int(first), count=int(end - first))


def _triangles_of(embedding: Embedding, under: npt.NDArray[Any], rows: I64) -> I64:
    """Every triangle that touches one of the vertices `under`, increasing, so that sums keep their order."""
    ptr, around = vertex_triangles(embedding.triangles, len(embedding.canonical_vertices))
    touched = [around[ptr[v] : ptr[v + 1]] for v in under]
    result: I64 = np.unique(np.concatenate([embedding.triangle[rows], *touched])).astype(np.int64)
    return result


def _embedding(embedding: Embedding, rows: I64, vertices: I64, triangles: I64) -> Embedding:
    def rows_or_none(values: npt.NDArray[Any]) -> npt.NDArray[Any]:
        return values[rows] if len(values) else values

    return Embedding(
        embedding.canonical_vertices[vertices],
        np.searchsorted(vertices, embedding.triangles[triangles]).astype(np.uint32),
        np.searchsorted(triangles, embedding.triangle[rows]).astype(np.uint32),
        embedding.barycentric[rows],
        rows_or_none(embedding.displacement),
        rows_or_none(embedding.local_offset),
        embedding.local_quat_wxyz[rows],
    )


def _rig(rig: Rig, vertices: I64, embedding: Embedding | None) -> Rig:
    """The rig with only `vertices`; other anchors and their triangles are removed."""
    kept = np.isin(rig.triangles, vertices).all(axis=1)
    triangles = np.searchsorted(vertices, rig.triangles[kept]).astype(np.uint32)
    anchors = rig.anchor_vertices[np.isin(rig.anchor_vertices, vertices)]
    return replace(
        rig,
        vertices=rig.vertices[vertices],
        triangles=triangles if embedding is None else embedding.triangles,
        morphs=rig.morphs.take(vertices),
        correctives=rig.correctives.take(vertices),
        late_morphs=rig.late_morphs.take(vertices),
        skin=rig.skin.take(vertices),
        anchor_vertices=np.searchsorted(vertices, anchors).astype(np.uint32),
    )
