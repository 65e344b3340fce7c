"""The rig of a glTF file: its skinned mesh (or meshes, joined), morph targets and joints, as a `Rig`.

Vertices keep their order in the file (other files refer to them by row). The binding pose is the mesh as
stored, the pose in which every skin matrix is the identity. If the nodes of the file have another pose, rest
transforms come from the inverse bind matrices, and `node_pose` leads back to the pose of the nodes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.formats.gltf.skeleton import read_skeleton
from avatar_export.formats.gltf.vertex_ids import vertex_ids
from avatar_export.rigs.rig_arrays import by_row, unit_weights
from avatar_export.sparse import no_shifts
from avatar_runtime.avatar import F32, F64, U32, Rig, SparseRows
from avatar_runtime.codec.glb import Glb, accessor, short

TRIANGLES = 4
MAX_TARGETS = 65536  # numbered in 16 bits
MAX_INFLUENCE_SETS = 8  # JOINTS_0 .. JOINTS_7

I64 = npt.NDArray[np.int64]
Object = Mapping[str, Any]
MOST_MORPHS = 4096  # limits memory (times joints) and work (times vertices)


@dataclass(frozen=True)
class GltfRig:
    """The result of `read_rig`."""

    rig: Rig  # without correctives, late morphs, joint basis and anchors; mesh space of the file
    morph_names: tuple[str, ...]  # [K] columns of rig.morphs
    rest_deviation: float  # largest |entry| of node_global @ inverse_bind_matrix - I over the joints
    # Joint -> delta; empty: the nodes have the binding pose.
    node_pose: Mapping[str, F64] = field(default_factory=dict)
    renormalised: int = 0  # number of vertices whose weights did not add up to 1
    # [V], only if joined: row of each vertex in the mesh that the file was made from.
    vertex_ids: I64 | None = None


@dataclass(frozen=True)
class _Part:
    """Primitives that share their vertices."""

    where: str
    primitive: Object  # whose attributes and targets are used
    indices: list[tuple[str, Object]]  # (where, primitive) for the triangles of each
    morph_names: tuple[str, ...]


def read_rig(glb: Glb, *, join: bool = False) -> GltfRig:
    """The rig of the file's only skinned mesh; with `join`, of all meshes and primitives on its skin, in order.

    Weights follow glTF 2.0, 3.7.3.1: they add up to 1; a vertex whose weights do not is divided by their sum
    and counted, one without any weight is refused. Zero weights are dropped, the weights of one joint in
    several sets added. Node transforms above the skeleton (an armature's scale) are baked into the root
    joints' rest_local; the mesh node's own transform is ignored, as glTF requires. Joined, morph targets of one
    name become one, and primitives on the same vertices keep them once.
    Raises AvatarError for anything but one skinned mesh with one triangle primitive (`join`: for meshes on
    several skins), and for damaged data.
    """
    meshes, skin_index = _skinned_meshes(glb, join)
    parts = [part for mesh in meshes for part in _parts(glb, mesh, join)]
    names = tuple(dict.fromkeys(name for part in parts for name in part.morph_names))
    if len(names) > MOST_MORPHS:
        glb.fail(parts[0].where, f"has {len(names)} morph targets; at most {MOST_MORPHS} are supported")
    attributes = [_object(glb, p.primitive.get("attributes"), f"{p.where}.attributes") for p in parts]
    blocks = [_vectors(glb, a, f"{p.where}.attributes") for p, a in zip(parts, attributes, strict=True)]
    first = np.concatenate([[0], np.cumsum([len(block) for block in blocks])])
    v = int(first[-1])
    morphs = _morphs(glb, parts, names, first)
    skeleton = read_skeleton(glb, skin_index)
    skin, renormalised = _skin(glb, parts, attributes, skeleton.order, first)
    joints = len(skeleton.names)
    rig = Rig(
        vertices=np.concatenate(blocks),
        triangles=_triangles(glb, parts, first),
        morphs=morphs,
        correctives=no_shifts(v),
        late_morphs=no_shifts(v),
        skin=skin,
        joint_names=skeleton.names,
        parents=skeleton.parents,
        rest_local=skeleton.rest_local,
        inverse_bind_matrix=skeleton.inverse_bind_matrix,
        joint_basis=np.zeros((len(names), joints, 3), np.float32),
        corrective_joints=np.zeros(0, np.int32),
        anchor_vertices=np.zeros(0, np.uint32),
    )
    return GltfRig(
        rig,
        names,
        skeleton.deviation,
        skeleton.node_pose,
        renormalised,
        vertex_ids(glb, attributes, first) if join else None,
    )


def _skinned_meshes(glb: Glb, join: bool) -> tuple[list[object], object]:
    """(meshes, skin): indices of the only node that has both; with `join`, of all such nodes if they share the skin."""
    nodes = [node for node in glb.entries("nodes") if "mesh" in node and "skin" in node]
    alike = bool(nodes) and all(node["skin"] == nodes[0]["skin"] for node in nodes)
    if len(nodes) != 1 and not (join and alike):
        names = ", ".join(short(node.get("name", "unnamed")) for node in nodes[:4])
        if not nodes:
            glb.fail("nodes", "no node has a mesh and a skin; export the file with its skin")
        glb.fail(
            "nodes", f"{len(nodes)} nodes have a mesh and a skin ({names}), expected one; join the meshes"
        )
    meshes: list[object] = []
    for node in nodes:
        if node["mesh"] not in meshes:
            meshes.append(node["mesh"])
    return meshes, nodes[0]["skin"]


def _parts(glb: Glb, index: object, join: bool) -> list[_Part]:
    """The primitives of a mesh, grouped by shared vertices."""
    mesh = glb.entry("meshes", index)
    where = f"meshes[{index}].primitives"
    primitives = mesh.get("primitives")
    count = len(primitives) if isinstance(primitives, list) else 0
    if not isinstance(primitives, list) or not (count == 1 or (join and count)):
        glb.fail(where, f"has {count} primitives, expected one; join the materials of the mesh")
    parts: list[_Part] = []
    for number, entry in enumerate(primitives):
        here = f"{where}[{number}]"
        primitive = _checked_primitive(glb, entry, here)
        same = next((p for p in parts if _same_vertices(p.primitive, primitive)), None)
        if same is not None:
            same.indices.append((here, primitive))
        else:
            names = _morph_names(glb, mesh, primitive, here)
            parts.append(_Part(here, primitive, [(here, primitive)], names))
    return parts


def _same_vertices(a: Object, b: Object) -> bool:
    return (
        all(a.get(key) == b.get(key) for key in ("attributes", "targets"))
        and "indices" in a
        and "indices" in b
    )


def _checked_primitive(glb: Glb, entry: object, where: str) -> Object:
    primitive = _object(glb, entry, where)
    if primitive.get("mode", TRIANGLES) != TRIANGLES:
        glb.fail(f"{where}.mode", f"is {short(primitive['mode'])}, expected triangles ({TRIANGLES})")
    if primitive.get("extensions"):
        glb.fail(where, "has extensions, such as compression, that cannot be read; export without them")
    return primitive


def _object(glb: Glb, value: object, where: str) -> Object:
    if not isinstance(value, dict):
        glb.fail(where, "is missing or not an object")
    return value


def _attribute(glb: Glb, attributes: Object, name: str, where: str) -> npt.NDArray[Any]:
    if name not in attributes:
        glb.fail(f"{where}.{name}", "is missing")
    return accessor(glb, attributes[name])


def _vectors(glb: Glb, attributes: Object, where: str, count: int | None = None) -> F32:
    """Attribute POSITION as finite float32 [count, 3]."""
    values = _attribute(glb, attributes, "POSITION", where)
    where = f"{where}.POSITION"
    if values.ndim != 2 or values.shape[1] != 3 or (count is not None and len(values) != count):
        want = "[V, 3]" if count is None else f"[{count}, 3]"
        glb.fail(where, f"has shape {list(values.shape)}, expected {want}")
    result = np.ascontiguousarray(values, np.float32)
    finite = np.isfinite(result).all(axis=1)
    if not finite.all():
        glb.fail(f"{where}[{int(np.argmin(finite))}]", "is not finite")
    return result


def _triangles(glb: Glb, parts: list[_Part], first: I64) -> U32:
    """[F, 3] of all primitives; part i's vertices are rows first[i] : first[i + 1]."""
    found = [
        _corners(glb, primitive, int(last - begin), where) + np.uint32(begin)
        for part, begin, last in zip(parts, first, first[1:], strict=False)
        for where, primitive in part.indices
    ]
    return np.concatenate(found).reshape(-1, 3)


def _corners(glb: Glb, primitive: Object, vertices: int, where: str) -> U32:
    where = f"{where}.indices"
    if "indices" in primitive:
        indices = accessor(glb, primitive["indices"])
    else:
        indices = np.arange(vertices, dtype=np.uint32)
    if indices.ndim != 1 or indices.dtype.kind != "u" or len(indices) % 3:
        glb.fail(where, f"has {len(indices)} values of type {indices.dtype}, which are not triangles")
    if len(indices) and int(indices.max()) >= vertices:
        at = int(np.argmax(indices >= vertices))
        glb.fail(f"{where}[{at}]", f"is {int(indices[at])}, but there are {vertices} vertices")
    return indices.astype(np.uint32)


def _morph_names(glb: Glb, mesh: Object, primitive: Object, where: str) -> tuple[str, ...]:
    targets = primitive.get("targets", [])
    if not isinstance(targets, list) or len(targets) > MAX_TARGETS:
        glb.fail(f"{where}.targets", f"is not a list of up to {MAX_TARGETS} targets")
    extras = mesh.get("extras")
    names = extras.get("targetNames", []) if isinstance(extras, dict) else []
    if not isinstance(names, list) or len(names) != len(targets):
        count = len(names) if isinstance(names, list) else 0
        glb.fail("mesh.extras.targetNames", f"has {count} names for {len(targets)} morph targets")
    seen: set[str] = set()
    for index, name in enumerate(names):
        if not isinstance(name, str) or not name or not name.isprintable() or name in seen:
            glb.fail(f"mesh.extras.targetNames[{index}]", f"{short(name)} is not a name, or a duplicate")
        seen.add(name)
    return tuple(names)


def _morphs(glb: Glb, parts: list[_Part], names: tuple[str, ...], first: I64) -> SparseRows:
    """The non-zero position deltas of every target, as rows by vertex."""
    column = {name: i for i, name in enumerate(names)}
    rows: list[npt.NDArray[np.int64]] = [np.zeros(0, np.int64)]
    columns: list[npt.NDArray[np.int64]] = [np.zeros(0, np.int64)]
    values: list[F32] = [np.zeros((0, 3), np.float32)]
    total = 0
    for part, begin, last in zip(parts, first, first[1:], strict=False):
        for index, target in enumerate(part.primitive.get("targets", [])):
            where = f"{part.where}.targets[{index}]"
            target = _object(glb, target, where)
            if "POSITION" not in target:
                continue
            delta = _vectors(glb, target, where, int(last - begin))
            moved = np.flatnonzero(delta.any(axis=1))
            total += len(moved)
            # A stored delta takes three bytes or more; shared bytes must not allocate more than the file holds.
            if 3 * total > len(glb.binary):
                glb.fail(where, "shares its data with other targets; store each target separately")
            rows.append(moved + begin)
            columns.append(np.full(len(moved), column[part.morph_names[index]]))
            values.append(delta[moved])
    entries = {"position": np.concatenate(values)}
    return by_row(np.concatenate(rows), np.concatenate(columns), entries, int(first[-1]), len(names))


def _skin(
    glb: Glb, parts: list[_Part], attributes: list[Object], order: I64, first: I64
) -> tuple[SparseRows, int]:
    """(skin weights by vertex, number of vertices renormalised); the skin's joint i is column order[i]."""
    found = [
        _influences(glb, a, order, int(last - begin), f"{part.where}.attributes")
        for part, a, begin, last in zip(parts, attributes, first, first[1:], strict=False)
    ]
    rows, columns, weights = (np.concatenate(arrays) for arrays in zip(*found, strict=True))
    rows = rows + np.repeat(first[:-1], [len(row) for row, _, _ in found])
    skin, total, renormalised = unit_weights(rows, columns, weights, int(first[-1]), len(order))
    if not (total > 0).all():
        row = int(np.argmin(total > 0))
        at = int(np.searchsorted(first, row, side="right")) - 1
        glb.fail(f"{parts[at].where}.attributes.WEIGHTS_0[{row - first[at]}]", "the vertex has no weight")
    return skin, renormalised


def _influences(glb: Glb, attributes: Object, order: I64, vertices: int, where: str) -> tuple[I64, I64, F64]:
    """(vertex, joint, weight) of every non-zero weight; the skin's joint i is joint order[i]."""
    joint, weight = _influence_sets(glb, attributes, vertices, where)
    row, slot = np.nonzero(weight)
    used = joint[row, slot].astype(np.int64)
    if used.size and int(used.max()) >= len(order):
        at = int(np.argmax(used >= len(order)))
        glb.fail(
            f"{where}.JOINTS_{slot[at] // 4}[{row[at]}]",
            f"is {used[at]}, but the skin has {len(order)} joints",
        )
    return row, order[used], weight[row, slot]


def _influence_sets(glb: Glb, attributes: Object, vertices: int, where: str) -> tuple[npt.NDArray[Any], F64]:
    """(joints [V, 4 sets], weights [V, 4 sets])."""
    joints: list[npt.NDArray[Any]] = []
    weights: list[F64] = []
    while len(joints) <= MAX_INFLUENCE_SETS:
        names = (f"JOINTS_{len(joints)}", f"WEIGHTS_{len(joints)}")
        if joints and not any(name in attributes for name in names):
            break
        joint, weight = (_attribute(glb, attributes, name, where) for name in names)
        for name, values, kind in zip(names, (joint, weight), "uf", strict=True):
            if values.shape != (vertices, 4) or values.dtype.kind != kind:
                glb.fail(
                    f"{where}.{name}", f"is {values.dtype}{list(values.shape)}, expected [{vertices}, 4]"
                )
        bad = ~(np.isfinite(weight) & (weight >= 0)).all(axis=1)
        if bad.any():
            glb.fail(f"{where}.{names[1]}[{int(np.argmax(bad))}]", "is negative or not finite")
        joints.append(joint)
        weights.append(weight.astype(np.float64))
    return np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)
