"""A small skinned, morphed, animated character as an ASCII .fbx, and where its vertices should be.

Z up, centimetres, facing -Y, as 3ds Max and Blender write: a strip of quads on two joints, one blend shape, an
animation that turns the upper joint. Nothing of the reader is used.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
SECOND = 46186158000  # FBX ticks
ROWS = 6
# name -> (parent, translation cm, rotation degrees x y z)
JOINTS: dict[str, tuple[str | None, tuple[float, ...], tuple[float, ...]]] = {
    "hip": (None, (3.0, 1.0, 10.0), (0.0, 0.0, 20.0)),
    "link": ("hip", (0.0, 2.0, 15.0), (10.0, 0.0, 0.0)),  # carries no weight
    "head": ("link", (0.0, 0.0, 20.0), (0.0, 30.0, 0.0)),
}
BONES = ("hip", "head")
TURN = (0.0, 30.0, 90.0)  # of head at the end of the clip, from JOINTS' at its start


@dataclass(frozen=True)
class Settings:
    """What a file may say otherwise."""

    right: tuple[int, int] = (0, 1)  # axis, sign
    meshes: int = 1
    second_bind_offset: float = 0.0  # cm, of the second mesh's bind pose
    weight: float = 1.0


def vertices() -> Array:
    """Control points [2 ROWS, 3], cm in the mesh's own space."""
    z = np.arange(ROWS) * 9.0
    left = np.stack([np.full(ROWS, -4.0), 0.3 * z, z], axis=1)
    return np.concatenate([left, left + np.array([9.0, 1.0, 0.5])])


def quads() -> Array:
    a = np.arange(ROWS - 1)
    return np.stack([a, a + ROWS, a + ROWS + 1, a + 1], axis=1)


def weights() -> dict[str, Array]:
    """Bone -> weight of each vertex; they add up to 1."""
    upper = np.clip(np.tile(np.arange(ROWS) / (ROWS - 1) * 1.4 - 0.2, 2), 0, 1)
    return {"hip": 1 - upper, "head": upper}


def shape() -> tuple[Array, Array]:
    """(vertices, offsets cm) of the blend shape at full weight."""
    return np.array([4, 5, 11]), np.array([[0, -2.0, 0], [1.0, -3.0, 0.5], [0, 0, 4.0]])


def rotation(degrees: Iterable[float]) -> Array:
    """FBX's order XYZ: about X first."""
    x, y, z = np.radians(list(degrees))
    about_x = [[1, 0, 0], [0, np.cos(x), -np.sin(x)], [0, np.sin(x), np.cos(x)]]
    about_y = [[np.cos(y), 0, np.sin(y)], [0, 1, 0], [-np.sin(y), 0, np.cos(y)]]
    about_z = [[np.cos(z), -np.sin(z), 0], [np.sin(z), np.cos(z), 0], [0, 0, 1]]
    return np.array(about_z) @ np.array(about_y) @ np.array(about_x)


def mesh_world() -> Array:
    """World from the mesh's space [4, 4], cm."""
    result = np.eye(4)
    result[:3, :3] = rotation((0, 0, 15))
    result[:3, 3] = (1.0, 0.5, 2.0)
    return result


def joint_worlds(share: float = 0.0) -> dict[str, Array]:
    """World from joint [4, 4], cm, at a share of the clip."""
    worlds: dict[str, Array] = {}
    for name, (parent, translation, degrees) in JOINTS.items():
        local = np.eye(4)
        if name == "head":
            degrees = tuple(np.array(degrees) + share * (np.array(TURN) - degrees))
        local[:3, :3] = rotation(degrees)
        local[:3, 3] = translation
        worlds[name] = worlds[parent] @ local if parent else local
    return worlds


def in_metres(points: Array) -> Array:
    """Z up, facing -Y, cm -> Y up, facing +Z, metres."""
    return np.stack([points[..., 0], points[..., 2], -points[..., 1]], axis=-1) / 100


def posed(share: float, open_weight: float) -> Array:
    """Vertices [2 ROWS, 3] in metres, skinned one by one."""
    points = vertices()
    rows, offsets = shape()
    points[rows] += open_weight * offsets
    rest, now, world = joint_worlds(), joint_worlds(share), mesh_world()
    result = np.zeros_like(points)
    for v, point in enumerate(points):
        at = world @ [*point, 1]
        for bone in BONES:
            result[v] += weights()[bone][v] * (now[bone] @ np.linalg.inv(rest[bone]) @ at)[:3]
    return in_metres(result)


def _list(values: Iterable[float]) -> str:
    numbers = [f"{value:.9g}" for value in values]
    return f"*{len(numbers)} {{\n a: {','.join(numbers)}\n}}"


def _matrix(matrix: Array) -> str:
    return _list(matrix.T.reshape(-1))  # column after column


def _property(name: str, kind: str, *values: float) -> str:
    return f'P: "{name}", "{kind}", "", "A",{",".join(f"{v:.9g}" for v in values)}\n'


def _model(number: int, name: str, kind: str, translation: Iterable[float], degrees: Iterable[float]) -> str:
    properties = _property("Lcl Translation", "Lcl Translation", *translation)
    properties += _property("Lcl Rotation", "Lcl Rotation", *degrees)
    return (
        f'Model: {number}, "Model::{name}", "{kind}" {{\nVersion: 232\nProperties70: {{\n{properties}}}\n}}\n'
    )


