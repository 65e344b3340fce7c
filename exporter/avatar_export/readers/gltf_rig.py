"""The rig of a glTF file: the one skinned mesh, its morph targets and its joints, as a `Rig`.

Vertices keep their order in the file (other files refer to them by row). The binding pose is the mesh as it
stands in the file, the pose in which every skin matrix is the identity: where the file's nodes stand in
another pose, rest transforms come from the inverse bind matrices and `node_pose` says how to get back.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, I32, U32, Rig, SparseRows
from avatar_runtime.codec.glb import Glb, accessor, is_count, short
from avatar_runtime.rotation import homogeneous, matrix_from_quat

TRIANGLES = 4
MAX_COLUMNS = 65536  # joints or morph targets, numbered in 16 bits
MAX_INFLUENCE_SETS = 8  # JOINTS_0 .. JOINTS_7
# A rest pose within this of the bind pose is the bind pose, up to float32 (a real file: 1.4e-6).
BIND_TOLERANCE = 1e-5
# Weights whose sum is within this of 1 are kept bit by bit: the rounding of float32 and of 8 or 16 bits.
WEIGHT_SUM_TOLERANCE = 1e-5

I64 = npt.NDArray[np.int64]
Object = Mapping[str, Any]


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
    vertices = _vectors(glb, attributes.get("POSITION"), f"{where}.attributes.POSITION")
    names = _morph_names(glb, mesh, primitive, where)
    morphs = _morphs(glb, primitive, len(vertices), where)
    skeleton = _skeleton(glb, skin_index)
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
        rest_local=skeleton.rest_local.astype(np.float32),
        inverse_bind_matrix=skeleton.inverse_bind_matrix,
        joint_basis=np.zeros((len(names), joints, 3), np.float32),
        corrective_joints=np.zeros(0, np.int32),
        anchor_vertices=np.zeros(0, np.uint32),
    )
    return GltfRig(rig, names, skeleton.deviation, skeleton.node_pose, renormalised)


def _skinned_mesh(glb: Glb) -> tuple[object, object]:
    """(mesh, skin) indices of the only node that has both."""
    nodes = [node for node in _nodes(glb) if "mesh" in node and "skin" in node]
    if len(nodes) != 1:
        names = ", ".join(short(node.get("name", "unnamed")) for node in nodes[:4])
        found = f"{len(nodes)} of them ({names})" if nodes else "none"
        glb.fail("nodes", f"one node with a mesh and a skin is needed, there are {found}; join the meshes")
    return nodes[0]["mesh"], nodes[0]["skin"]


def _nodes(glb: Glb) -> list[dict[str, Any]]:
    nodes = glb.document.get("nodes", [])
    if not isinstance(nodes, list):
        glb.fail("nodes", "is no list")
    return [glb.entry("nodes", index) for index in range(len(nodes))]


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


def _vectors(glb: Glb, index: object, where: str, count: int | None = None) -> F32:
    """Accessor `index` as finite float32 [count, 3]."""
    values = accessor(glb, index)
    if values.ndim != 2 or values.shape[1] != 3 or (count is not None and len(values) != count):
        want = "[V, 3]" if count is None else f"[{count}, 3]"
        glb.fail(where, f"has shape {list(values.shape)}, expected {want}")
    result = np.ascontiguousarray(values, np.float32)
    _check_finite(glb, result, where)
    return result


def _check_finite(glb: Glb, values: npt.NDArray[Any], where: str) -> None:
    finite = np.isfinite(values.reshape(len(values), -1)).all(axis=1)
    if not finite.all():
        glb.fail(f"{where}[{int(np.argmin(finite))}]", "is not finite")


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
    if not isinstance(targets, list) or len(targets) > MAX_COLUMNS:
        glb.fail(f"{where}.targets", f"is no list of up to {MAX_COLUMNS} targets")
    extras = mesh.get("extras")
    names = extras.get("targetNames", []) if isinstance(extras, dict) else []
    if not isinstance(names, list) or len(names) != len(targets):
        count = len(names) if isinstance(names, list) else 0
        glb.fail("mesh.extras.targetNames", f"has {count} names for {len(targets)} morph targets")
    seen: set[str] = set()
    for index, name in enumerate(names):
        if not isinstance(name, str) or not name or name in seen:
            glb.fail(f"mesh.extras.targetNames[{index}]", f"{short(name)} is no name or stands twice")
        seen.add(name)
    return tuple(names)


def _morphs(glb: Glb, primitive: Object, vertices: int, where: str) -> SparseRows:
    """Position deltas of every target that are not zero, by vertex."""
    rows: list[npt.NDArray[np.uint32]] = [np.zeros(0, np.uint32)]
    values: list[F32] = [np.zeros((0, 3), np.float32)]
    counts: list[int] = []
    for index, target in enumerate(primitive.get("targets", [])):
        target = _object(glb, target, f"{where}.targets[{index}]")
        counts.append(0)
        if "POSITION" not in target:
            continue
        delta = _vectors(glb, target["POSITION"], f"{where}.targets[{index}].POSITION", vertices)
        moved = np.flatnonzero(delta.any(axis=1))
        counts[-1] = len(moved)
        # A stored delta takes three bytes or more: targets that share data cannot ask for more than the file has.
        if 3 * sum(counts) > len(glb.binary):
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
    """(skin weights by vertex, how many vertices were renormalised); order[i] = column of the skin's joint i."""
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
    summed = np.where(off[row], summed / total[row], summed).astype(np.float32)
    return _by_row(row, column, {"weight": summed}, vertices, len(order)), int(np.count_nonzero(off))


