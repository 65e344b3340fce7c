"""Rigs of glTF files: a real one against its own nodes, a made one in every variation, bad ones by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from avatar_export.rigs.gltf_rig import GltfRig, read_rig
from avatar_runtime.codec import glb
from avatar_runtime.pose import PoseArrays
from avatar_runtime.stages.joints import joints
from avatar_runtime.stages.skin import skin
from tests.exporter.glb_files import edited
from tests.exporter.readers import lam_files
from tests.exporter.readers.lam_files import skin_glb
from tests.exporter.refusals import refused

REAL = Path(__file__).parents[3] / "samples" / "data" / "CesiumMan.glb"


def _rig(data: bytes) -> GltfRig:
    return read_rig(glb.decode(data, "rig.glb"))


def _skin_matrices(found: GltfRig, deltas: Any = None) -> np.ndarray:
    j = found.rig.joint_count
    delta = np.tile(np.eye(4), (j, 1, 1))
    for name, matrix in (deltas or {}).items():
        delta[found.rig.joint_names.index(name)] = matrix
    none = np.zeros(0, np.float32)
    weights = np.zeros(len(found.morph_names), np.float32)
    return joints(found.rig, PoseArrays(weights, none, delta, np.eye(4))).skin_matrix


def test_made_rig() -> None:
    found = _rig(skin_glb())
    rig = found.rig
    assert rig.joint_names == ("spine", "neck", "head", "jaw")  # parents first, not the skin's order
    assert rig.parents.tolist() == [-1, 0, 1, 2]  # "twist" between neck and head is not a joint
    rest = [lam_files.node_worlds()[name] for name in rig.joint_names]
    np.testing.assert_allclose(rig.rest_local[0], rest[0], atol=1e-6)  # with the armature's scale
    np.testing.assert_allclose(rig.rest_local[2], np.linalg.inv(rest[1]) @ rest[2], atol=1e-5)
    assert found.rest_deviation < 1e-5 and not found.node_pose and not found.renormalised
    np.testing.assert_allclose(_skin_matrices(found), np.tile(np.eye(4), (4, 1, 1)), atol=2e-6)
    assert (rig.skin.values["weight"] > 0).all()


def test_binding_pose_is_the_mesh_as_stored() -> None:
    """Nodes 0.2 m beside the bind pose: at rest nothing moves, in `node_pose` everything moves by 0.2 m."""
    found = _rig(skin_glb(bind_offset=0.2))
    assert found.rest_deviation == pytest.approx(0.2, abs=1e-5)
    np.testing.assert_allclose(_skin_matrices(found), np.tile(np.eye(4), (4, 1, 1)), atol=2e-6)
    moved = _skin_matrices(found, found.node_pose)
    np.testing.assert_allclose(moved[:, :3, 3], np.tile([-0.2, 0, 0], (4, 1)), atol=5e-6)


def test_real_rig_in_its_node_pose() -> None:
    """CesiumMan stands upright only by its nodes; joint globals come from trimesh's scene graph."""
    document = glb.decode(REAL.read_bytes(), REAL.name)
    found, graph = read_rig(document), trimesh.load(REAL).graph
    bind = glb.accessor(document, document.document["skins"][0]["inverseBindMatrices"])
    order = [document.document["nodes"][n]["name"] for n in document.document["skins"][0]["joints"]]
    got = _skin_matrices(found, found.node_pose)
    for name, inverse in zip(order, bind, strict=True):
        np.testing.assert_allclose(
            got[found.rig.joint_names.index(name)], graph.get(name)[0] @ inverse, atol=2e-6
        )
    posed = skin(found.rig, found.rig.vertices, got, np.zeros(0, np.float32))
    assert np.argmax(np.ptp(posed, axis=0)) == 1 and np.argmax(np.ptp(found.rig.vertices, axis=0)) == 2


Document = dict[str, Any]
Change = Callable[[Document], Any]


def _primitive(change: Change) -> Change:
    return lambda document: change(document["meshes"][0]["primitives"][0])


def _node(node: str, /, **values: Any) -> Change:
    return lambda document: next(n for n in document["nodes"] if n["name"] == node).update(values)


def _accessor(at: Callable[[Document], int], **values: Any) -> Change:
    return lambda document: document["accessors"][at(document["meshes"][0]["primitives"][0])].update(values)


def _shared_targets(document: Document) -> None:
    primitive = document["meshes"][0]["primitives"][0]
    primitive["targets"] = primitive["targets"][:1] * 999
    document["meshes"][0]["extras"]["targetNames"] = [str(i) for i in range(999)]


