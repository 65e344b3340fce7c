"""The rig of an .fbx: its skinned meshes joined, in right-handed Y-up metres, facing +Z.

Mesh space is the world in which the skin was bound, where every skin matrix is the identity. Joints keep the axes
they have in the file; the file's unit goes into positions, not into a scale of joints.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from avatar_export.formats.fbx.file import FbxFile, FbxMesh
from avatar_export.formats.gltf.skeleton import MAX_CONDITION, MAX_JOINTS
from avatar_export.notes.note import Note, fact
from avatar_export.rigs.gltf_rig import MOST_MORPHS
from avatar_export.rigs.rig_arrays import by_row, unit_weights
from avatar_export.sparse import no_shifts
from avatar_runtime.avatar import F64, I32, I64, Rig, SparseRows
from avatar_runtime.io.errors import AvatarError

# Largest difference between the bind poses of two meshes on one skeleton: metres, and relative entries of the 3x3.
BIND_TOLERANCE = 1e-4
MORPH_NOISE = 1e-6  # metres; smaller offsets are rounding, 4e-8 m in real files (float32 of a centimetre)


@dataclass(frozen=True)
class FbxRig:
    """The result of `fbx_rig`."""

    rig: Rig  # without correctives, late morphs, joint basis and anchors
    morph_names: tuple[str, ...]  # [K] columns of rig.morphs
    notes: tuple[Note, ...]


def fbx_rig(file: FbxFile) -> FbxRig:
    """All skinned meshes of `file` as one rig; its joints are the bones of the skins.

    Vertices keep their order in the file, mesh after mesh (control points, which have no seams); blend shapes of one
    name on several meshes become one. Weights are divided by their sum. Raises AvatarError without a skinned
    mesh, for meshes bound in different poses, a vertex without weight, and invalid names.
    """
    meshes = [mesh for mesh in file.meshes if len(mesh.triangles) and mesh.clusters]
    if not meshes:
        raise AvatarError("has no skinned mesh", file=file.name, field="meshes")
    rest = _rest(file, meshes)
    joints = [node for node in _parents_first(file.parents) if node in rest]
    names = _checked_names(file, "joint", (file.nodes[joint] for joint in joints), MAX_JOINTS)
    world = file.in_metres(np.stack([rest[joint] for joint in joints]))
    with np.errstate(all="ignore"):
        sound = np.linalg.cond(world[:, :3, :3]) < MAX_CONDITION
    if not sound.all():
        raise AvatarError(
            "has a singular bind transform", file=file.name, field=f"joint {names[int(np.argmin(sound))]}"
        )
    parents = _joint_parents(file.parents, joints)
    morph_names = _checked_names(
        file, "blend shape", dict.fromkeys(s.name for m in meshes for s in m.shapes), MOST_MORPHS
    )
    vertices, triangles = _surface(file, meshes)
    skin, renormalised = _skin(file, meshes, {node: i for i, node in enumerate(joints)}, names)
    v, k = len(vertices), len(morph_names)
    local = np.stack(
        [w if p < 0 else np.linalg.solve(world[p], w) for w, p in zip(world, parents, strict=True)]
    )
    rig = Rig(
        vertices=vertices.astype(np.float32),
        triangles=triangles.astype(np.uint32),
        morphs=_morphs(file, meshes, morph_names, v),
        correctives=no_shifts(v),
        late_morphs=no_shifts(v),
        skin=skin,
        joint_names=names,
        parents=parents,
        rest_local=local.astype(np.float32),
        inverse_bind_matrix=np.linalg.inv(world).astype(np.float32),
        joint_basis=np.zeros((k, len(joints), 3), np.float32),
        corrective_joints=np.zeros(0, np.int32),
        anchor_vertices=np.zeros(0, np.uint32),
    )
    return FbxRig(rig, morph_names, tuple(_notes(file, meshes, renormalised)))


def _bind(mesh: FbxMesh) -> F64:
    """World from geometry [4, 4] when the mesh was bound, by the bone with the most weight."""
    heaviest = max(mesh.clusters, key=lambda cluster: float(cluster.weights.sum()))
    result: F64 = heaviest.bind_to_world @ heaviest.geometry_to_bone
    return result


def _rest(file: FbxFile, meshes: list[FbxMesh]) -> dict[int, F64]:
    """node -> world from bone [4, 4] when bound, for every bone of a skin."""
    rest: dict[int, F64] = {}
    for mesh in meshes:
        bind = _bind(mesh)
        for cluster in mesh.clusters:
            where = f"joint {file.nodes[cluster.bone]!a}"
            with np.errstate(all="ignore"):
                if not np.linalg.cond(cluster.geometry_to_bone[:3, :3]) < MAX_CONDITION:
                    raise AvatarError("has a singular bind matrix", file=file.name, field=where)
            bone = bind @ np.linalg.inv(cluster.geometry_to_bone)
            off = file.in_metres(bone - rest.setdefault(cluster.bone, bone))
            off[:3, :3] /= np.abs(bone[:3, :3]).max()
            if not (np.abs(off) <= BIND_TOLERANCE).all():
                raise AvatarError(
                    f"is bound in two poses ({np.abs(off).max():.3g} apart), the second by mesh {mesh.name[:60]!a}; "
                    "bind all meshes in the same pose, or join them",
                    file=file.name,
                    field=where,
                )
    return rest


def _parents_first(parents: I64) -> I64:
    """Nodes sorted by depth; those of equal depth in file order."""
    depth, above = np.zeros(len(parents), np.int64), parents.copy()
    while (above >= 0).any():
        depth += above >= 0
        above = np.where(above >= 0, parents[above], -1)
    result: I64 = np.argsort(depth, kind="stable")
    return result


def _joint_parents(parents: I64, joints: list[int]) -> I32:
    """The nearest joint above each joint, -1 for a root."""
    index = {node: i for i, node in enumerate(joints)}
    result = np.full(len(joints), -1, np.int32)
    for joint, i in index.items():
        above = int(parents[joint])
        while above >= 0 and above not in index:
            above = int(parents[above])
        result[i] = index.get(above, -1)
    return result


def _checked_names(file: FbxFile, what: str, names: Iterable[str], most: int) -> tuple[str, ...]:
    seen: dict[str, None] = {}
    for name in names:
        if not name or not name.isprintable() or name in seen or len(seen) == most:
            raise AvatarError(
                f"{name[:60]!a} is not a valid name of a {what}, a duplicate, or beyond the limit of {most}",
                file=file.name,
            )
        seen[name] = None
    return tuple(seen)


def _surface(file: FbxFile, meshes: list[FbxMesh]) -> tuple[F64, I64]:
    """(vertices [V, 3] in metres, triangles [F, 3]) of all meshes."""
    vertices, triangles, first = [], [], 0
    for mesh in meshes:
        bind = file.in_metres(_bind(mesh))
        vertices.append(file.unit * (mesh.vertices @ bind[:3, :3].T) + bind[:3, 3])
        triangles.append(mesh.triangles + first)
        first += len(mesh.vertices)
    return np.concatenate(vertices), np.concatenate(triangles)


def _skin(
    file: FbxFile, meshes: list[FbxMesh], index: dict[int, int], names: tuple[str, ...]
) -> tuple[SparseRows, int]:
    rows, columns, weights, first = [], [], [], 0
    for mesh in meshes:
        for cluster in mesh.clusters:
            if (cluster.weights < 0).any():
                raise AvatarError(
                    "has a negative weight", file=file.name, field=f"joint {names[index[cluster.bone]]}"
                )
            rows.append(first + cluster.vertices)
            columns.append(np.full(len(cluster.vertices), index[cluster.bone]))
            weights.append(cluster.weights)
        first += len(mesh.vertices)
    skin, total, off = unit_weights(
        np.concatenate(rows), np.concatenate(columns), np.concatenate(weights), first, len(names)
    )
    if not (total > 0).all():
        raise AvatarError(f"vertex {int(np.argmin(total > 0))} has no joint", file=file.name, field="skin")
    return skin, off


def _morphs(file: FbxFile, meshes: list[FbxMesh], names: tuple[str, ...], vertices: int) -> SparseRows:
    """The offsets larger than MORPH_NOISE, as rows by vertex."""
    column = {name: i for i, name in enumerate(names)}
    rows, columns, values, first = [np.zeros(0, int)], [np.zeros(0, int)], [np.zeros((0, 3))], 0
    for mesh in meshes:
        linear = file.unit * file.in_metres(_bind(mesh))[:3, :3]
        for shape in mesh.shapes:
            offsets = shape.offsets @ linear.T
            moved = np.flatnonzero((np.abs(offsets) > MORPH_NOISE).any(axis=1))
            rows.append(first + shape.vertices[moved])
            columns.append(np.full(len(moved), column[shape.name]))
            values.append(offsets[moved])
        first += len(mesh.vertices)
    row, at = np.concatenate(rows), np.concatenate(columns)
    if len(np.unique(row * max(len(names), 1) + at)) != len(row):
        raise AvatarError("moves a vertex twice", file=file.name, field="blend shapes")
    return by_row(row, at, {"position": np.concatenate(values).astype(np.float32)}, vertices, len(names))


def _notes(file: FbxFile, meshes: list[FbxMesh], renormalised: int) -> Iterable[Note]:
    polygons, between = sum(mesh.polygons for mesh in meshes), sum(mesh.between for mesh in meshes)
    if len(meshes) > 1:
        yield fact("meshes_joined", file=file.name, meshes=[mesh.name[:40] for mesh in meshes])
    if polygons:
        yield fact("polygons_cut", count=polygons, file=file.name)
    if between:
        yield fact("between_left_out", count=between)
    if not all(mesh.linear for mesh in meshes):
        yield fact("dual_quaternions")
    if renormalised:
        yield fact("weights_renormalised", count=renormalised)
