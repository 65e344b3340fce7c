"""The content of an .fbx as plain arrays. A separate program: the .fbx on stdin, an .npz on stdout.

The only importer of ufbx, and never imported itself. ufbx is C that parses untrusted bytes, and its binding (0.0.5)
counts references wrongly: elements taken from a list are not counted, buffers taken from its lists are released too
often, and the garbage collector then finds freed objects. Here every element is counted once more, numbers are read
one by one, and the garbage collector is off. If it still crashes, only this process ends.

Everything is in the units and axes of the file. Arrays: `header` (JSON as bytes: names and counts),
`axes`, `parents`, and by mesh, cluster and clip what `_mesh` and `_clip` list.
"""

from __future__ import annotations

import ctypes
import gc
import io
import json
import math
import os
import sys
from typing import Any

import numpy as np
import ufbx

FPS = 30.0
MAX_VERTICES = 1_000_000
MAX_NODES = 20_000
MAX_TRANSFORMS = 4_000_000  # nodes times frames of all clips
MAX_MEMORY = 8 << 30
REFUSED = 3  # exit status; the reason is on stdout


class Refused(Exception):
    """The reason why this file is not read."""


def items(elements: Any) -> list[Any]:
    """The elements of a ufbx list, each with the reference that the binding forgets."""
    found = []
    for index in range(len(elements)):
        element = elements[index]
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(element))
        found.append(element)
    return found


def matrix(value: Any) -> np.ndarray:
    """[4, 4] of a ufbx matrix, which lists its columns one after another."""
    result = np.eye(4)
    result[:3] = np.array([tuple(column) for column in value]).T
    return result


def vectors(values: Any) -> np.ndarray:
    """A list of ufbx vectors as float64 [n, 3]."""
    return np.array([tuple(value) for value in list(values)], np.float64).reshape(-1, 3)


def numbers(values: Any, kind: type) -> np.ndarray:
    """A list of ufbx numbers as an array of type `kind`."""
    return np.array(list(values), kind)


def scene_arrays(data: bytes) -> dict[str, np.ndarray]:
    """Every array of the .fbx `data` that a rig or a clip needs."""
    scene = ufbx.load_memory(data, ignore_embedded=True, load_external_files=False)
    nodes = items(scene.nodes)
    meshes = [mesh for mesh in items(scene.meshes) if len(mesh.skin_deformers)]
    if len(nodes) > MAX_NODES or sum(mesh.num_vertices for mesh in meshes) > MAX_VERTICES:
        raise Refused(f"more than {MAX_NODES} nodes or {MAX_VERTICES} vertices are not read")
    axes = scene.settings.axes
    arrays: dict[str, np.ndarray] = {
        "axes": np.array([int(axes.right), int(axes.up), int(axes.front)]),
        "parents": np.array([-1 if n.parent is None else n.parent.typed_id for n in nodes], np.int64),
    }
    header: dict[str, Any] = {
        "unit_metres": float(scene.settings.unit_meters),
        "nodes": [node.name for node in nodes],
        "meshes": [_mesh(arrays, f"mesh{i}", mesh) for i, mesh in enumerate(meshes)],
        "channels": [channel.name for channel in items(scene.blend_channels)],
        "clips": _clips(arrays, scene, len(nodes)),
    }
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    return arrays


def _mesh(arrays: dict[str, np.ndarray], key: str, mesh: Any) -> dict[str, Any]:
    """Points, faces (first index, corners), skin clusters and blend channels of one mesh."""
    skin = items(mesh.skin_deformers)[0]
    clusters = [cluster for cluster in items(skin.clusters) if cluster.bone_node is not None]
    channels = [
        channel
        for blend in items(mesh.blend_deformers)
        for channel in items(blend.channels)
        if channel.target_shape is not None
    ]
    arrays[f"{key}.vertices"] = vectors(mesh.vertices)
    arrays[f"{key}.indices"] = numbers(mesh.vertex_indices, np.int64)
    arrays[f"{key}.faces"] = np.array([tuple(face)[:2] for face in list(mesh.faces)], np.int64).reshape(-1, 2)
    for i, cluster in enumerate(clusters):
        arrays[f"{key}.cluster{i}.vertices"] = numbers(cluster.vertices, np.int64)
        arrays[f"{key}.cluster{i}.weights"] = numbers(cluster.weights, np.float64)
        arrays[f"{key}.cluster{i}.geometry_to_bone"] = matrix(cluster.geometry_to_bone)
        arrays[f"{key}.cluster{i}.bind_to_world"] = matrix(cluster.bind_to_world)
    targets = [_last(channel.keyframes).target_weight for channel in channels]
    arrays[f"{key}.target_weights"] = np.array(targets, np.float64)
    for i, channel in enumerate(channels):
        shape = channel.target_shape
        arrays[f"{key}.shape{i}.vertices"] = numbers(shape.offset_vertices, np.int64)
        arrays[f"{key}.shape{i}.offsets"] = vectors(shape.position_offsets)
    instances = items(mesh.instances)
    return {
        "name": mesh.name or (instances[0].name if instances else ""),
        "bones": [cluster.bone_node.typed_id for cluster in clusters],
        "channels": [channel.typed_id for channel in channels],
        "between": [len(channel.keyframes) - 1 for channel in channels],
        "linear": int(skin.skinning_method) in (ufbx.SkinningMethod.LINEAR, ufbx.SkinningMethod.RIGID),
    }


def _last(keyframes: Any) -> Any:
    return keyframes[len(keyframes) - 1]


def _clips(arrays: dict[str, np.ndarray], scene: Any, nodes: int) -> list[dict[str, Any]]:
    """Every animation stack evaluated FPS times a second: world transforms of nodes, weights of channels."""
    clips: list[dict[str, Any]] = []
    room = MAX_TRANSFORMS
    for index, stack in enumerate(items(scene.anim_stacks)):
        begin, end = float(stack.time_begin), float(stack.time_end)
        if not (math.isfinite(begin) and math.isfinite(end) and end >= begin):
            continue
        frames = math.floor(min((end - begin) * FPS, MAX_TRANSFORMS) + 1e-6) + 1
        room -= frames * max(nodes, 1)
        if room < 0:
            raise Refused(f"animation {stack.name!a} is too long: {end - begin:.6g} s of {nodes} nodes")
        world, weights = [], []
        anim = stack.anim
        for frame in range(frames):
            posed = scene.evaluate(anim, begin + frame / FPS)
            world.append([matrix(node.node_to_world) for node in items(posed.nodes)])
            weights.append([float(channel.weight) for channel in items(posed.blend_channels)])
            posed.free()
        arrays[f"clip{index}.world"] = np.array(world, np.float64)
        arrays[f"clip{index}.weights"] = np.array(weights, np.float64).reshape(frames, -1)
        clips.append({"key": f"clip{index}", "name": stack.name, "frames": frames})
    return clips


def main() -> int:
    """Read the .fbx on stdin, write the .npz to stdout; returns the exit status."""
    try:
        import resource  # not on Windows

        resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY, MAX_MEMORY))
    except ImportError:
        pass
    gc.disable()
    stream = io.BytesIO()
    try:
        arrays: dict[str, Any] = scene_arrays(sys.stdin.buffer.read())
        np.savez(stream, **arrays)
    except (Refused, ufbx.UfbxError) as error:
        sys.stdout.buffer.write(f"{type(error).__name__}: {error}".encode())
        return REFUSED
    sys.stdout.buffer.write(stream.getvalue())
    return 0


if __name__ == "__main__":
    status = main()
    sys.stdout.flush()
    os._exit(status)  # not through the destructors of ufbx's objects
