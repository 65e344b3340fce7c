"""A small avatar in LAM's layout, written with plyfile, with every way glTF has to say things:

joints listed child first, a scaled and turned armature above them, a node between two joints, sparse and
dense morph targets, two sets of weights with one joint in both.
"""

from __future__ import annotations

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from plyfile import PlyData, PlyElement

from tests.exporter.glb_files import Builder

COUNT = 64
MORPHS = ("eyeBlinkLeft", "jawOpen", "mouthSmileLeft")
JOINTS = ("head", "jaw", "neck", "spine")  # order in the skin
PLY_NAMES = (
    *("x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity"),
    *("scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"),
)  # fmt: skip
# name: parent, translation, rotation xyzw, scale
NODES: dict[str, tuple[str | None, Any, Any, Any]] = {
    "armature": (None, (0.1, 0, 0), (np.sqrt(0.5), 0, 0, np.sqrt(0.5)), (0.01, 0.01, 0.01)),
    "spine": ("armature", (0, 5, -100), (-np.sqrt(0.5), 0, 0, np.sqrt(0.5)), (1, 1, 1)),
    "neck": ("spine", (0, 40, 2), (0.05, 0, 0, np.sqrt(1 - 0.0025)), (1, 1.0001, 1)),
    "twist": ("neck", (0, 3, 0), (0, 0.6, 0, 0.8), (1, 1, 1)),
    "head": ("twist", (0, 9, 1), (0, -0.6, 0, 0.8), (1, 1, 1)),
    "jaw": ("head", (0, 1, 4), (0.1, 0, 0, np.sqrt(0.99)), (1, 1, 1)),
}


def node_worlds() -> dict[str, np.ndarray]:
    """world_from_node of NODES."""
    worlds: dict[str, np.ndarray] = {}
    for name, (parent, translation, (x, y, z, w), scale) in NODES.items():
        local = np.eye(4)
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        local[:3, :3] = (np.eye(3) + 2 * w * cross + 2 * cross @ cross) * scale
        local[:3, 3] = translation
        worlds[name] = worlds[parent] @ local if parent else local
    return worlds


def skin_glb(*, bind_offset: float = 0.0) -> bytes:
    """skin.glb; `bind_offset` metres between bind and node pose."""
    rng = np.random.default_rng(11)
    vertices = rng.normal([0, 1.6, 0], 0.1, (COUNT, 3)).astype("<f4")
    faces = rng.permutation(np.arange(COUNT * 3) % COUNT).astype("<u2")
    morphs = rng.normal(0, 0.01, (len(MORPHS), COUNT, 3)).astype("<f4")
    morphs[:, ::3] = 0
    weights = rng.dirichlet(np.ones(8), COUNT).astype("<f4")
    weights[:, 2] = 0
    weights[: COUNT // 2, 4:] = 0
    weights = (weights / weights.sum(1, keepdims=True)).astype("<f4")
    joints = rng.integers(0, len(JOINTS), (COUNT, 8)).astype("u1")
    shift = np.eye(4)
    shift[0, 3] = bind_offset
    bind = np.stack([np.linalg.inv(shift @ node_worlds()[name]) for name in JOINTS])
    names, build = list(NODES), Builder()
    attributes = {"POSITION": build.add(vertices, "VEC3")}
    for k in range(2):
        attributes[f"JOINTS_{k}"] = build.add(joints[:, 4 * k : 4 * k + 4], "VEC4")
        attributes[f"WEIGHTS_{k}"] = build.add(weights[:, 4 * k : 4 * k + 4], "VEC4")
    targets = [build.add(morphs[0], "VEC3"), *map(build.add_sparse, morphs[1:])]
    primitive = {"attributes": attributes, "indices": build.add(faces, "SCALAR")}
    primitive["targets"] = [{"POSITION": target} for target in targets]
    nodes = [
        {"name": name, "translation": t, "rotation": r, "scale": s,
         "children": [i for i, child in enumerate(names) if NODES[child][0] == name]}
        for name, (_, t, r, s) in NODES.items()
    ]  # fmt: skip
    inverse = build.add(bind.transpose(0, 2, 1), "MAT4", "<f4")
    build.document |= {
        "nodes": [*nodes, {"name": "mesh", "mesh": 0, "skin": 0, "translation": [5, 5, 5]}],
        "scenes": [{"nodes": [0, len(nodes)]}],
        "meshes": [{"primitives": [primitive], "extras": {"targetNames": list(MORPHS)}}],
        "skins": [{"joints": [names.index(joint) for joint in JOINTS], "inverseBindMatrices": inverse}],
    }
    return build.data()


def offset_ply(**changes: Any) -> bytes:
    """offset.ply; `changes` maps a property to its [COUNT] values, None leaves it out."""
    rng = np.random.default_rng(12)
    columns = {name: rng.normal(0, 0.05, COUNT) for name in PLY_NAMES}
    columns |= {name: np.zeros(COUNT) for name in ("nx", "ny", "nz")}
    columns |= {f"f_dc_{k}": rng.uniform(0, 1, COUNT) for k in range(3)}
    columns |= {f"scale_{k}": rng.normal(-6, 1, COUNT) for k in range(3)}
    quat = rng.normal(size=(COUNT, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    columns |= {f"rot_{k}": quat[:, k] for k in range(4)}
    columns = {name: values for name, values in (columns | changes).items() if values is not None}
    rows = np.zeros(len(next(iter(columns.values()))), [(name, "<f4") for name in columns])
    for name, values in columns.items():
        rows[name] = values
    stream = io.BytesIO()
    PlyData([PlyElement.describe(rows, "vertex")], byte_order="<").write(stream)
    return stream.getvalue()


def files(**replaced: bytes | None) -> dict[str, bytes]:
    """Names and bytes of the files; an argument `offset`, `skin`, ... replaces one, None drops it."""
    names = {"offset": "offset.ply", "skin": "skin.glb", "animation": "animation.glb"}
    names |= {"vertex_order": "vertex_order.json", "expressions": "bsData.json"}
    whole: dict[str, bytes | None] = {"vertex_order": b"[3, 1, 2]"}
    whole |= replaced
    for key, make in (("offset", offset_ply), ("skin", skin_glb)):
        if key not in whole:
            whole[key] = make()
    return {names[key]: data for key, data in whole.items() if data is not None}


def write_zip(path: Path, contents: dict[str, bytes], folder: str = "someone/") -> Path:
    """A zip of `contents` in `folder`, with the litter that macOS adds."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, data in contents.items():
            archive.writestr(folder + name, data)
            archive.writestr(f"__MACOSX/{folder}._{name}", b"litter")
    return path
