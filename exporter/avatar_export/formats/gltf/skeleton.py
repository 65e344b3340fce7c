"""The joints of a glTF skin: parents, rest transforms and bind matrices, and the pose of the nodes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, I32
from avatar_runtime.codec.glb import Glb, accessor, is_count, short
from avatar_runtime.rotation import homogeneous, matrix_from_quat

# A rest pose this near the bind pose is the bind pose, up to float32 rounding (a real file: 1.4e-6).
BIND_TOLERANCE = 1e-5
MAX_JOINTS = 65535  # numbered in 16 bits
MAX_CONDITION = 1e8

I64 = npt.NDArray[np.int64]
Object = Mapping[str, Any]


@dataclass(frozen=True)
class Skeleton:
    """The joints of a skin, sorted so that a parent comes before its children."""

    names: tuple[str, ...]  # [J]
    parents: I32  # [J], -1 for a root
    rest_local: F32  # [J, 4, 4] parent_from_joint in binding pose
    inverse_bind_matrix: F32  # [J, 4, 4] joint_from_mesh, as stored
    order: I64  # [J] index in the skin -> index here
    deviation: float  # largest |entry| of node_global @ inverse_bind_matrix - I
    # Joint -> delta from the binding pose to the pose of the nodes; empty if they are the same.
    node_pose: Mapping[str, F64]


def read_skeleton(glb: Glb, skin_index: object) -> Skeleton:
    """The joints of skin `skin_index`. Raises AvatarError for a broken node tree, transform or name.

    The rest pose is that of the nodes if it makes every skin matrix the identity, else that of the inverse bind
    matrices.
    """
    skin = glb.entry("skins", skin_index)
    where = f"skins[{skin_index}]"
    nodes = glb.entries("nodes")
    joints = skin.get("joints")
    if not isinstance(joints, list) or not 0 < len(joints) <= MAX_JOINTS:
        glb.fail(f"{where}.joints", f"is not a list of 1 to {MAX_JOINTS} joints")
    if not all(is_count(j) and j < len(nodes) for j in joints) or len(set(joints)) != len(joints):
        glb.fail(f"{where}.joints", "names a node that does not exist, or a node twice")
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
    _check_invertible(glb, posed, names, "has a singular transform (a scale of 0?)")
    deviation = float(np.abs(posed @ bind.astype(np.float64) - np.eye(4)).max())
    rest, node_pose = posed, {}
    if deviation > BIND_TOLERANCE:
        _check_invertible(glb, bind.astype(np.float64), names, "has an inverse bind matrix that is singular")
        rest = np.linalg.inv(bind.astype(np.float64))
        node_pose = _deltas(names, parents, rest, posed)
    with np.errstate(over="ignore"):
        local = _locals(parents, rest).astype(np.float32)
    if not np.isfinite(local).all():
        glb.fail(where, "joints differ in scale beyond what float32 holds")
    return Skeleton(names, parents, local, bind, np.argsort(from_skin), deviation, node_pose)


def _parents_first(glb: Glb, nodes: list[dict[str, Any]]) -> list[tuple[int, int]]:
    """(node, parent or -1) of every node, a parent before its children, depth first in file order."""
    parent: dict[int, int] = {}
    children: list[list[int]] = []
    for index, node in enumerate(nodes):
        listed = node.get("children", [])
        if not isinstance(listed, list) or not all(is_count(c) and c < len(nodes) for c in listed):
            glb.fail(f"nodes[{index}].children", "is not a list of nodes")
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
    """The nearest joint above each joint, -1 for a root; other nodes between them are skipped."""
    nearest = {-1: -1}
    parents = np.full(len(index), -1, np.int32)
    for node, parent in order:
        above = nearest[parent]
        nearest[node] = index.get(node, above)
        if node in index:
            parents[index[node]] = above
    return parents


def _globals(glb: Glb, nodes: list[dict[str, Any]], order: list[tuple[int, int]]) -> dict[int, F64]:
    """world_from_node [4, 4] of every node."""
    result: dict[int, F64] = {}
    for node, parent in order:
        local = node_transform(glb, nodes[node], f"nodes[{node}]")
        with np.errstate(all="ignore"):  # an overflow becomes infinite, which is refused below
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
        glb.fail(where, f"is not a list of {count} numbers")
    for number in value:
        if isinstance(number, bool) or not isinstance(number, int | float) or not abs(number) < 1e30:
            glb.fail(where, f"{short(number)} is not a usable number")
    return np.array(value, np.float64)


def _inverse_bind(glb: Glb, skin: Object, joints: int, where: str) -> F32:
    """[J, 4, 4] in the skin's order of joints."""
    if "inverseBindMatrices" not in skin:
        return np.tile(np.eye(4, dtype=np.float32), (joints, 1, 1))
    where = f"{where}.inverseBindMatrices"
    matrices = accessor(glb, skin["inverseBindMatrices"])
    if matrices.dtype != np.float32 or matrices.shape[1:] != (4, 4) or len(matrices) < joints:
        glb.fail(where, f"is {matrices.dtype}{list(matrices.shape)}, expected float32[{joints}, 4, 4]")
    with np.errstate(invalid="ignore"):  # NaN of some bits
        last_row = (np.abs(matrices[:, 3] - [0, 0, 0, 1]) < 1e-5).all(axis=1)
    affine = np.isfinite(matrices).all(axis=(1, 2)) & last_row
    if not affine.all():
        glb.fail(f"{where}[{int(np.argmin(affine))}]", "is not finite or not affine")
    return np.ascontiguousarray(matrices[:joints])


def _joint_names(glb: Glb, nodes: list[dict[str, Any]], joints: list[int]) -> tuple[str, ...]:
    names: dict[str, int] = {}
    for joint in joints:
        name = nodes[joint].get("name", f"node_{joint}")
        if not isinstance(name, str) or not name or not name.isprintable() or name in names:
            glb.fail(f"nodes[{joint}].name", f"{short(name)} is not a valid joint name, or a duplicate")
        names[name] = joint
    return tuple(names)


def _check_invertible(glb: Glb, matrices: F64, names: tuple[str, ...], message: str) -> None:
    with np.errstate(all="ignore"):
        good = np.linalg.cond(matrices[:, :3, :3]) < MAX_CONDITION
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