def _influences(glb: Glb, attributes: Object, vertices: int, where: str) -> tuple[npt.NDArray[Any], F64]:
    """(joints [V, 4 sets], weights [V, 4 sets])."""
    joints, weights = [], []
    while len(joints) <= MAX_INFLUENCE_SETS:
        names = (f"JOINTS_{len(joints)}", f"WEIGHTS_{len(joints)}")
        if joints and not any(name in attributes for name in names):
            break
        joint, weight = (accessor(glb, attributes.get(name)) for name in names)
        for name, values, kinds in ((names[0], joint, "u"), (names[1], weight, "f")):
            if values.shape != (vertices, 4) or values.dtype.kind not in kinds:
                glb.fail(
                    f"{where}.{name}", f"is {values.dtype}{list(values.shape)}, expected [{vertices}, 4]"
                )
        bad = ~(np.isfinite(weight) & (weight >= 0)).all(axis=1)
        if bad.any():
            glb.fail(f"{where}.{names[1]}[{int(np.argmax(bad))}]", "is negative or not finite")
        joints.append(joint)
        weights.append(weight.astype(np.float64))
    return np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)


@dataclass(frozen=True)
class _Skeleton:
    names: tuple[str, ...]
    parents: I32
    rest_local: F64  # [J, 4, 4]
    inverse_bind_matrix: F32  # [J, 4, 4]
    order: I64  # [J] index in the skin -> index here
    deviation: float
    node_pose: Mapping[str, F64]


def _skeleton(glb: Glb, skin_index: object) -> _Skeleton:
    skin = glb.entry("skins", skin_index)
    where = f"skins[{skin_index}]"
    nodes = _nodes(glb)
    joints = skin.get("joints")
    if not isinstance(joints, list) or not 0 < len(joints) < MAX_COLUMNS:
        glb.fail(f"{where}.joints", f"is no list of 1 to {MAX_COLUMNS - 1} joints")
    if not all(is_count(j) and j < len(nodes) for j in joints) or len(set(joints)) != len(joints):
        glb.fail(f"{where}.joints", "names a node that does not exist, or one twice")
    order = _parents_first(glb, nodes)
    node_global = _globals(glb, nodes, order)
    position = {joint: i for i, joint in enumerate(joints)}
    sorted_joints = [node for node, _ in order if node in position]
    index = {node: i for i, node in enumerate(sorted_joints)}
    parents = _joint_parents(order, index)
    from_skin = np.array([position[node] for node in sorted_joints])
    bind = _inverse_bind(glb, skin, len(joints), where)[from_skin]
    names = _joint_names(glb, nodes, sorted_joints)
    posed = np.stack([node_global[node] for node in sorted_joints])
    _check_invertible(glb, posed, names, "has no inverse (a scale of 0?)")
    deviation = float(np.abs(posed @ bind.astype(np.float64) - np.eye(4)).max())
    rest, node_pose = posed, {}
    if deviation > BIND_TOLERANCE:
        _check_invertible(glb, bind.astype(np.float64), names, "has an inverse bind matrix without inverse")
        rest = np.linalg.inv(bind.astype(np.float64))
        node_pose = _deltas(names, parents, rest, posed)
    local = _locals(parents, rest)
    return _Skeleton(names, parents, local, bind, np.argsort(from_skin), deviation, node_pose)


def _parents_first(glb: Glb, nodes: list[dict[str, Any]]) -> list[tuple[int, int]]:
    """(node, parent or -1) of every node, a parent before its children, depth first in file order."""
    parent: dict[int, int] = {}
    children: list[list[int]] = []
    for index, node in enumerate(nodes):
        listed = node.get("children", [])
        if not isinstance(listed, list) or not all(is_count(c) and c < len(nodes) for c in listed):
            glb.fail(f"nodes[{index}].children", "is no list of nodes")
        for child in listed:
            if child in parent:
                glb.fail(f"nodes[{child}]", f"has two parents, {parent[child]} and {index}")
            parent[child] = index
        children.append(listed)
    order: list[tuple[int, int]] = []
    stack = [index for index in reversed(range(len(nodes))) if index not in parent]
    while stack:
        index = stack.pop()
        order.append((index, parent.get(index, -1)))
        stack.extend(reversed(children[index]))
    if len(order) != len(nodes):
        glb.fail("nodes", "contains a loop")
    return order


