"""Reads one animation clip of a .glb: its nodes, and what moves which of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from avatar_export.driving.checks import no_such, shown
from avatar_export.driving.glb import Glb, accessor, natural, numbers, objects
from avatar_export.driving.sampler import INTERPOLATIONS, Sampler, unit
from avatar_runtime.avatar import F64

# What a channel may move: the type of its values.
PATHS = {"translation": "VEC3", "rotation": "VEC4", "scale": "VEC3", "weights": "SCALAR"}

DEFAULTS = {"translation": (0.0, 0.0, 0.0), "rotation": (0.0, 0.0, 0.0, 1.0), "scale": (1.0, 1.0, 1.0)}


@dataclass(frozen=True)
class Node:
    """A node of the file, as it stands before any clip moves it."""

    name: str
    parent: int  # -1: none
    matrix: F64 | None  # [4, 4] where the file gives one
    rest: Mapping[str, F64]  # translation [3], rotation [4] xyzw, scale [3]
    targets: tuple[str, ...]  # names of its mesh's morph targets


@dataclass(frozen=True)
class Clip:
    """One animation; `channels` maps a node to what moves it."""

    name: str
    nodes: tuple[Node, ...]
    channels: Mapping[int, Mapping[str, Sampler]]  # node -> path -> sampler
    duration: float  # seconds


def clip_names(glb: Glb) -> list[str]:
    """A name for every animation; one without a name, or with one already taken, is `animation_INDEX`."""
    names: list[str] = []
    for index, animation in enumerate(glb.entries("animations")):
        name = animation.get("name")
        usable = isinstance(name, str) and name and name not in names
        names.append(str(name) if usable else f"animation_{index}")
    return names


def read_clip(glb: Glb, name: str) -> Clip:
    """The clip `name`. Raises AvatarError if the file has none of that name, or it is damaged."""
    names = clip_names(glb)
    if name not in names:
        raise no_such("clip of this file", name, names, file=glb.source)
    index = names.index(name)
    field, animation = f"animations[{index}]", glb.entries("animations")[index]
    nodes = _nodes(glb)
    samplers = objects(glb, animation, "samplers", f"{field}.")
    channels: dict[int, dict[str, Sampler]] = {}
    for at, channel in enumerate(objects(glb, animation, "channels", f"{field}.")):
        where = f"{field}.channels[{at}]"
        target = channel.get("target")
        if not isinstance(target, dict):
            raise glb.error("needs a target", where)
        if "node" not in target:
            continue  # what it moves is an extension's business
        glb.entry("nodes", target["node"], where)
        node, path = target["node"], target.get("path")
        if not isinstance(path, str) or path not in PATHS:
            raise glb.error(f"path {shown(path)} is none of {', '.join(PATHS)}", where)
        if path in channels.setdefault(node, {}):
            raise glb.error(f"moves the {path} of node {node} a second time", where)
        if path != "weights" and nodes[node].matrix is not None:
            raise glb.error(f"moves node {node}, which has a matrix", where)
        number = natural(glb, channel, "sampler", where)
        if number >= len(samplers):
            raise glb.error(f"sampler {number} of {len(samplers)}", where)
        channels[node][path] = _sampler(glb, samplers[number], path, len(nodes[node].targets), where)
    ends = [float(s.times[-1]) for moved in channels.values() for s in moved.values()]
    return Clip(name, nodes, channels, max(ends, default=0.0))


def _sampler(glb: Glb, entry: dict[str, Any], path: str, targets: int, field: str) -> Sampler:
    kind = entry.get("interpolation", "LINEAR")
    if not isinstance(kind, str) or kind not in INTERPOLATIONS:
        raise glb.error(f"interpolation {shown(kind)} is none of {', '.join(INTERPOLATIONS)}", field)
    times = accessor(glb, entry.get("input"), "SCALAR", field)[:, 0]
    if not np.isfinite(times).all() or times[0] < 0 or (np.diff(times) <= 0).any():
        raise glb.error("key times must be finite, not negative and strictly rise", field)
    values = accessor(glb, entry.get("output"), PATHS[path], field)
    if not np.isfinite(values).all():
        raise glb.error("values must be finite", field)
    per_key = (3 if kind == "CUBICSPLINE" else 1) * (targets if path == "weights" else 1)
    if per_key == 0 or len(values) != len(times) * per_key:
        raise glb.error(f"{len(values)} values for {len(times)} keys of {per_key}", field)
    width = targets if path == "weights" else values.shape[1]
    values = (
        values.reshape(len(times), 3, width) if kind == "CUBICSPLINE" else values.reshape(len(times), width)
    )
    rotation = path == "rotation"
    return Sampler(times, unit(values) if rotation and kind != "CUBICSPLINE" else values, kind, rotation)


def _nodes(glb: Glb) -> tuple[Node, ...]:
    entries = glb.entries("nodes")
    parents = [-1] * len(entries)
    for index, entry in enumerate(entries):
        children = entry.get("children", [])
        if not isinstance(children, list):
            raise glb.error("must be a list", f"nodes[{index}].children")
        for child in children:
            glb.entry("nodes", child, f"nodes[{index}].children")
            if parents[child] >= 0:
                raise glb.error(f"node {child} has two parents", f"nodes[{index}].children")
            parents[child] = index
    _check_no_loop(glb, parents)
    return tuple(_node(glb, entry, index, parents[index]) for index, entry in enumerate(entries))


def _check_no_loop(glb: Glb, parents: list[int]) -> None:
    """A node that is above itself would never end a walk upwards."""
    rooted = [False] * len(parents)
    for index in range(len(parents)):
        walk: list[int] = []
        at = index
        while at >= 0 and not rooted[at]:
            if len(walk) > len(parents):
                raise glb.error("is its own ancestor", f"nodes[{index}]")
            walk.append(at)
            at = parents[at]
        for node in walk:
            rooted[node] = True


def _node(glb: Glb, entry: dict[str, Any], index: int, parent: int) -> Node:
    field = f"nodes[{index}]"
    name = entry.get("name")
    matrix = None
    if "matrix" in entry:
        matrix = numbers(glb, entry, "matrix", tuple(np.eye(4).ravel()), field).reshape(4, 4).T
    rest = {key: numbers(glb, entry, key, default, field) for key, default in DEFAULTS.items()}
    rest["rotation"] = unit(rest["rotation"][None])[0]
    return Node(name if isinstance(name, str) else "", parent, matrix, rest, _targets(glb, entry, field))


def _targets(glb: Glb, node: dict[str, Any], field: str) -> tuple[str, ...]:
    """Names of the morph targets of a node's mesh; one without a name is empty."""
    if "mesh" not in node:
        return ()
    mesh = glb.entry("meshes", node["mesh"], field)
    primitives = objects(glb, mesh, "primitives", f"meshes[{node['mesh']}].")
    count = len(objects(glb, primitives[0], "targets", f"meshes[{node['mesh']}].")) if primitives else 0
    extras = mesh.get("extras")
    names = extras.get("targetNames") if isinstance(extras, dict) else None
    if not isinstance(names, list) or len(names) != count:
        return ("",) * count
    return tuple(name if isinstance(name, str) else "" for name in names)
