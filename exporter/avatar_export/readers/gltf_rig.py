"""The rig of a glTF file: the one skinned mesh, its morph targets and its joints, as a `Rig`.

Vertices keep their order in the file (other files refer to them by row). The binding pose is the mesh as it
stands in the file, the pose in which every skin matrix is the identity: where the file's nodes stand in
another pose, rest transforms come from the inverse bind matrices and `node_pose` says how to get back.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.readers.gltf_skeleton import read_skeleton
from avatar_runtime.avatar import F32, F64, U32, Rig, SparseRows
from avatar_runtime.codec.glb import Glb, accessor, short

TRIANGLES = 4
MAX_TARGETS = 65536  # numbered in 16 bits
MAX_INFLUENCE_SETS = 8  # JOINTS_0 .. JOINTS_7
# Weights whose sum is within this of 1 are kept bit by bit: the rounding of float32 and of 8 or 16 bits.
WEIGHT_SUM_TOLERANCE = 1e-5

I64 = npt.NDArray[np.int64]
Object = Mapping[str, Any]
MOST_MORPHS = 4096  # times joints it is an array, times vertices the work


@dataclass(frozen=True)
class GltfRig:
    """What `read_rig` found."""

    rig: Rig  # without correctives, late morphs, joint basis and anchors; mesh space of the file
    morph_names: tuple[str, ...]  # [K] columns of rig.morphs
    rest_deviation: float  # largest |entry| of node_global @ inverse_bind_matrix - I over the joints
    node_pose: Mapping[str, F64] = field(
        default_factory=dict
    )  # joint -> delta; empty: the nodes stand in binding pose
    renormalised: int = 0  # vertices whose weights did not add up to 1


def read_rig(glb: Glb) -> GltfRig:
    """The rig of the file's single skinned mesh.

    Weights follow glTF 2.0, 3.7.3.1: they add up to 1; a vertex whose weights do not is divided by their sum
    and counted, one without any weight is refused. Zero weights are dropped, the weights of one joint in
    several sets added. Node transforms above the skeleton (an armature's scale) are baked into the root
    joints' rest_local; the mesh node's own transform does not count, as glTF demands.
    Raises AvatarError for anything but one skinned mesh with one triangle primitive, and for broken data.
    """
    mesh_index, skin_index = _skinned_mesh(glb)
    mesh = glb.entry("meshes", mesh_index)
    primitive = _primitive(glb, mesh, mesh_index)
    where = f"meshes[{mesh_index}].primitives[0]"
    attributes = _object(glb, primitive.get("attributes"), f"{where}.attributes")
    vertices = _vectors(glb, attributes, f"{where}.attributes")
    names = _morph_names(glb, mesh, primitive, where)
    if len(names) > MOST_MORPHS:
        glb.fail(where, f"has {len(names)} morph targets, at most {MOST_MORPHS} are read")
    morphs = _morphs(glb, primitive, len(vertices), where)
    skeleton = read_skeleton(glb, skin_index)
    skin, renormalised = _skin(glb, attributes, skeleton.order, len(vertices), f"{where}.attributes")
    joints, v = len(skeleton.names), len(vertices)
    rig = Rig(
        vertices=vertices,
        triangles=_triangles(glb, primitive, len(vertices), where),
        morphs=morphs,
        correctives=SparseRows.empty(v, 0, {"position": (3,)}),
        late_morphs=SparseRows.empty(v, 0, {"position": (3,)}),
        skin=skin,
        joint_names=skeleton.names,
        parents=skeleton.parents,
        rest_local=skeleton.rest_local,
        inverse_bind_matrix=skeleton.inverse_bind_matrix,
        joint_basis=np.zeros((len(names), joints, 3), np.float32),
        corrective_joints=np.zeros(0, np.int32),
        anchor_vertices=np.zeros(0, np.uint32),
    )
    return GltfRig(rig, names, skeleton.deviation, skeleton.node_pose, renormalised)


def _skinned_mesh(glb: Glb) -> tuple[object, object]:
    """(mesh, skin) indices of the only node that has both."""
    nodes = [node for node in glb.entries("nodes") if "mesh" in node and "skin" in node]
    if len(nodes) != 1:
        names = ", ".join(short(node.get("name", "unnamed")) for node in nodes[:4])
        found = f"{len(nodes)} of them ({names})" if nodes else "none"
        glb.fail("nodes", f"one node with a mesh and a skin is needed, there are {found}; join the meshes")
    return nodes[0]["mesh"], nodes[0]["skin"]


def _primitive(glb: Glb, mesh: Object, index: object) -> Object:
    where = f"meshes[{index}].primitives"
    primitives = mesh.get("primitives")
    if not isinstance(primitives, list) or len(primitives) != 1:
        count = len(primitives) if isinstance(primitives, list) else 0
        glb.fail(where, f"there are {count}, one is needed; join the mesh's materials")
    primitive = _object(glb, primitives[0], f"{where}[0]")
    if primitive.get("mode", TRIANGLES) != TRIANGLES:
        glb.fail(f"{where}[0].mode", f"is {short(primitive['mode'])}; triangles ({TRIANGLES}) are needed")
    if primitive.get("extensions"):
        glb.fail(
            f"{where}[0]", "has extensions, such as a compression, that cannot be read; export without them"
        )
    return primitive


def _object(glb: Glb, value: object, where: str) -> Object:
    if not isinstance(value, dict):
        glb.fail(where, "is missing or no object")
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


def _triangles(glb: Glb, primitive: Object, vertices: int, where: str) -> U32:
    where = f"{where}.indices"
    if "indices" in primitive:
        indices = accessor(glb, primitive["indices"])
    else:
        indices = np.arange(vertices, dtype=np.uint32)
    if indices.ndim != 1 or indices.dtype.kind != "u" or len(indices) % 3:
        glb.fail(where, f"{len(indices)} numbers of type {indices.dtype} are no triangles")
    if len(indices) and int(indices.max()) >= vertices:
        at = int(np.argmax(indices >= vertices))
        glb.fail(f"{where}[{at}]", f"is {int(indices[at])}, but there are {vertices} vertices")
    return indices.astype(np.uint32).reshape(-1, 3)


def _morph_names(glb: Glb, mesh: Object, primitive: Object, where: str) -> tuple[str, ...]:
    targets = primitive.get("targets", [])
    if not isinstance(targets, list) or len(targets) > MAX_TARGETS:
        glb.fail(f"{where}.targets", f"is no list of up to {MAX_TARGETS} targets")
    extras = mesh.get("extras")
    names = extras.get("targetNames", []) if isinstance(extras, dict) else []
    if not isinstance(names, list) or len(names) != len(targets):
        count = len(names) if isinstance(names, list) else 0
        glb.fail("mesh.extras.targetNames", f"has {count} names for {len(targets)} morph targets")
    seen: set[str] = set()
    for index, name in enumerate(names):
        if not isinstance(name, str) or not name or not name.isprintable() or name in seen:
            glb.fail(f"mesh.extras.targetNames[{index}]", f"{short(name)} is no name or stands twice")
        seen.add(name)
    return tuple(names)


def _morphs(glb: Glb, primitive: Object, vertices: int, where: str) -> SparseRows:
    """Position deltas of every target that are not zero, by vertex."""
    rows: list[npt.NDArray[np.uint32]] = [np.zeros(0, np.uint32)]
    values: list[F32] = [np.zeros((0, 3), np.float32)]
    counts: list[int] = []
    total = 0
    for index, target in enumerate(primitive.get("targets", [])):
        target = _object(glb, target, f"{where}.targets[{index}]")
        counts.append(0)
        if "POSITION" not in target:
            continue
        delta = _vectors(glb, target, f"{where}.targets[{index}]", vertices)
        moved = np.flatnonzero(delta.any(axis=1))
        counts[-1] = len(moved)
        total += len(moved)
        # A stored delta takes three bytes or more; shared bytes must not ask for more than there is.
        if 3 * total > len(glb.binary):
            glb.fail(
                f"{where}.targets[{index}]", "uses data that other targets use; store each target on its own"
            )
        rows.append(moved.astype(np.uint32))
        values.append(delta[moved])
    columns = np.repeat(np.arange(len(counts)), counts)
    return _by_row(np.concatenate(rows), columns, {"position": np.concatenate(values)}, vertices, len(counts))


def _by_row(
    row: npt.NDArray[Any], column: npt.NDArray[Any], values: Mapping[str, F32], rows: int, columns: int
) -> SparseRows:
    order = np.lexsort((column, row))
    ptr = np.concatenate([[0], np.cumsum(np.bincount(row, minlength=rows))]).astype(np.uint32)
    sorted_values = {name: value[order] for name, value in values.items()}
    return SparseRows(ptr, column[order].astype(np.uint16), sorted_values, columns)


def _skin(glb: Glb, attributes: Object, order: I64, vertices: int, where: str) -> tuple[SparseRows, int]:
    """(skin weights by vertex, vertices renormalised); the skin's joint i is column order[i]."""
    joint, weight = _influences(glb, attributes, vertices, where)
    row, slot = np.nonzero(weight)
    used = joint[row, slot].astype(np.int64)
    if used.size and int(used.max()) >= len(order):
        at = int(np.argmax(used >= len(order)))
        glb.fail(
            f"{where}.JOINTS_{slot[at] // 4}[{row[at]}]",
            f"is {used[at]}, but the skin has {len(order)} joints",
        )
    key, inverse = np.unique(row * len(order) + order[used], return_inverse=True)
    summed = np.bincount(inverse, weight[row, slot], len(key))
    row, column = key // len(order), key % len(order)
    total = np.bincount(row, summed, vertices)
    if not (total > 0).all():
        glb.fail(f"{where}.WEIGHTS_0[{int(np.argmin(total > 0))}]", "no joint has any weight")
    off = np.abs(total - 1) > WEIGHT_SUM_TOLERANCE
    summed = np.where(off[row], summed / total[row], summed)
    return _by_row(row, column, {"weight": summed.astype(np.float32)}, vertices, len(order)), int(
        np.count_nonzero(off)
    )


def _influences(glb: Glb, attributes: Object, vertices: int, where: str) -> tuple[npt.NDArray[Any], F64]:
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