def _joint_parents(order: list[tuple[int, int]], index: Mapping[int, int]) -> I32:
    """For each joint the nearest joint above it, -1 for a root; other nodes between are passed over."""
    nearest = {-1: -1}
    parents = np.full(len(index), -1, np.int32)
    for node, parent in order:
        above = nearest[parent]
        nearest[node] = index.get(node, above)
        if node in index:
            parents[index[node]] = above
    return parents


def _globals(glb: Glb, nodes: list[dict[str, Any]], order: list[tuple[int, int]]) -> dict[int, F64]:
    result: dict[int, F64] = {}
    for node, parent in order:
        local = node_transform(glb, nodes[node], f"nodes[{node}]")
        with np.errstate(all="ignore"):  # overflow becomes infinite and is refused
            result[node] = local if parent < 0 else result[parent] @ local
        if not np.isfinite(result[node]).all():
            glb.fail(f"nodes[{node}]", "its transform overflows")
    return result


def node_transform(glb: Glb, node: Object, where: str) -> F64:
    """parent_from_node [4, 4] of a node's matrix or translation, rotation (xyzw) and scale."""
    if "matrix" in node:
        matrix = _numbers(glb, node["matrix"], 16, f"{where}.matrix").reshape(4, 4).T
        if not np.array_equal(matrix[3], [0, 0, 0, 1]):
            glb.fail(f"{where}.matrix", "is not affine")
        return matrix
    translation = _numbers(glb, node.get("translation", [0, 0, 0]), 3, f"{where}.translation")
    rotation = _numbers(glb, node.get("rotation", [0, 0, 0, 1]), 4, f"{where}.rotation")
    scale = _numbers(glb, node.get("scale", [1, 1, 1]), 3, f"{where}.scale")
    length = math.hypot(*rotation)
    if not 0.5 < length < 2:
        glb.fail(f"{where}.rotation", f"is a quaternion of length {length:.3g}, expected 1")
    return homogeneous(matrix_from_quat(np.roll(rotation, 1) / length) * scale, translation)


def _numbers(glb: Glb, value: object, count: int, where: str) -> F64:
    if not isinstance(value, list) or len(value) != count:
        glb.fail(where, f"is no list of {count} numbers")
    for number in value:
        if isinstance(number, bool) or not isinstance(number, int | float) or not abs(number) < 1e30:
            glb.fail(where, f"{short(number)} is no usable number")
    return np.array(value, np.float64)


def _inverse_bind(glb: Glb, skin: Object, joints: int, where: str) -> F32:
    """[J, 4, 4] in the skin's order of joints."""
    if "inverseBindMatrices" not in skin:
        return np.tile(np.eye(4, dtype=np.float32), (joints, 1, 1))
    where = f"{where}.inverseBindMatrices"
    matrices = accessor(glb, skin["inverseBindMatrices"])
    if matrices.dtype != np.float32 or matrices.shape[1:] != (4, 4) or len(matrices) < joints:
        glb.fail(where, f"is {matrices.dtype}{list(matrices.shape)}, expected float32[{joints}, 4, 4]")
    _check_finite(glb, matrices, where)
    return np.ascontiguousarray(matrices[:joints])


def _joint_names(glb: Glb, nodes: list[dict[str, Any]], joints: list[int]) -> tuple[str, ...]:
    names: dict[str, int] = {}
    for joint in joints:
        name = nodes[joint].get("name", f"node_{joint}")
        if not isinstance(name, str) or not name or name in names:
            glb.fail(f"nodes[{joint}].name", f"{short(name)} is no name of a joint or stands twice")
        names[name] = joint
    return tuple(names)


def _check_invertible(glb: Glb, matrices: F64, names: tuple[str, ...], message: str) -> None:
    with np.errstate(all="ignore"):
        good = np.linalg.cond(matrices[:, :3, :3]) < 1e8
    if not good.all():
        glb.fail(f"joint {short(names[int(np.argmin(good))])}", message)


def _locals(parents: I32, rest: F64) -> F64:
    """parent_from_joint [J, 4, 4] of mesh_from_joint."""
    local = rest.copy()
    for joint, parent in enumerate(parents):
        if parent >= 0:
            local[joint] = np.linalg.solve(rest[parent], rest[joint])
    return local


def _deltas(names: tuple[str, ...], parents: I32, rest: F64, posed: F64) -> dict[str, F64]:
    """The deltas (`Pose.joints`) that take the joints from `rest` to `posed`, mesh_from_joint each."""
    rest_local, posed_local = _locals(parents, rest), _locals(parents, posed)
    return {name: np.linalg.solve(rest_local[j], posed_local[j]) for j, name in enumerate(names)}
