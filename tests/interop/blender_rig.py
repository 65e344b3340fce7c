"""Poses a rigged .glb with Blender as a Python module. Job and answer as in clients.py; needs bpy and NumPy alone.

Blender is Z-up: (x, y, z) of glTF is (x, -z, y) here, in the mesh data and in every transform.
"""

from __future__ import annotations

import json
import os
import struct
import sys
from pathlib import Path
from typing import Any

ANSWER = os.fdopen(os.dup(1), "w")
os.dup2(2, 1)  # Blender reports on standard output, which is the answer's alone

import bpy  # noqa: E402
import numpy as np  # noqa: E402
from mathutils import Matrix, Quaternion, Vector  # noqa: E402

Z_UP = Matrix(((1, 0, 0, 0), (0, 0, -1, 0), (0, 1, 0, 0), (0, 0, 0, 1)))
Y_UP = Z_UP.inverted()
WIDEST = 10.0  # the slider range that a shape key can have; outside of it weights are cut, at first 0 to 1


def transform(node: dict[str, Any]) -> Matrix:
    """A node's local transform, in glTF's axes."""
    x, y, z, w = node.get("rotation_xyzw") or node.get("rotation") or (0, 0, 0, 1)
    place = Vector(node.get("translation") or (0, 0, 0))
    return Matrix.LocRotScale(place, Quaternion((w, x, y, z)), Vector(node.get("scale") or (1, 1, 1)))


class Client:
    """The imported file."""

    def __init__(self, path: str) -> None:
        data = Path(path).read_bytes()
        self.json = json.loads(data[20 : 20 + struct.unpack_from("<I", data, 12)[0]])
        bpy.ops.wm.read_factory_settings(use_empty=True)
        bpy.ops.import_scene.gltf(filepath=path, disable_bone_shape=True)
        self.mesh = next(o for o in bpy.data.objects if o.type == "MESH")
        self.armature = self.mesh.find_armature()
        shape_keys = self.mesh.data.shape_keys
        self.keys = list(shape_keys.key_blocks[1:]) if shape_keys else []
        for key in self.keys:
            key.slider_min, key.slider_max = -WIDEST, WIDEST
        self.animated = [self.armature, shape_keys] if shape_keys else [self.armature]
        self.to_rest()
        nodes = self.json["nodes"]
        self.parent = {nodes[c]["name"]: n["name"] for n in nodes for c in n.get("children", [])}
        self.rest = self.joints({node["name"]: node for node in nodes})

    def joints(self, nodes: dict[str, Any]) -> dict[str, Matrix]:
        """World transforms of the joints below the root node, in glTF's axes, of local ones."""
        world: dict[str, Matrix] = {}
        for bone in self.armature.data.bones:  # parents first
            above = world[self.parent[bone.name]] if bone.parent else Matrix()
            world[bone.name] = above @ transform(nodes[bone.name])
        return world

    def to_rest(self) -> None:
        for block in self.animated:
            if block.animation_data:
                block.animation_data.action = None
        self.armature.matrix_basis = Matrix()
        for bone in self.armature.pose.bones:
            bone.matrix_basis = Matrix()
        for key in self.keys:
            key.value = 0

    def set_pose(self, pose: dict[str, Any]) -> None:
        """Bones have axes of their own, so each gets what its joint does to the mesh, seen from its parent."""
        self.armature.matrix_basis = Z_UP @ transform(pose["nodes"][self.armature.name]) @ Y_UP
        posed = self.joints(pose["nodes"])
        target = {}
        for bone in self.armature.pose.bones:
            name, at_rest = bone.name, bone.bone.matrix_local
            target[name] = Z_UP @ posed[name] @ self.rest[name].inverted() @ Y_UP @ at_rest
            local = target[name]
            if bone.parent:
                above = bone.parent.bone.matrix_local.inverted() @ at_rest
                at_rest, local = above, target[bone.parent.name].inverted() @ local
            bone.matrix_basis = at_rest.inverted() @ local
        for key, weight in zip(self.keys, pose["weights"], strict=True):
            key.value = weight

    def play(self, clip: str, time: float) -> None:
        """Give the clip's slots to the armature and the shape keys, and go to a time in seconds."""
        action = bpy.data.actions[clip]
        for block in self.animated:
            slot = next((s for s in action.slots if s.target_id_type == block.id_type), None)
            if slot:
                block.animation_data.action = action
                block.animation_data.action_slot = slot
        frame = time * bpy.context.scene.render.fps
        bpy.context.scene.frame_set(int(frame), subframe=frame % 1)

    def posed(self) -> np.ndarray:
        """[v, 3] in world space and glTF's axes."""
        bpy.context.view_layer.update()
        shown = self.mesh.evaluated_get(bpy.context.evaluated_depsgraph_get())
        points = np.empty(3 * len(self.mesh.data.vertices), np.float32)
        shown.to_mesh().vertices.foreach_get("co", points)
        world = np.array(Y_UP @ shown.matrix_world)
        shown.to_mesh_clear()
        return (points.reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]).astype(np.float32)

    def mesh_arrays(self) -> dict[str, np.ndarray]:
        mesh = self.mesh.data
        triangles = np.empty(len(mesh.loops), np.int32)
        mesh.loops.foreach_get("vertex_index", triangles)
        uv = np.empty(2 * len(mesh.loops), np.float32)
        mesh.uv_layers[0].uv.foreach_get("vector", uv)
        of_vertex = np.empty((len(mesh.vertices), 2), np.float32)
        of_vertex[triangles] = uv.reshape(-1, 2)
        position = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", position)
        vertex_id = np.empty(len(mesh.vertices), np.float32)
        mesh.attributes["_VERTEX_ID"].data.foreach_get("value", vertex_id)
        return {
            "triangles": triangles.astype(np.uint32),
            "attribute/uv": of_vertex,
            "attribute/position": position.reshape(-1, 3) @ np.array(Y_UP, np.float32)[:3, :3].T,
            "attribute/_vertex_id": vertex_id,
        }


def main() -> None:
    job = json.load(sys.stdin)
    client = Client(job["glb"])
    arrays = client.mesh_arrays()
    for k, pose in enumerate(job["poses"]):
        client.set_pose(pose)
        arrays[f"pose/{k}"] = client.posed()
    for clip in job["clips"]:
        for k, time in enumerate(clip["times"]):
            client.to_rest()
            client.play(clip["clip"], time)
            arrays[f"clip/{clip['clip']}/{k}"] = client.posed()
    facts = {
        "version": bpy.app.version_string,
        "vertices": len(client.mesh.data.vertices),
        "joints": [bone.name for bone in client.armature.data.bones],
        "targets": [key.name for key in client.keys],
        "clips": sorted(action.name for action in bpy.data.actions),
        "arrays": [[name, array.dtype.str, array.size] for name, array in arrays.items()],
    }
    Path(job["out"]).write_bytes(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays.values()))
    ANSWER.write(json.dumps(facts))
    ANSWER.close()


if __name__ == "__main__":
    main()
