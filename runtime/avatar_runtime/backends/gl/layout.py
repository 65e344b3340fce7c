"""How an avatar is laid out in GPU buffers: packed buffers of 32-bit words, in chunks within the binding limit.

A packed buffer is one static buffer with sections at word offsets. "Planes" of n rows hold plane p of row i at
element p * n + i. Sparse rows are a pointer section (row i owns the entries ptr[i]:ptr[i + 1], counted from the
chunk's first) and records of one width: the column, then the values.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, U32, Avatar, Rig, SparseRows
from avatar_runtime.backends.gl.gpu import MOST_ROWS, too_large
from avatar_runtime.stages.surface import Surface

WORD = 4  # bytes
SPLAT_PLANES, PROJECTED_PLANES, TRIANGLE_PLANES = 5, 3, 2  # of float4
MESH_PLANES, RIGGED_MESH_PLANES = 3, 5  # the latter for rules.RIGGED_ROTATIONS
FLOAT4, PAIR, QUAD = 16, 8, 48  # bytes of a float4, of (key, id), of one drawn instance
BASE_PLANES = 11  # mean, log_scale, quat_wxyz, opacity_logit; then 3 K of sh

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class PackedBuffer:
    """One static buffer."""

    words: U32  # [W]
    offsets: Mapping[str, int]  # section -> its first word


@dataclass(frozen=True)
class Run:
    """Rows first..first + count of an avatar's Gaussians or vertices."""

    first: int
    count: int


@dataclass(frozen=True)
class Cost:
    """Bytes of one buffer over a run: `fixed` + `row` a row + bytes an entry of each sparse part."""

    row: int
    fixed: int = 0
    entries: tuple[tuple[U32, int], ...] = ()  # (row_ptr of all rows, bytes an entry)

    def up_to(self, rows: int) -> npt.NDArray[np.int64]:
        """[rows + 1] bytes that the rows before each row take, without `fixed`."""
        total = self.row * np.arange(rows + 1, dtype=np.int64)
        for row_ptr, size in self.entries:
            total = total + size * row_ptr.astype(np.int64)
        return total


def runs(what: str, rows: int, costs: Sequence[Cost], limit: int) -> tuple[Run, ...]:
    """The fewest runs of `rows` rows in which no buffer of `costs` is larger than `limit` bytes.

    Raises AvatarError if one row alone is larger.
    """
    sizes = [(cost.up_to(rows), cost.fixed) for cost in costs]
    found: list[Run] = []
    first = 0
    while first < rows:
        ends = [int(np.searchsorted(upto, upto[first] + limit - fixed, "right")) - 1 for upto, fixed in sizes]
        end = min(*ends, first + MOST_ROWS)
        if end <= first:
            need = max(int(upto[first + 1] - upto[first]) + fixed for upto, fixed in sizes)
            raise too_large(f"{what} {first}", need, limit)
        found.append(Run(first, end - first))
        first = end
    return tuple(found)


def gaussian_runs(avatar: Avatar, limit: int) -> tuple[Run, ...]:
    """Chunks of Gaussians, in which every buffer with one row per Gaussian is within `limit`."""
    shapes, sh = avatar.blendshapes, 3 * avatar.gaussians.sh.shape[1]
    blend = Cost(
        WORD * (BASE_PLANES + sh + 2),
        2 * WORD,
        ((shapes.geometry.row_ptr, 8 * WORD), (shapes.appearance.row_ptr, (5 + sh) * WORD)),
    )
    bind = Cost(
        WORD * 3,
        3 * WORD,
        (
            (shapes.correctives.row_ptr, 4 * WORD),
            (shapes.late_morphs.row_ptr, 4 * WORD),
            (avatar.skin.row_ptr, 2 * WORD),
        ),
    )
    embed = Cost(WORD * 15)
    costs = [Cost(FLOAT4 * SPLAT_PLANES), Cost(WORD * sh), Cost(FLOAT4 * PROJECTED_PLANES), blend]
    costs.append(bind if avatar.embedding is None else embed)
    return runs("Gaussian", avatar.gaussians.count, costs, limit)


def vertex_runs(rig: Rig, limit: int) -> tuple[Run, ...]:
    """Chunks of vertices, for what morph and skin read."""
    morph = Cost(
        WORD * 5,
        2 * WORD,
        ((rig.morphs.row_ptr, 4 * WORD), (rig.correctives.row_ptr, 4 * WORD)),
    )
    skin = Cost(WORD * 2, 2 * WORD, ((rig.late_morphs.row_ptr, 4 * WORD), (rig.skin.row_ptr, 2 * WORD)))
    return runs("vertex", len(rig.vertices), (morph, skin), limit)


def pack(sections: Mapping[str, Array]) -> PackedBuffer:
    """`sections` one after the other; float32 by its bits."""
    offsets: dict[str, int] = {}
    parts: list[U32] = []
    at = 0
    for name, values in sections.items():
        part = words(values)
        offsets[name] = at
        parts.append(part)
        at += len(part)
    return PackedBuffer(np.concatenate(parts), offsets)