def _deepen(document: Document) -> None:
    """Twelve scaled nodes above the armature: 1e29 to the twelfth is beyond float64."""
    first = len(document["nodes"])
    for i in range(12):
        document["nodes"].append({"scale": [1e29] * 3, "children": [first + i + 1 if i < 11 else 0]})


BAD: list[tuple[Change, str]] = [
    (lambda d: next(n for n in d["nodes"] if n["name"] == "mesh").pop("skin"), "no node has a mesh and a skin"),
    (lambda d: d["nodes"].append({"mesh": 0, "skin": 0}), r"2 nodes have a mesh and a skin \(mesh, unnamed\)"),
    (_node("mesh", mesh=4), r"meshes\[4\]: does not exist"),
    (lambda d: d["meshes"][0]["primitives"].append({}), "has 2 primitives, expected one"),
    (_primitive(lambda p: p.update(mode=5)), "mode: is 5"),
    (_primitive(lambda p: p.update(extensions={"KHR_draco_mesh_compression": {}})), "compression"),
    (_primitive(lambda p: p["attributes"].pop("POSITION")), "attributes.POSITION: is missing"),
    (_accessor(lambda p: 0, type="VEC2"), r"expected \[V, 3\]"),
    (_primitive(lambda p: p["attributes"].pop("WEIGHTS_0")), "WEIGHTS_0: is missing"),
    (_primitive(lambda p: p["attributes"].update(JOINTS_0=2)), "JOINTS_0: is float32"),
    (lambda d: d["skins"][0]["joints"].pop(3), "but the skin has 3 joints"),
    (lambda d: d["skins"][0]["joints"].__setitem__(0, 1), "does not exist, or a node twice"),
    (lambda d: d["skins"][0].update(joints=[]), "is not a list of 1 to"),
    (_accessor(lambda p: p["indices"], count=100), "has 100 values of type uint16, which are not triangles"),
    (lambda d: d["meshes"][0]["extras"]["targetNames"].pop(), "has 2 names for 3 morph targets"),
    (lambda d: d["meshes"][0]["extras"].update(targetNames=["a", "b", "a"]), r"targetNames\[2\]: a .*duplicate"),
    (_accessor(lambda p: p["targets"][0]["POSITION"], count=10), r"targets\[0\].POSITION: has shape \[10, 3\]"),
    (_shared_targets, "shares its data with other targets"),
    (_node("jaw", children=[0]), "contains a loop"),
    (_node("armature", children=[1, 4]), "has two parents"),
    (_node("neck", scale=[1, 0, 1]), "joint neck: has a singular transform"),
    (_node("neck", rotation=[0, 0, 0, 0]), "quaternion of length 0"),
    (_node("neck", scale=[1, "1", 1]), "scale: 1 is not a usable number"),
    (_deepen, "its transform overflows"),
    (_node("neck", matrix=[1.0] * 16), "matrix: is not affine"),
    (_node("jaw", name="head"), "head is not a valid joint name, or a duplicate"),
    (_accessor(lambda p: -1, count=3), r"expected float32\[4, 4, 4\]"),
]  # fmt: skip


@pytest.mark.parametrize(("change", "message"), BAD, ids=[message for _, message in BAD])
def test_bad_rigs(change: Change, message: str) -> None:
    refused(f"^rig.glb: .*{message}", _rig, edited(skin_glb(), change))


def _patched(name: str, row: int, value: float) -> bytes:
    """skin.glb with one row of an attribute, or one index, overwritten."""
    data = bytearray(skin_glb())
    document = glb.decode(bytes(data))
    primitive = document.document["meshes"][0]["primitives"][0]
    index = primitive["indices"] if name == "indices" else primitive["attributes"][name]
    view = document.document["bufferViews"][document.document["accessors"][index]["bufferView"]]
    code, width = {"POSITION": ("<f4", 12), "WEIGHTS_0": ("<f4", 16), "indices": ("<u2", 2)}[name]
    at = len(data) - len(document.binary) + view["byteOffset"] + row * width
    data[at : at + width] = np.full(width // int(code[2]), value, code).tobytes()
    return bytes(data)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("POSITION", np.nan, "is not finite"),
        *(("WEIGHTS_0", value, "is negative or not finite") for value in (np.inf, -0.5)),
        ("indices", 64, "is 64, but there are 64 vertices"),
        ("WEIGHTS_0", 0.0, "the vertex has no weight"),
    ],
)
def test_bad_numbers(name: str, value: float, message: str) -> None:
    refused(rf"{name}\[5\]: {message}", _rig, _patched(name, 5, value))
