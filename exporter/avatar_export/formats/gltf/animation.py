"""Reads one animation clip of a .glb: its nodes, and the channels that move them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from avatar_export.formats.gltf.sampler import INTERPOLATIONS, Sampler, unit
from avatar_runtime.avatar import F64
from avatar_runtime.codec.glb import Glb, accessor, is_count, short
from avatar_runtime.io.errors import no_such

# The properties that a channel may animate, and the shape of one value.
PATHS = {"translation": (3,), "rotation": (4,), "scale": (3,), "weights": ()}

DEFAULTS = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}


@dataclass(frozen=True)
class Node:
    """A node of the file at rest."""

    name: str
    parent: int  # -1: none
    matrix: F64 | None  # [4, 4] where the file gives one
    rest: Mapping[str, F64]  # translation [3], rotation [4] xyzw, scale [3]
    targets: tuple[str, ...]  # names of its mesh's morph targets


@dataclass(frozen=True)
class Clip:
    """One animation; `channels` maps a node to the samplers that move it."""

    name: str
    nodes: tuple[Node, ...]
    channels: Mapping[int, Mapping[str, Sampler]]  # node -> path -> sampler
    duration: float  # seconds


def clip_names(glb: Glb) -> list[str]:
    """The name of every animation; without a name, or with a duplicate name, it is `animation_INDEX`."""
    names: list[str] = []
    for index, animation in enumerate(glb.entries("animations")):
        name = animation.get("name")
        usable = isinstance(name, str) and name and name not in names
        names.append(str(name) if usable else f"animation_{index}")
    return names


def read_clip(glb: Glb, name: str) -> Clip:
    """The clip `name`. Raises AvatarError if there is no such clip, or if it is damaged."""
    names = clip_names(glb)
    if name not in names:
        raise no_such("clip of this file", name, names, file=str(glb.file))
    index = names.index(name)
    field, animation = f"animations[{index}]", glb.entries("animations")[index]
    nodes = _nodes(glb)
    samplers = _objects(glb, animation, "samplers", f"{field}.")
    channels: dict[int, dict[str, Sampler]] = {}
    for at, channel in enumerate(_objects(glb, animation, "channels", f"{field}.")):
        where = f"{field}.channels[{at}]"
        target = _target(glb, channel, nodes, where)
        if target is None:
            continue
        node, path = target
        if path in channels.setdefault(node, {}):
            glb.fail(where, f"moves the {path} of node {node} a second time")
        number = channel.get("sampler")
        if not is_count(number) or number >= len(samplers):
            glb.fail(where, f"sampler {short(number)} does not exist; there are {len(samplers)}")
        channels[node][path] = _sampler(glb, samplers[number], path, len(nodes[node].targets), where)
    ends = [float(s.times[-1]) for moved in channels.values() for s in moved.values()]
    return Clip(name, nodes, channels, max(ends, default=0.0))


def _target(glb: Glb, channel: dict[str, Any], nodes: tuple[Node, ...], where: str) -> tuple[int, str] | None:
    """(node, path) that a channel moves; None where an extension defines the target."""
    target = channel.get("target")
    if not isinstance(target, dict):
        glb.fail(where, "needs a target")
    if "node" not in target:
        return None
    node, path = target["node"], target.get("path")
    if not is_count(node) or node >= len(nodes):
        glb.fail(where, f"node {short(node)} does not exist; there are {len(nodes)}")
    if not isinstance(path, str) or path not in PATHS:
        glb.fail(where, f"path {short(path)} is not one of {', '.join(PATHS)}")
    if path != "weights" and nodes[node].matrix is not None:
        glb.fail(where, f"moves node {node}, which has a matrix")
    return node, path


def _sampler(glb: Glb, entry: dict[str, Any], path: str, targets: int, where: str) -> Sampler:
    kind = entry.get("interpolation", "LINEAR")
    if not isinstance(kind, str) or kind not in INTERPOLATIONS:
        glb.fail(where, f"interpolation {short(kind)} is not one of {', '.join(INTERPOLATIONS)}")
    times, values = (
        _floats(glb, entry.get("input"), (), where),
        _floats(glb, entry.get("output"), PATHS[path], where),
    )
    if len(times) == 0 or times[0] < 0 or (np.diff(times) <= 0).any():
        glb.fail(where, "key times must not be negative and must strictly increase")
    per_key = (3 if kind == "CUBICSPLINE" else 1) * (targets if path == "weights" else 1)
    if per_key == 0 or len(values) != len(times) * per_key:
        glb.fail(where, f"has {len(values)} values for {len(times)} keys of {per_key}")
    width = targets if path == "weights" else values.shape[1]
    values = (
        values.reshape(len(times), 3, width) if kind == "CUBICSPLINE" else values.reshape(len(times), width)
    )
    rotation = path == "rotation"
    return Sampler(times, unit(values) if rotation and kind != "CUBICSPLINE" else values, kind, rotation)


def _floats(glb: Glb, index: object, shape: tuple[int, ...], where: str) -> F64:
    """An accessor of finite floats (or normalised integers) whose elements have this shape."""
    values = accessor(glb, index)
    if values.dtype != np.float32 or values.shape[1:] != shape:
        glb.fail(
            where,
            f"accessor {short(index)} is {values.dtype}{list(values.shape)}, expected float32[T, *{shape}]",
        )
    if not np.isfinite(values).all():
        glb.fail(where, f"accessor {short(index)} holds NaN or an infinity")
    return values.astype(np.float64)


def _nodes(glb: Glb) -> tuple[Node, ...]:
    entries = glb.entries("nodes")
    parents = [-1] * len(entries)
    for index, entry in enumerate(entries):
        children = entry.get("children", [])
        if not isinstance(children, list) or not all(is_count(c) and c < len(entries) for c in children):
            glb.fail(f"nodes[{index}].children", "is not a list of nodes")
        for child in children:
            if parents[child] >= 0:
                glb.fail(f"nodes[{child}]", "has two parents")
            parents[child] = index
    _check_no_loop(glb, parents)
    return tuple(_node(glb, entry, index, parents[index]) for index, entry in enumerate(entries))


def _check_no_loop(glb: Glb, parents: list[int]) -> None:
    """A node that is its own ancestor would make an endless loop."""
    rooted = [False] * len(parents)
    for index in range(len(parents)):
        walk: list[int] = []
        at = index
        while at >= 0 and not rooted[at]:
            if len(walk) > len(parents):
                glb.fail(f"nodes[{index}]", "is its own ancestor")
            walk.append(at)
            at = parents[at]
        for node in walk:
            rooted[node] = True


def _node(glb: Glb, entry: dict[str, Any], index: int, parent: int) -> Node:
    where = f"nodes[{index}]"
    name = entry.get("name", f"node_{index}")
    if not isinstance(name, str):
        glb.fail(f"{where}.name", "is not text")
    matrix = None
    if "matrix" in entry:
        matrix = _numbers(glb, entry["matrix"], 16, f"{where}.matrix").reshape(4, 4).T
    rest = {
        key: _numbers(glb, entry.get(key, list(default)), len(default), f"{where}.{key}")
        for key, default in DEFAULTS.items()
    }
    rest["rotation"] = unit(rest["rotation"][None])[0]
    return Node(name, parent, matrix, rest, _targets(glb, entry))


def _targets(glb: Glb, node: dict[str, Any]) -> tuple[str, ...]:
    """Names of the morph targets of a node's mesh; "" for a target without a name."""
    if "mesh" not in node:
        return ()
    mesh, where = glb.entry("meshes", node["mesh"]), f"meshes[{node['mesh']}]."
    primitives = _objects(glb, mesh, "primitives", where)
    count = len(_objects(glb, primitives[0], "targets", f"{where}primitives[0].")) if primitives else 0
    extras = mesh.get("extras")
    names = extras.get("targetNames") if isinstance(extras, dict) else None
    if not isinstance(names, list) or len(names) != count:
        return ("",) * count
    return tuple(name if isinstance(name, str) else "" for name in names)


def _objects(glb: Glb, owner: dict[str, Any], key: str, where: str) -> list[dict[str, Any]]:
    """The list `key` of `owner` ([] if absent), each entry an object."""
    found = owner.get(key, [])
    if not isinstance(found, list) or not all(isinstance(entry, dict) for entry in found):
        glb.fail(f"{where}{key}", "is not a list of objects")
    return found


def _numbers(glb: Glb, value: object, count: int, where: str) -> F64:
    plain = isinstance(value, list) and len(value) == count
    if not plain or not all(isinstance(v, int | float) and abs(v) < 1e30 for v in value):  # type: ignore[attr-defined]
        glb.fail(where, f"is not a list of {count} finite numbers")
    return np.array(value, np.float64)