def _mesh_objects(first: int, name: str, bind_offset: float, s: Settings) -> tuple[str, str]:
    """(objects, connections) of one skinned mesh, its ids from `first` on."""
    faces = ",".join(f"{a},{b},{c},{-d - 1}" for a, b, c, d in quads())
    rows, offsets = shape()
    bind = np.eye(4)
    bind[0, 3] = bind_offset
    objects = (
        f'Geometry: {first}, "Geometry::{name}", "Mesh" {{\nVertices: {_list(vertices().reshape(-1))}\n'
        f"PolygonVertexIndex: *{4 * len(quads())} {{\n a: {faces}\n}}\n}}\n"
        + _model(first + 1, name, "Mesh", mesh_world()[:3, 3], (0, 0, 15))
        + f'Deformer: {first + 2}, "Deformer::skin", "Skin" {{\nVersion: 101\n}}\n'
        f'Deformer: {first + 3}, "Deformer::blend", "BlendShape" {{\nVersion: 100\n}}\n'
        f'Deformer: {first + 4}, "SubDeformer::blend.jawOpen", "BlendShapeChannel" {{\nVersion: 100\n'
        f"DeformPercent: 0\nFullWeights: {_list([100])}\n}}\n"
        f'Geometry: {first + 5}, "Geometry::jawOpen", "Shape" {{\nIndexes: {_list(rows)}\n'
        f"Vertices: {_list(offsets.reshape(-1))}\n}}\n"
    )
    links = [(first + 1, 0)]
    links += [(first + child, first + parent) for child, parent in ((0, 1), (2, 0), (3, 0), (4, 3), (5, 4))]
    for i, bone in enumerate(BONES):
        weight = weights()[bone] * s.weight
        used = np.flatnonzero(weight)
        link = bind @ joint_worlds()[bone]
        objects += (
            f'Deformer: {first + 10 + i}, "SubDeformer::{bone}", "Cluster" {{\nVersion: 100\n'
            f"Indexes: {_list(used)}\nWeights: {_list(weight[used])}\n"
            f"Transform: {_matrix(np.linalg.inv(link) @ mesh_world())}\nTransformLink: {_matrix(link)}\n}}\n"
        )
        links += [(first + 10 + i, first + 2), (300 + list(JOINTS).index(bone), first + 10 + i)]
    return objects, "".join(f'C: "OO",{child},{parent}\n' for child, parent in links)


def _animation() -> tuple[str, str]:
    """Rotation of `head` and the weight of the blend shape over one second, linear."""

    def curve(number: int, begin: float, end: float) -> str:
        return (
            f'AnimationCurve: {number}, "AnimCurve::", "" {{\nDefault: 0\nKeyVer: 4008\n'
            f"KeyTime: *2 {{\n a: 0,{SECOND}\n}}\nKeyValueFloat: {_list([begin, end])}\n"
            "KeyAttrFlags: *1 {\n a: 4\n}\nKeyAttrDataFloat: *4 {\n a: 0,0,0,0\n}\n"
            "KeyAttrRefCount: *1 {\n a: 2\n}\n}\n"
        )

    objects = (
        'AnimationStack: 900, "AnimStack::nod", "" {\nProperties70: {\n'
        f'P: "LocalStart", "KTime", "Time", "",0\nP: "LocalStop", "KTime", "Time", "",{SECOND}\n}}\n}}\n'
        'AnimationLayer: 901, "AnimLayer::base", "" {\n}\n'
        'AnimationCurveNode: 902, "AnimCurveNode::R", "" {\nProperties70: {\n'
        + _property("d|X", "Number", 0) + _property("d|Y", "Number", 30) + _property("d|Z", "Number", 0)
        + '}\n}\nAnimationCurveNode: 903, "AnimCurveNode::DeformPercent", "" {\nProperties70: {\n'
        + _property("d|DeformPercent", "Number", 0) + "}\n}\n"
        + curve(904, 0, 0) + curve(905, 30, 30) + curve(906, 0, 90) + curve(907, 0, 50)
    )  # fmt: skip
    head = 300 + list(JOINTS).index("head")
    links = 'C: "OO",901,900\nC: "OO",902,901\nC: "OO",903,901\n'
    links += f'C: "OP",902,{head}, "Lcl Rotation"\nC: "OP",903,504, "DeformPercent"\n'
    links += "".join(f'C: "OP",{904 + i},902, "d|{axis}"\n' for i, axis in enumerate("XYZ"))
    return objects, links + 'C: "OP",907,903, "d|DeformPercent"\n'


def fbx(s: Settings = Settings()) -> bytes:
    """The file."""
    axes = {"UpAxis": (2, 1), "FrontAxis": (1, -1), "CoordAxis": s.right}
    settings = "".join(
        f'P: "{name}{end}", "int", "Integer", "",{value}\n'
        for name, pair in axes.items()
        for end, value in zip(("", "Sign"), pair, strict=True)
    )
    settings += 'P: "UnitScaleFactor", "double", "Number", "",1\n'
    objects = connections = ""
    for i, (name, (parent, translation, degrees)) in enumerate(JOINTS.items()):
        objects += _model(300 + i, name, "LimbNode", translation, degrees)
        connections += f'C: "OO",{300 + i},{300 + list(JOINTS).index(parent) if parent else 0}\n'
    for i in range(s.meshes):
        made = _mesh_objects(500 + 100 * i, f"mesh{i}", s.second_bind_offset * i, s)
        objects, connections = objects + made[0], connections + made[1]
    made = _animation()
    objects, connections = objects + made[0], connections + made[1]
    return (
        "; FBX 7.4.0 project file\nFBXHeaderExtension:  {\nFBXHeaderVersion: 1003\nFBXVersion: 7400\n}\n"
        f"GlobalSettings:  {{\nVersion: 1000\nProperties70:  {{\n{settings}}}\n}}\n"
        f"Objects:  {{\n{objects}}}\nConnections:  {{\n{connections}}}\n"
    ).encode()