def words(values: Array) -> U32:
    """Flat 32-bit words of float32 or of integers."""
    if values.dtype.kind == "f":
        return np.ascontiguousarray(values, np.float32).view(np.uint32).reshape(-1)
    return np.ascontiguousarray(values, np.uint32).reshape(-1)


def pack_blend(avatar: Avatar, run: Run) -> PackedBuffer:
    """BlendStatic of one chunk."""
    g, rows = avatar.gaussians, slice(run.first, run.first + run.count)
    n = run.count
    base = planes(
        [
            g.mean[rows],
            g.log_scale[rows],
            g.quat_wxyz[rows],
            g.opacity_logit[rows, None],
            g.sh[rows].reshape(n, -1),
        ]
    )
    shapes = avatar.blendshapes
    return pack(
        {
            "base_plane": base,
            **sparse("geometry", shapes.geometry, ("mean", "quat_wxyz"), run),
            **sparse("appearance", shapes.appearance, ("log_scale", "opacity_logit", "sh"), run),
        }
    )


def pack_bind(avatar: Avatar, run: Run) -> PackedBuffer:
    """BindStatic of one chunk of an avatar whose Gaussians follow joints."""
    shapes = avatar.blendshapes
    return pack(
        {
            **sparse("corrective", shapes.correctives, ("mean",), run),
            **sparse("late", shapes.late_morphs, ("mean",), run),
            **sparse("skin", avatar.skin, ("weight",), run),
        }
    )


def pack_embedded(surface: Surface, run: Run) -> PackedBuffer:
    """EmbedStatic of one chunk of Gaussians on a mesh; the rule has either displacement or local_offset."""
    e, rows = surface.embedding, slice(run.first, run.first + run.count)
    return pack(
        {
            "triangle_ids": e.triangle[rows],
            "vertex_ids": planes([e.vertex_ids[rows]]),
            "barycentric": planes([e.barycentric[rows]]),
            "displacement": e.displacement[rows],
            "local_offset": planes([e.local_offset[rows]]),
            "local_quat": planes([e.local_quat_wxyz[rows]]),
            "canonical_size": surface.canonical.size[e.triangle[rows]].astype(np.float32),
        }
    )


def pack_surface(surface: Surface, skin: SparseRows) -> PackedBuffer:
    """SurfaceStatic, of the whole mesh; `skin` [V rows], or no rows if the rotation rule reads none."""
    triangles = surface.embedding.triangles
    return pack(
        {
            "triangle_plane": planes([triangles]),
            "canonical_frame": planes(
                [surface.canonical.frame.astype(np.float32).reshape(len(triangles), 9)]
            ),
            "canonical_size": surface.canonical.size.astype(np.float32),
            "vertex_triangle_ptr": surface.vertex_triangle_ptr,
            "vertex_triangle": surface.vertex_triangle,
            **sparse("skin", skin, ("weight",), Run(0, skin.rows)),
        }
    )


def pack_morph(rig: Rig, run: Run) -> PackedBuffer:
    """MorphStatic of one chunk of vertices."""
    return pack(
        {
            "template_plane": planes([rig.vertices[run.first : run.first + run.count]]),
            **sparse("morph", rig.morphs, ("position",), run),
            **sparse("corrective", rig.correctives, ("position",), run),
        }
    )


def pack_skin(rig: Rig, run: Run) -> PackedBuffer:
    """SkinStatic of one chunk of vertices."""
    return pack(
        {
            **sparse("late", rig.late_morphs, ("position",), run),
            **sparse("skin", rig.skin, ("weight",), run),
        }
    )


def planes(parts: Iterable[Array]) -> Array:
    """[P, n] from parts [n, p] of one type."""
    return np.ascontiguousarray(np.concatenate(list(parts), axis=1).T)


def sparse(name: str, rows: SparseRows, attributes: Sequence[str], run: Run) -> dict[str, U32]:
    """Sections NAME_ptr [n + 1] and NAME_entry [E, 1 + values] of a run of rows."""
    ptr = rows.row_ptr[run.first : run.first + run.count + 1]
    entries = slice(int(ptr[0]), int(ptr[-1]))
    count = entries.stop - entries.start
    columns: list[Array] = [rows.column[entries].astype(np.uint32)[:, None]]
    for attribute in attributes:
        columns.append(words(rows.values[attribute][entries]).reshape(count, -1 if count else 0))
    return {f"{name}_ptr": ptr - ptr[0], f"{name}_entry": np.concatenate(columns, axis=1)}


def pose_sections(
    expression_weights: F32, pose_feature: F32, late_weights: F32, skin_matrix: F32
) -> dict[str, Array]:
    """Pose: what changes from frame to frame; joints as 3 rows of 4."""
    return {
        "weights": expression_weights,
        "features": pose_feature,
        "late": late_weights,
        "joints": skin_matrix[:, :3],
    }
