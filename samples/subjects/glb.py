"""Rigged meshes and clips as binary glTF, written with pygltflib."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pygltflib as gltf

from avatar_runtime.rotation import matrix_from_quat, matrix_from_rotvec, quat_from_matrix, quat_multiply
from avatar_trainer.head import Head

Array = npt.NDArray[Any]

COMPONENT = {"u1": gltf.UNSIGNED_BYTE, "u2": gltf.UNSIGNED_SHORT, "f4": gltf.FLOAT}
ELEMENT = {(): "SCALAR", (3,): "VEC3", (4,): "VEC4", (4, 4): "MAT4"}
GENERATOR = "avatar-export samples"


@dataclass(frozen=True)
class Node:
    """A node of a skeleton: name, index of the parent or -1, rest translation, rotation wxyz, scale."""

    name: str
    parent: int
    translation: tuple[float, ...]
    quat_wxyz: Array
    scale: tuple[float, ...] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class Clip:
    """Turns of joints over time: rotation vectors [T, 3], radians, in the joint's rest frame."""

    name: str
    times: Array  # [T], seconds
    turns: dict[str, Array]


class Builder:
    """A glTF document and its one buffer."""

    def __init__(self) -> None:
        self.doc = gltf.GLTF2(asset=gltf.Asset(version="2.0", generator=GENERATOR), scene=0)
        self.blob = bytearray()

    def view(self, array: Array, target: int | None = None) -> int:
        """Append the bytes of an array; index of the buffer view."""
        self.blob += b"\0" * (-len(self.blob) % 4)
        data = array.tobytes()
        self.doc.bufferViews.append(
            gltf.BufferView(buffer=0, byteOffset=len(self.blob), byteLength=len(data), target=target)
        )
        self.blob += data
        return len(self.doc.bufferViews) - 1

    def accessor(self, array: Array, target: int | None = None, *, bounds: bool = False) -> int:
        """Index of an accessor of little-endian u8, u16 or f32 elements; matrices must be column-major."""
        item = gltf.Accessor(
            bufferView=self.view(array, target),
            componentType=COMPONENT[array.dtype.str[1:]],
            count=len(array),
            type=ELEMENT[array.shape[1:]],
        )
        return self._add(item, array if bounds else None)

    def sparse(self, offsets: Array) -> int:
        """Index of an accessor [N, 3] that stores only the rows that are not zero."""
        rows = np.flatnonzero(np.any(offsets != 0, axis=1))
        sparse = gltf.Sparse(
            count=len(rows),
            indices=gltf.AccessorSparseIndices(
                bufferView=self.view(rows.astype("<u2")), componentType=COMPONENT["u2"]
            ),
            values=gltf.AccessorSparseValues(bufferView=self.view(offsets[rows].astype("<f4"))),
        )
        item = gltf.Accessor(componentType=COMPONENT["f4"], count=len(offsets), type="VEC3", sparse=sparse)
        return self._add(item, offsets)

    def nodes(self, nodes: list[Node], order: list[int]) -> None:
        """Append a skeleton, its nodes in this order; quaternions become xyzw."""
        place = {old: new for new, old in enumerate(order)}
        for k in order:
            node = nodes[k]
            self.doc.nodes.append(
                gltf.Node(
                    name=node.name,
                    children=[place[c] for c, other in enumerate(nodes) if other.parent == k],
                    translation=list(node.translation),
                    rotation=np.roll(node.quat_wxyz, -1).tolist(),
                    scale=list(node.scale),
                )
            )

    def save(self) -> bytes:
        """The glb."""
        self.doc.buffers = [gltf.Buffer(byteLength=len(self.blob))]
        self.doc.set_binary_blob(bytes(self.blob))
        return b"".join(self.doc.save_to_bytes())

    def _add(self, item: gltf.Accessor, bounds: Array | None) -> int:
        if bounds is not None:
            values = bounds.astype(np.float32).reshape(len(bounds), -1)
            item.min, item.max = values.min(axis=0).tolist(), values.max(axis=0).tolist()
        self.doc.accessors.append(item)
        return len(self.doc.accessors) - 1


