"""LAM's rule, literally and slowly, from the bytes of its files; shares no code with what it judges.

x = LBS(v + offset + sum_k w_k morph_k): every vertex one after the other, Python floats (float64), joint
matrices from the glTF nodes as they stand. Rotation, scale, opacity and colour are static (LAM animates
positions only); colour is stored as plain RGB.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

Matrix = list[list[float]]

CODES = {5121: "B", 5123: "H", 5125: "I", 5126: "f"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}


class LamTrainer:
    """One avatar, from the bytes of offset.ply (float properties only) and skin.glb."""

    def __init__(self, offset_ply: bytes, skin_glb: bytes):
        self.splats = _read_ply(offset_ply)
        length = struct.unpack_from("<I", skin_glb, 12)[0]
        self.document = json.loads(skin_glb[20 : 20 + length])
        self.binary = skin_glb[28 + length :]
        self.nodes = self.document["nodes"]
        self.parent = {c: i for i, node in enumerate(self.nodes) for c in node.get("children", ())}
        node = next(n for n in self.nodes if "skin" in n and "mesh" in n)
        self.skin = self.document["skins"][node["skin"]]
        mesh = self.document["meshes"][node["mesh"]]
        primitive = mesh["primitives"][0]
        attributes = primitive["attributes"]
        self.vertices = self._accessor(attributes["POSITION"])
        self.joint_sets = [self._accessor(i) for name, i in sorted(attributes.items()) if "JOINTS_" in name]
        self.weight_sets = [self._accessor(i) for name, i in sorted(attributes.items()) if "WEIGHTS_" in name]
        self.morphs = {
            name: self._accessor(target["POSITION"])
            for name, target in zip(mesh["extras"]["targetNames"], primitive["targets"], strict=True)
        }
        columns = self._accessor(self.skin["inverseBindMatrices"])
        self.inverse_bind = [[[m[4 * j + i] for j in range(4)] for i in range(4)] for m in columns]

    def positions(
        self, weights: Mapping[str, float], deltas: Mapping[str, Any], rows: Iterable[int]
    ) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
        """World positions of `rows`; `deltas` are 4x4, on the right of a joint's own node transform."""
        world = self._worlds(deltas)
        matrices = [
            _multiply(world[n], b) for n, b in zip(self.skin["joints"], self.inverse_bind, strict=True)
        ]
        return np.array([self._position(row, weights, matrices) for row in rows])

    def _position(self, row: int, weights: Mapping[str, float], matrices: list[Matrix]) -> list[float]:
        offset = [self.splats[axis][row] for axis in "xyz"]
        point = [v + o for v, o in zip(self.vertices[row], offset, strict=True)]
        for name, weight in weights.items():
            for axis in range(3):
                point[axis] += weight * self.morphs[name][row][axis]
        result = [0.0, 0.0, 0.0]
        for joints, shares in zip(self.joint_sets, self.weight_sets, strict=True):
            for joint, share in zip(joints[row], shares[row], strict=True):
                if share == 0:
                    continue
                m = matrices[joint]
                for axis in range(3):
                    a = m[axis]
                    moved = a[0] * point[0] + a[1] * point[1] + a[2] * point[2] + a[3]
                    result[axis] += share * moved
        return result

    def _worlds(self, deltas: Mapping[str, Any]) -> dict[int, Matrix]:
        joints = set(self.skin["joints"])
        done: dict[int, Matrix] = {}

        def world(index: int) -> Matrix:
            if index not in done:
                node = self.nodes[index]
                local = _local(node)
                if index in joints and node["name"] in deltas:
                    local = _multiply(local, deltas[node["name"]])
                done[index] = _multiply(world(self.parent[index]), local) if index in self.parent else local
            return done[index]

        for index in joints:
            world(index)
        return done

    def _accessor(self, index: int) -> list[tuple[Any, ...]]:
        a = self.document["accessors"][index]
        code, width = CODES[a["componentType"]], WIDTHS[a["type"]]
        values: list[tuple[Any, ...]] = [(0.0,) * width] * a["count"]
        if "bufferView" in a:
            values = self._elements(a, a["count"], code, width)
        if "sparse" in a:
            s = a["sparse"]
            rows = self._elements(s["indices"], s["count"], CODES[s["indices"]["componentType"]], 1)
            for (row,), value in zip(rows, self._elements(s["values"], s["count"], code, width), strict=True):
                values[row] = value
        if a.get("normalized"):
            top = 255 if code == "B" else 65535
            values = [tuple(v / top for v in value) for value in values]
        return values

    def _elements(self, owner: Mapping[str, Any], count: int, code: str, width: int) -> list[tuple[Any, ...]]:
        view = self.document["bufferViews"][owner["bufferView"]]
        start = view.get("byteOffset", 0) + owner.get("byteOffset", 0)
        layout = struct.Struct(f"<{width}{code}")
        step = view.get("byteStride", layout.size)
        return [layout.unpack_from(self.binary, start + i * step) for i in range(count)]


def _read_ply(data: bytes) -> dict[str, list[float]]:
    header, _, body = data.partition(b"end_header\n")
    lines = header.decode().splitlines()
    names = [line.split()[2] for line in lines if line.startswith("property float ")]
    count = next(int(line.split()[2]) for line in lines if line.startswith("element vertex "))
    rows = list(struct.iter_unpack(f"<{len(names)}f", body))
    assert len(rows) == count
    return {name: [row[i] for row in rows] for i, name in enumerate(names)}


def _local(node: Mapping[str, Any]) -> Matrix:
    if "matrix" in node:
        return [[float(node["matrix"][4 * j + i]) for j in range(4)] for i in range(4)]
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    s = node.get("scale", (1, 1, 1))
    t = node.get("translation", (0, 0, 0))
    r = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return [
        *([r[i][0] * s[0], r[i][1] * s[1], r[i][2] * s[2], float(t[i])] for i in range(3)),
        [0.0, 0.0, 0.0, 1.0],
    ]


def _multiply(a: Sequence[Sequence[float]], b: Sequence[Sequence[float]]) -> Matrix:
    return [[sum(float(a[i][k]) * float(b[k][j]) for k in range(4)) for j in range(4)] for i in range(4)]
