"""An avatar as the arrays that the kernels take.

A kernel does not check indices, so this module checks every list of indices once.
"""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32, U16, U32, Avatar, Gaussians, Rig, SparseRows
from avatar_runtime.backends.cpu.arrays import (
    BLOCK,
    U64,
    Array,
    Base,
    Blendable,
    Blocks,
    Deltas,
    Embedded,
    Influences,
    Mesh,
    Offsets,
    Out,
    PosedArrays,
    PosedMesh,
    RigArrays,
    Sizes,
    read_only,
)
from avatar_runtime.rotation import quat_from_matrix
from avatar_runtime.rules import NORMAL_POSITIONS
from avatar_runtime.stages.surface import Surface

# The arguments of `posed_arrays`, named as in the conformance kit.
FRAME = (
    *("expression_weights", "pose_feature", "late_weights", "skin_matrix"),
    *("group_matrix", "group_rotation", "world_from_avatar"),
)


def column_mask(row_ptr: U32, column: U16, columns: int) -> U64:
    """[R, ceil(columns / 64)] for each row a bit for each of its columns."""
    mask = np.zeros((len(row_ptr) - 1, -(-columns // 64)), np.uint64)
    row = np.repeat(np.arange(len(mask)), (row_ptr[1:] - row_ptr[:-1]).astype(np.int64))
    for word in range(mask.shape[1]):
        here = column // 64 == word
        bits = np.left_shift(np.uint64(1), (column[here] % 64).astype(np.uint64))
        np.bitwise_or.at(mask[:, word], row[here], bits)
    return mask


@np.errstate(all="ignore")  # values that overflow become infinite and are not drawn
def posed_arrays(
    sizes: Sizes,
    expression_weights: Array | None = None,
    pose_feature: Array | None = None,
    late_weights: Array | None = None,
    skin_matrix: Array | None = None,  # [J, 4, 4]
    group_matrix: Array | None = None,  # [G, 3, 4]
    group_rotation: Array | None = None,  # [G, 3, 3]
    world_from_avatar: Array | None = None,  # [4, 4]
) -> PosedArrays:
    """A frame's small arrays; arrays that a stage does not read may be missing.

    Raises ValueError if one has another shape than the avatar needs.
    """

    def given(array: Array | None, *shape: int) -> Array:
        flat = (shape[0], int(np.prod(shape[1:]))) if len(shape) > 2 else shape
        if array is None:
            return read_only(np.zeros(flat), np.float32, flat)
        return read_only(read_only(array, np.float32, shape).reshape(flat), np.float32, flat)

    weights = given(expression_weights, sizes.expressions)
    active = np.flatnonzero(weights).astype(np.uint16)
    mask = column_mask(np.array([0, len(active)], np.uint32), active, len(weights))[0]
    world = (
        np.eye(4, dtype=np.float32)
        if world_from_avatar is None
        else read_only(world_from_avatar, np.float32, (4, 4))
    )
    return PosedArrays(
        weights,
        read_only(mask, np.uint64, mask.shape),
        given(pose_feature, sizes.features),
        given(late_weights, sizes.late),
        given(skin_matrix, sizes.joints, 4, 4),
        given(group_matrix, sizes.groups, 3, 4),
        given(group_rotation, sizes.groups, 3, 3),
        read_only(world[:3].reshape(12), np.float32, (12,)),
        read_only(quat_from_matrix(world[:3, :3]), np.float32, (4,)),
    )


def blendable(avatar: Avatar) -> Blendable:
    """The avatar's Gaussians and their blendshapes.

    Raises ValueError for an index out of range; so do all functions below.
    """
    shapes, sizes = avatar.blendshapes, (avatar.gaussians.count, len(avatar.expressions))
    geometry = deltas(shapes.geometry, ("mean", "quat_wxyz"), *sizes)
    vectors = np.pad(geometry.values, ((0, 0), (0, 1)))
    geometry = geometry._replace(values=read_only(vectors, np.float32, vectors.shape))
    shape = deltas(shapes.appearance, ("log_scale", "opacity_logit"), *sizes)
    colour = deltas(shapes.appearance, ("sh",), *sizes)
    return Blendable(base(avatar.gaussians), geometry, shape, colour)


def base(g: Gaussians) -> Base:
    """The Gaussians before any blendshape."""
    n = g.count
    return Base(
        read_only(g.mean, np.float32, (n, 3)),
        read_only(g.log_scale, np.float32, (n, 3)),
        read_only(g.quat_wxyz, np.float32, (n, 4)),
        read_only(g.opacity_logit, np.float32, (n,)),
        read_only(g.sh.reshape(n, 3 * g.sh.shape[1]), np.float32, (n, 3 * g.sh.shape[1])),
    )


def deltas(sparse: SparseRows, attributes: tuple[str, ...], rows: int, columns: int) -> Deltas:
    """The entries in which any of `attributes` is not 0.

    A copy: the system uses large pages for NumPy's large arrays, where scattered reads are twice as fast as in the
    memory of a file.
    """
    ptr, column = _pattern(sparse, rows, columns)
    parts = [sparse.values[name].reshape(len(column), -1) for name in attributes] if len(column) else []
    widths = [int(np.prod(sparse.values[name].shape[1:])) for name in attributes]
    values = (
        np.concatenate(parts, axis=1, dtype=np.float32) if parts else np.zeros((0, sum(widths)), np.float32)
    )
    used = (values != 0).any(axis=1)
    if not used.all():
        ptr = np.concatenate([[0], np.cumsum(used)])[ptr].astype(np.uint32)
        column, values = column[used], values[used]
    mask = column_mask(ptr, column, columns)
    return Deltas(
        read_only(ptr, np.uint32, (rows + 1,)),
        read_only(column, np.uint16, (len(column),)),
        read_only(mask, np.uint64, mask.shape),
        read_only(values, np.float32, (len(column), sum(widths))),
        most_entries(ptr),
    )


def offsets(sparse: SparseRows, attribute: str, rows: int, columns: int) -> Offsets:
    """Blendshapes.correctives, late_morphs, and the same of a rig."""
    return Offsets(*_pattern(sparse, rows, columns), _values(sparse, attribute, 3))


def influences(sparse: SparseRows, rows: int, joints: int) -> Influences:
    """Skin weights."""
    return Influences(*_pattern(sparse, rows, joints), _values(sparse, "weight", 1).reshape(-1))


def blocks(avatar: Avatar) -> Blocks:
    """The avatar's groups in blocks, in order."""
    groups, rules, rows = avatar.groups, avatar.rules, avatar.gaussians.count
    ends = [0, *(group.first + group.count for group in groups)]
    if ends[-1] != rows or any(
        g.first != end or g.count < 0 for g, end in zip(groups, ends[:-1], strict=True)
    ):
        raise ValueError(f"the groups do not follow one another over the {rows} Gaussians")
    cuts = [
        (at, min(BLOCK, group.first + group.count - at), index)
        for index, group in enumerate(groups)
        for at in range(group.first, group.first + group.count, BLOCK)
    ]
    first, count, group = np.array(cuts, np.int32).reshape(-1, 3).T
    by_row = np.array([group.binding == "skin" for group in groups], np.uint8)
    by_polar = by_row * np.uint8(rules.rotation == "polar3")
    return Blocks(
        read_only(first, np.int32),
        read_only(count, np.int32),
        read_only(group, np.int32),
        read_only(by_row, np.uint8),
        read_only(by_polar, np.uint8),
        rules.sh_direction == "world",
    )


def most_entries(row_ptr: U32) -> int:
    """The most entries of BLOCK rows one after another."""
    end = np.append(row_ptr[BLOCK:], np.full(BLOCK, row_ptr[-1]))[: len(row_ptr)]
    return int((end - row_ptr).max())


def embedded(avatar: Avatar) -> Embedded:
    """The avatar's embedding."""
    e, n = avatar.embedding, avatar.gaussians.count
    assert e is not None
    by_normal = avatar.rules.position in NORMAL_POSITIONS
    _below("triangle", e.triangle, len(e.triangles))
    return Embedded(
        read_only(e.triangle, np.uint32, (n,)),
        read_only(e.vertex_ids, np.uint32, (n, 3)),
        read_only(e.barycentric, np.float32, (n, 3)),
        read_only(e.displacement, np.float32, (n if by_normal else 0,)),
        read_only(e.local_offset, np.float32, (0 if by_normal else n, 3)),
        read_only(e.local_quat_wxyz, np.float32, (n, 4)),
    )


def mesh(surface: Surface) -> Mesh:
    """The result of `stages.surface.prepare` for the canonical mesh."""
    triangles, vertices = surface.embedding.triangles, len(surface.embedding.canonical_vertices)
    f = len(triangles)
    _below("triangles", triangles, vertices)
    return Mesh(
        read_only(triangles, np.uint32, (f, 3)),
        read_only(surface.canonical.frame.reshape(f, 9), np.float64, (f, 9)),
        read_only(surface.canonical.size, np.float64, (f,)),
        read_only(surface.vertex_triangle_ptr, np.uint32, (vertices + 1,)),
        read_only(surface.vertex_triangle, np.uint32, (3 * f,)),
    )


def rig_arrays(rig: Rig, sizes: Sizes) -> RigArrays:
    """The rig's mesh."""
    v = len(rig.vertices)
    return RigArrays(
        read_only(rig.vertices, np.float32, (v, 3)),
        offsets(rig.morphs, "position", v, sizes.expressions),
        offsets(rig.correctives, "position", v, sizes.features),
        offsets(rig.late_morphs, "position", v, sizes.late),
        influences(rig.skin, v, sizes.joints),
    )


def fresh_posed_mesh(mesh: Mesh, *, by_joints: bool = False) -> PosedMesh:
    """Room for one posed mesh; `by_joints` for rules.RIGGED_ROTATIONS."""
    f, v = len(mesh.triangles), len(mesh.vertex_triangle_ptr) - 1
    matrix = np.zeros((v if by_joints else 0, 9), np.float32)
    return PosedMesh(np.zeros(f), np.zeros((f, 13)), np.zeros((v, 7)), matrix)


def fresh_out(rows: int, width: int) -> Out:
    """Room for `rows` splats of `width` SH values."""

    def room(*shape: int) -> F32:
        return np.empty(shape, np.float32)

    return Out(
        mean=room(rows, 3),
        scale=room(rows, 3),
        quat_wxyz=room(rows, 4),
        opacity=room(rows),
        sh=room(rows, width),
        sh_rotation=room(rows, 9),
        touched=np.ones((rows, 2), np.uint8),
    )


def _pattern(sparse: SparseRows, rows: int, columns: int) -> tuple[U32, U16]:
    ptr = read_only(sparse.row_ptr, np.uint32, (rows + 1,))
    column = read_only(sparse.column, np.uint16, (sparse.entries,))
    if ptr[0] != 0 or int(ptr[-1]) != len(column) or (ptr[1:] < ptr[:-1]).any():
        raise ValueError(f"row_ptr does not rise from 0 to the {len(column)} entries")
    _below("column", column, columns)
    return ptr, column


def _values(sparse: SparseRows, attribute: str, width: int) -> F32:
    values = sparse.values[attribute]
    return read_only(
        values.reshape(sparse.entries, -1) if sparse.entries else np.zeros((0, width)),
        np.float32,
        (sparse.entries, width),
    )


def _below(name: str, indices: Array, end: int) -> None:
    if indices.size and int(indices.max()) >= end:
        raise ValueError(f"{name} holds {int(indices.max())}, but there are {end}")