def world_matrices(nodes: list[Node]) -> Array:
    """World transforms [K, 4, 4] of nodes whose parents come before them."""
    world = np.zeros((len(nodes), 4, 4))
    for k, node in enumerate(nodes):
        local = np.eye(4)
        local[:3, :3] = matrix_from_quat(node.quat_wxyz) * np.array(node.scale)
        local[:3, 3] = node.translation
        world[k] = local if node.parent < 0 else world[node.parent] @ local
    return world


def save_skin_glb(head: Head, nodes: list[Node], joints: Array, weights: Array) -> bytes:
    """A skinned mesh with one sparse morph target for each expression, named in mesh.extras.targetNames.

    nodes[0] is the armature, the others are the joints; the mesh hangs beside them under the armature.
    """
    b = Builder()
    position = b.accessor(head.vertices.astype("<f4"), gltf.ARRAY_BUFFER, bounds=True)
    attributes = gltf.Attributes(
        POSITION=position,
        JOINTS_0=b.accessor(joints, gltf.ARRAY_BUFFER),
        WEIGHTS_0=b.accessor(weights.astype("<f4"), gltf.ARRAY_BUFFER),
    )
    indices = b.accessor(head.triangles.astype("<u2").reshape(-1), gltf.ELEMENT_ARRAY_BUFFER)
    # The order of the targets has no meaning: exports differ, so readers must go by name.
    order = np.roll(np.arange(len(head.expression_names)), 17)
    targets = [{"POSITION": b.sparse(head.expressions[k])} for k in order]
    primitive = gltf.Primitive(attributes=attributes, indices=indices, targets=targets)
    names = {"targetNames": [head.expression_names[k] for k in order]}
    b.doc.meshes = [
        gltf.Mesh(name="head", primitives=[primitive], weights=[0.0] * len(targets), extras=names)
    ]
    inverse_bind = np.linalg.inv(world_matrices(nodes)[1:]).transpose(0, 2, 1).astype("<f4")
    b.nodes(nodes, list(range(len(nodes))))
    b.doc.nodes.append(gltf.Node(name="head_final", mesh=0, skin=0))
    b.doc.nodes[0].children.append(len(nodes))
    joint_nodes = list(range(1, len(nodes)))
    bind = b.accessor(np.ascontiguousarray(inverse_bind))
    b.doc.skins = [gltf.Skin(name="Armature", joints=joint_nodes, inverseBindMatrices=bind)]
    b.doc.scenes = [gltf.Scene(name="Scene", nodes=[0])]
    return b.save()


def save_animation_glb(nodes: list[Node], clips: list[Clip]) -> bytes:
    """The clips on a copy of the skeleton with its nodes in another order: joints are found by name."""
    b = Builder()
    order = list(reversed(range(len(nodes))))
    b.nodes(nodes, order)
    for clip in clips:
        b.doc.animations.append(animation(b, clip, nodes, order))
    b.doc.scenes = [gltf.Scene(name="Scene", nodes=[order.index(0)])]
    return b.save()


def animation(b: Builder, clip: Clip, nodes: list[Node], order: list[int]) -> gltf.Animation:
    """Translation, rotation and scale channels for every joint; those at rest are two STEP keys."""
    out = gltf.Animation(name=clip.name)
    ends = b.accessor(clip.times[[0, -1]].astype("<f4"), bounds=True)
    every = b.accessor(clip.times.astype("<f4"), bounds=True)
    for k, node in enumerate(nodes):
        if k == 0:
            continue
        turn = clip.turns.get(node.name)
        rotation = np.tile(node.quat_wxyz, (2, 1))
        if turn is not None:
            rest = np.tile(node.quat_wxyz, (len(turn), 1))
            rotation = quat_multiply(rest, quat_from_matrix(matrix_from_rotvec(turn)))
        for path, values, moves in (
            ("translation", np.tile(node.translation, (2, 1)), False),
            ("rotation", np.roll(rotation, -1, axis=1), turn is not None),
            ("scale", np.tile(node.scale, (2, 1)), False),
        ):
            sampler = gltf.AnimationSampler(
                input=every if moves else ends,
                output=b.accessor(values.astype("<f4")),
                interpolation="LINEAR" if moves else "STEP",
            )
            out.samplers.append(sampler)
            target = gltf.AnimationChannelTarget(node=order.index(k), path=path)
            out.channels.append(gltf.AnimationChannel(sampler=len(out.samplers) - 1, target=target))
    return out
