"""Program to arrays: what `bake` wrote, decoded to float32 for backends that read no small integers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from avatar_runtime.avatar import F32, U32, Blendshapes, Embedding, Gaussians, SparseRows
from avatar_runtime.program.fields import (
    APPEARANCE,
    BASE,
    CORRECTIVE,
    EMBEDDED,
    GEOMETRY,
    LATE,
    LIT,
    MORPH,
    SKIN,
    VERTEX_CORRECTIVE,
    VERTEX_LATE,
)
from avatar_runtime.program.model import Pass, Program
from avatar_runtime.program.sections import Source, dense_values, sparse_rows
from avatar_runtime.rules import NORMAL_POSITIONS


@dataclass(frozen=True)
class Columns:
    """How many columns the sparse parts of an avatar have."""

    expressions: int
    features: int
    late_morphs: int
    joints: int


@dataclass(frozen=True)
class LevelArrays:
    """The arrays of one level's Gaussians."""

    gaussians: Gaussians
    blendshapes: Blendshapes
    skin: SparseRows
    embedding: Embedding | None
    normal: F32 | None  # [N, 3] of stage light; None: there is no such stage


@dataclass(frozen=True)
class MeshArrays:
    """The arrays of a rig that the GPU reads."""

    vertices: F32
    morphs: SparseRows
    correctives: SparseRows
    late_morphs: SparseRows
    skin: SparseRows


class _Chunks:
    """The static buffers of one kind that passes read: of the chunks of a level, or of the mesh."""

    def __init__(self, program: Program, kind: str, passes: Sequence[Pass]) -> None:
        self.sources = [Source(program.buffers[one.buffers[kind]], one.constants) for one in passes]
        self.rows = [one.count("count") for one in passes]

    def dense(self, fields: dict[str, tuple[str, str]] | Any, section: str, channels: int) -> F32:
        return dense_values(self.sources, section, fields[section][1], self.rows, channels)

    def sparse(self, name: str, kinds: Any, shapes: dict[str, tuple[int, ...]], columns: int) -> SparseRows:
        wanted = {a: (*kinds[a], shape) for a, shape in shapes.items()}
        return sparse_rows(self.sources, name, wanted, columns)


def read_level(program: Program, level: int, columns: Columns, position_rule: str) -> LevelArrays:
    """The Gaussians of one level. The program has passed `check_program`."""
    own = program.levels[level]

    def chunks(kind: str, passes: Sequence[Pass] = own.deform) -> _Chunks:
        """The first pass over each chunk that binds such a buffer."""
        found = [
            next(one for one in passes if kind in one.buffers and one.buffers["Splats"] == name)
            for name in own.names("Splats")
        ]
        return _Chunks(program, kind, found)

    blend, n = chunks("BlendStatic"), own.rows
    terms = own.deform[0].count("sh_terms")
    sh = blend.dense(BASE, "base_sh", 3 * terms).reshape(n, terms, 3)
    mean, quat = blend.dense(BASE, "base_mean", 3), blend.dense(BASE, "base_quat", 4)
    log_scale = blend.dense(BASE, "base_log_scale", 3)
    opacity = blend.dense(BASE, "base_opacity", 1)[:, 0]
    geometry = blend.sparse("geometry", GEOMETRY, {"mean": (3,), "quat_wxyz": (4,)}, columns.expressions)
    shapes: dict[str, tuple[int, ...]] = {"log_scale": (3,), "opacity_logit": (), "sh": (terms, 3)}
    appearance = blend.sparse("appearance", APPEARANCE, shapes, columns.expressions)
    correctives = SparseRows.empty(n, columns.features, {"mean": (3,)})
    late = SparseRows.empty(n, columns.late_morphs, {"mean": (3,)})
    skin = SparseRows.empty(n, columns.joints, {"weight": ()})
    embedding = None
    if program.reads_mesh:
        embedding = _embedding(program, chunks("EmbedStatic"), position_rule)
    else:
        bind = chunks("BindStatic")
        correctives = bind.sparse("corrective", CORRECTIVE, {"mean": (3,)}, columns.features)
        late = bind.sparse("late", LATE, {"mean": (3,)}, columns.late_morphs)
        skin = bind.sparse("skin", SKIN, {"weight": ()}, columns.joints)
    normal = chunks("LightStatic", own.light).dense(LIT, "normal", 3) if own.light else None
    return LevelArrays(
        Gaussians(mean, log_scale, quat, opacity, sh),
        Blendshapes(geometry, appearance, correctives, late),
        skin,
        embedding,
        normal,
    )


def _embedding(program: Program, embed: _Chunks, position_rule: str) -> Embedding:
    reads = next(one for one in program.passes() if "SurfaceStatic" in one.buffers)
    mesh = Source(
        program.buffers[reads.buffers["SurfaceStatic"]], program.constants_of(reads.buffers["SurfaceStatic"])
    )
    vertices = reads.count("vertices")
    triangles: U32 = mesh.section("corners").astype(np.uint32).reshape(3, -1).T.copy()
    ids = [np.zeros(0, np.uint32), *(source.section("triangle_ids") for source in embed.sources)]
    along = position_rule in NORMAL_POSITIONS
    return Embedding(
        canonical_vertices=dense_values([mesh], "canonical", "linear", [vertices], 3),
        triangles=triangles,
        triangle=np.concatenate(ids).astype(np.uint32),
        barycentric=embed.dense(EMBEDDED, "barycentric", 3),
        displacement=embed.dense(EMBEDDED, "displacement", 1)[:, 0] if along else np.zeros(0, np.float32),
        local_offset=np.zeros((0, 3), np.float32) if along else embed.dense(EMBEDDED, "local_offset", 3),
        local_quat_wxyz=embed.dense(EMBEDDED, "local_quat", 4),
    )


def read_mesh(program: Program, columns: Columns) -> MeshArrays:
    """The mesh of the rig, for a program of an avatar that has one."""

    def chunks(entry: str, kind: str) -> _Chunks:
        return _Chunks(program, kind, [one for one in program.mesh if one.entry == entry])

    morph, skin = chunks("morph", "MorphStatic"), chunks("skin", "SkinStatic")
    late = SparseRows.empty(sum(morph.rows), columns.late_morphs, {"position": (3,)})
    weights = SparseRows.empty(sum(morph.rows), columns.joints, {"weight": ()})
    if skin.rows:  # without joints nothing does
        late = skin.sparse("late", VERTEX_LATE, {"position": (3,)}, columns.late_morphs)
        weights = skin.sparse("skin", SKIN, {"weight": ()}, columns.joints)
    return MeshArrays(
        dense_values(morph.sources, "template_position", "linear", morph.rows, 3),
        morph.sparse("morph", MORPH, {"position": (3,)}, columns.expressions),
        morph.sparse("corrective", VERTEX_CORRECTIVE, {"position": (3,)}, columns.features),
        late,
        weights,
    )
