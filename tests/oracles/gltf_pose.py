"""A posed glTF mesh from the bytes of a .glb alone, in float64, by the formulas of glTF 2.0 (3.5.3, 3.6.2.3, 3.7.2.2,
3.7.3, 3.11). Struct and JSON only; it shares nothing with the code under test.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]

COMPONENT = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


@dataclass
class State:
    """Node transforms and morph weights, by name; others stay as in the file."""

    translation: dict[str, Sequence[float]] = field(default_factory=dict)
    rotation: dict[str, Sequence[float]] = field(default_factory=dict)  # x y z w
    scale: dict[str, Sequence[float]] = field(default_factory=dict)
    weights: Mapping[str, float] | Sequence[float] = field(default_factory=dict)


class File:
    """A .glb with one mesh."""

    def __init__(self, data: bytes) -> None:
        magic, version, length = struct.unpack_from("<4sII", data)
        assert (magic, version, length) == (b"glTF", 2, len(data))
        size, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON" and size % 4 == 0
        self.json: dict[str, Any] = json.loads(data[20 : 20 + size])
        rest, kind = struct.unpack_from("<I4s", data, 20 + size)
        assert kind == b"BIN\0" and 28 + size + rest == length
        self.binary = data[28 + size :]

    def raw(self, view: int, component: int, count: int, width: int, offset: int = 0) -> Array:
        """[count, width] of a buffer view without stride, as stored."""
        v = self.json["bufferViews"][view]
        assert v["buffer"] == 0 and "byteStride" not in v
        dtype = np.dtype(COMPONENT[component])
        begin = v.get("byteOffset", 0) + offset
        assert begin % 4 == 0 and offset + count * width * dtype.itemsize <= v["byteLength"]
        found: Array = np.frombuffer(self.binary, dtype, count * width, begin)
        return found.reshape(count, width)

    def accessor(self, index: int) -> Array:
        """[count, width], float64 for floats and normalised integers, int64 for others."""
        a = self.json["accessors"][index]
        width, component = WIDTH[a["type"]], a["componentType"]
        if "bufferView" in a:
            stored = self.raw(a["bufferView"], component, a["count"], width, a.get("byteOffset", 0))
        else:
            stored = np.zeros((a["count"], width), COMPONENT[component])
        values = stored.astype(np.float64 if component == 5126 else np.int64)
        if "sparse" in a:
            s = a["sparse"]
            rows = self.raw(s["indices"]["bufferView"], s["indices"]["componentType"], s["count"], 1)[:, 0]
            values[rows] = self.raw(s["values"]["bufferView"], component, s["count"], width)
        return values / np.iinfo(stored.dtype).max if a.get("normalized") else values

    def attribute(self, name: str) -> Array:
        """A vertex attribute of the one primitive."""
        return self.accessor(self.json["meshes"][0]["primitives"][0]["attributes"][name])

    @property
    def triangles(self) -> Array:
        return self.accessor(self.json["meshes"][0]["primitives"][0]["indices"]).reshape(-1, 3)

    @property
    def target_names(self) -> list[str]:
        names: list[str] = self.json["meshes"][0].get("extras", {}).get("targetNames", [])
        return names

    def posed(self, state: State, sets: int = 1) -> Array:
        """[v, 3] in world space, with JOINTS_0 to JOINTS_(sets - 1)."""
        position = self.shaped(state)
        skin = self.json["skins"][0]
        inverse_bind = self.accessor(skin["inverseBindMatrices"]).reshape(-1, 4, 4).transpose(0, 2, 1)
        world = self.world_matrices(state)
        joint = np.array([world[node] for node in skin["joints"]]) @ inverse_bind
        result = np.zeros((len(position), 3))
        point = np.concatenate([position, np.ones((len(position), 1))], axis=1)
        for number in range(sets):
            joints, weight = self.attribute(f"JOINTS_{number}"), self.attribute(f"WEIGHTS_{number}")
            for k in range(4):
                moved = np.einsum("vij,vj->vi", joint[joints[:, k]], point)
                result += weight[:, k, None] * moved[:, :3]
        return result

    def shaped(self, state: State) -> Array:
        """[v, 3] before the skin: at rest and with morph targets."""
        mesh = self.json["meshes"][0]
        position = self.attribute("POSITION").copy()
        weights = state.weights
        if isinstance(weights, Mapping):
            assert set(weights) <= set(self.target_names)
            weights = [weights.get(name, 0.0) for name in self.target_names]
        targets = mesh["primitives"][0].get("targets", [])
        assert len(weights) == len(targets) == len(mesh.get("weights", []))
        for weight, target in zip(weights, targets, strict=True):
            position += weight * self.accessor(target["POSITION"])
        return position

    def world_matrices(self, state: State) -> list[Array]:
        """Of every node, [4, 4]."""
        nodes = self.json["nodes"]
        named = {node["name"] for node in nodes}
        assert {*state.translation, *state.rotation, *state.scale} <= named and len(named) == len(nodes)
        parent = {child: k for k, node in enumerate(nodes) for child in node.get("children", [])}
        local = []
        for node in nodes:
            name, matrix = node["name"], np.eye(4)
            turn = quaternion_matrix(state.rotation.get(name, node.get("rotation", (0, 0, 0, 1))))
            matrix[:3, :3] = turn @ np.diag(state.scale.get(name, node.get("scale", (1, 1, 1))))
            matrix[:3, 3] = state.translation.get(name, node.get("translation", (0, 0, 0)))
            local.append(matrix)
        world = []
        for k in range(len(nodes)):
            matrix, at = local[k], parent.get(k)
            while at is not None:
                matrix, at = local[at] @ matrix, parent.get(at)
            world.append(matrix)
        return world

    def state(self, animation: str, time: float) -> State:
        """What an animation sets at `time`: linear, rotations by slerp."""
        found = State()
        chosen = next(a for a in self.json["animations"] if a["name"] == animation)
        for channel in chosen["channels"]:
            sampler, target = chosen["samplers"][channel["sampler"]], channel["target"]
            assert sampler["interpolation"] == "LINEAR"
            times = self.accessor(sampler["input"])[:, 0]
            values = self.accessor(sampler["output"]).reshape(len(times), -1)
            value = interpolate(times, values, time, target["path"] == "rotation")
            if target["path"] == "weights":
                found.weights = value.tolist()
            else:
                getattr(found, target["path"])[self.json["nodes"][target["node"]]["name"]] = value
        return found


def interpolate(times: Array, values: Array, time: float, spherical: bool) -> Array:
    """Linear or slerp between the keys around `time`; clamped at the ends."""
    after = int(np.clip(np.searchsorted(times, time), 1, len(times) - 1)) if len(times) > 1 else 0
    if after == 0:
        return values[0]
    t = float(np.clip((time - times[after - 1]) / (times[after] - times[after - 1]), 0, 1))
    a, b = values[after - 1], values[after]
    if not spherical:
        return (1 - t) * a + t * b
    dot = float(a @ b)
    angle = np.arccos(min(abs(dot), 1.0))
    if angle < 1e-9:
        return a
    return (np.sin((1 - t) * angle) * a + np.sign(dot) * np.sin(t * angle) * b) / np.sin(angle)


def quaternion_matrix(xyzw: Sequence[float]) -> Array:
    """Rotation of a quaternion, made unit: v' = v + 2 w (u x v) + 2 u x (u x v)."""
    x, y, z, w = np.array(xyzw, np.float64) / np.linalg.norm(xyzw)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross
