"""A clothed walking man, CesiumMan: seamless mesh, colours from its texture, skin and walk."""

from __future__ import annotations

import io
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pygltflib
from PIL import Image

from avatar_runtime.rotation import matrix_from_quat
from avatar_trainer.head import Mesh, unit
from samples.subjects.head import DATA

Array = npt.NDArray[Any]

PATH: Path = DATA / "CesiumMan.glb"
ATTRIBUTES = ("POSITION", "TEXCOORD_0", "JOINTS_0", "WEIGHTS_0")
COMPONENT = {5121: "u1", 5123: "<u2", 5126: "<f4"}
WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
TEXTURE_SIZE = 512  # pixels; half the file's, so that one pixel is about as wide as a splat


@dataclass(frozen=True)
class Body:
    """The man without seams: V welded vertices in the order of their first row in the file, F triangles, J joints."""

    vertices: (
        Array  # f64 [V, 3], mesh space of the file, which is not upright; only posed vertices are upright
    )
    triangles: Array  # i64 [F, 3], rows in the file's order
    file_vertex: Array  # i64 [V], first row of the file at that place
    uv: Array  # f64 [F, 3, 2] of the triangles' corners
    texture: Array  # f64 [TEXTURE_SIZE, TEXTURE_SIZE, 3], display sRGB, 0..1
    weights: Array  # f64 [V, J]
    document: pygltflib.GLTF2

    @cached_property
    def times(self) -> Array:
        """The walk's key times, seconds; the same for every channel."""
        sampler = self.document.animations[0].samplers[0]
        return values(self.document, sampler.input)[:, 0].astype(np.float64)

    def posed(self, key: int) -> Mesh:
        """The man at one key of his walk: upright, +Y up, walking towards +Z, metres."""
        world = node_matrices(self.document, key)
        skin = self.document.skins[0]
        bind = values(self.document, skin.inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
        matrices = world[skin.joints] @ bind.astype(np.float64)
        blended = np.einsum("vj,jab->vab", self.weights, matrices)
        vertices = np.einsum("vab,vb->va", blended[:, :3, :3], self.vertices) + blended[:, :3, 3]
        return Mesh(vertices, self.triangles)

    def colour(self, face: Array, bary: Array) -> Array:
        """Display sRGB [N, 3] of points on the triangles, from the texture, bilinear."""
        place = np.einsum("nc,ncx->nx", bary, self.uv[face]) * TEXTURE_SIZE - 0.5
        low = np.floor(place).astype(np.int64)
        share = place - low
        result = np.zeros((len(face), 3))
        for dx in (0, 1):
            for dy in (0, 1):
                x, y = (low + np.array([dx, dy])).T % TEXTURE_SIZE
                weight = np.abs(1 - dx - share[:, 0]) * np.abs(1 - dy - share[:, 1])
                result += weight[:, None] * self.texture[y, x]
        return result


def load_body() -> Body:
    """The man of samples/data, rows at one place merged; ValueError if their skin weights differ."""
    document = pygltflib.GLTF2().load(str(PATH))
    primitive = document.meshes[0].primitives[0]
    rows = {name: values(document, getattr(primitive.attributes, name)) for name in ATTRIBUTES}
    corners = values(document, primitive.indices).reshape(-1, 3).astype(np.int64)
    dense = np.zeros((len(rows["POSITION"]), len(document.skins[0].joints)))
    np.add.at(dense, (np.arange(len(dense))[:, None], rows["JOINTS_0"].astype(np.int64)), rows["WEIGHTS_0"])
    file_vertex, welded = weld(rows["POSITION"])
    if not np.array_equal(dense, dense[file_vertex][welded]):
        raise ValueError(f"{PATH.name}: rows at one place have different skin weights")
    view = document.bufferViews[document.images[0].bufferView]
    data = document.binary_blob()[view.byteOffset : view.byteOffset + view.byteLength]
    texture = (
        Image.open(io.BytesIO(data)).convert("RGB").resize((TEXTURE_SIZE, TEXTURE_SIZE), Image.Resampling.BOX)
    )
    return Body(
        vertices=rows["POSITION"][file_vertex].astype(np.float64),
        triangles=welded[corners],
        file_vertex=file_vertex,
        uv=rows["TEXCOORD_0"][corners].astype(np.float64),
        texture=np.asarray(texture, np.float64) / 255,
        weights=dense[file_vertex],
        document=document,
    )


def weld(position: Array) -> tuple[Array, Array]:
    """(first row of each distinct place, in rising order; the number of each row's place)."""
    _, first, place = np.unique(position, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.argsort(order)
    return first[order], rank[place.reshape(-1)]


def values(document: pygltflib.GLTF2, index: int) -> Array:
    """A dense accessor [count, width], decoded."""
    item = document.accessors[index]
    view = document.bufferViews[item.bufferView]
    width, kind = WIDTH[item.type], np.dtype(COMPONENT[item.componentType])
    if view.byteStride not in (None, width * kind.itemsize):
        raise ValueError(f"accessor {index} is interleaved")
    start = (view.byteOffset or 0) + (item.byteOffset or 0)
    flat = np.frombuffer(document.binary_blob(), kind, item.count * width, start)
    return flat.reshape(item.count, width)


def node_matrices(document: pygltflib.GLTF2, key: int) -> Array:
    """World matrices [nodes, 4, 4] with the walk's channels at one of their keys."""
    moved: dict[tuple[int, str], Array] = {}
    animation = document.animations[0]
    for channel in animation.channels:
        output = animation.samplers[channel.sampler].output
        moved[channel.target.node, channel.target.path] = values(document, output)[key].astype(np.float64)
    world = np.tile(np.eye(4), (len(document.nodes), 1, 1))

    def walk(index: int, parent: Array) -> None:
        world[index] = parent @ local_matrix(document.nodes[index], index, moved)
        for child in document.nodes[index].children or []:
            walk(child, world[index])

    for root in document.scenes[document.scene].nodes:
        walk(root, np.eye(4))
    return world


def local_matrix(node: pygltflib.Node, index: int, moved: dict[tuple[int, str], Array]) -> Array:
    """The node's matrix, or its translation, rotation and scale if they are not `moved`."""
    if node.matrix is not None:
        matrix: Array = np.array(node.matrix, np.float64).reshape(4, 4).T
        return matrix
    translation, rotation, scale = (
        moved.get((index, path), np.array(getattr(node, path) or default, np.float64))
        for path, default in (("translation", (0, 0, 0)), ("rotation", (0, 0, 0, 1)), ("scale", (1, 1, 1)))
    )
    out = np.eye(4)
    out[:3, :3] = matrix_from_quat(unit(rotation[[3, 0, 1, 2]])) * scale
    out[:3, 3] = translation
    return out
