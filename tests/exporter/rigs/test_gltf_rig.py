"""Rigs of glTF files: a real one against its own nodes, a made one in every variation, bad ones by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import trimesh

from avatar_export.rigs.gltf_rig import GltfRig, read_rig
from avatar_runtime.codec import glb
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import PoseArrays
from avatar_runtime.stages.joints import joints
from avatar_runtime.stages.skin import skin
from tests.exporter.readers import lam_files
from tests.exporter.readers.lam_files import edited, skin_glb
from tests.shared_data import shared


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
    worlds = lam_files.node_worlds()
    rest = [worlds[name] for name in rig.joint_names]
    np.testing.assert_allclose(rig.rest_local[0], rest[0], atol=1e-6)  # with the armature's scale
    np.testing.assert_allclose(rig.rest_local[2], np.linalg.inv(rest[1]) @ rest[2], atol=1e-5)
    assert found.rest_deviation < 1e-5 and not found.node_pose and not found.renormalised
    np.testing.assert_allclose(_skin_matrices(found), np.tile(np.eye(4), (4, 1, 1)), atol=2e-6)
    sums = np.add.reduceat(rig.skin.values["weight"], rig.skin.row_ptr[:-1].astype(int))
    np.testing.assert_allclose(sums, 1, atol=1e-5)
    assert (rig.skin.values["weight"] > 0).all()


def test_morphs_and_weights_entry_by_entry() -> None:
    data = skin_glb()
    found, document = _rig(data), glb.decode(data)
    mesh = document.document["meshes"][0]["primitives"][0]
    dense = np.zeros((lam_files.COUNT, 3, 3), np.float32)
    weights = np.zeros((lam_files.COUNT, 4))
    morphs, weight = found.rig.morphs, found.rig.skin
    for i in range(lam_files.COUNT):
        for e in range(morphs.row_ptr[i], morphs.row_ptr[i + 1]):
            dense[i, morphs.column[e]] = morphs.values["position"][e]
        for e in range(weight.row_ptr[i], weight.row_ptr[i + 1]):
            weights[i, weight.column[e]] = weight.values["weight"][e]
    for k, target in enumerate(mesh["targets"]):
        assert np.array_equal(dense[:, k], glb.accessor(document, target["POSITION"]))
    assert morphs.entries < lam_files.COUNT * 3, "rows that do not move hold no entry"
    order = [found.rig.joint_names.index(name) for name in lam_files.JOINTS]
    want = np.zeros_like(weights)
    for n in range(2):
        joint, share = (
            glb.accessor(document, mesh["attributes"][f"{kind}_{n}"]) for kind in ("JOINTS", "WEIGHTS")
        )
        for i in range(lam_files.COUNT):
            for j, w in zip(joint[i], share[i], strict=True):
                want[i, order[j]] += w
    np.testing.assert_allclose(weights, want, atol=1e-7)


def test_weights_off_one_are_divided_by_their_sum() -> None:
    found, whole = _rig(skin_glb(weight_factor=0.5)), _rig(skin_glb())
    assert found.renormalised == lam_files.COUNT
    np.testing.assert_allclose(found.rig.skin.values["weight"], whole.rig.skin.values["weight"], rtol=1e-6)


def test_binding_pose_is_the_mesh_as_stored() -> None:
    """Nodes 0.2 m beside the bind pose: at rest nothing moves, in `node_pose` everything moves by 0.2 m."""
    found = _rig(skin_glb(bind_offset=0.2))
    assert found.rest_deviation == pytest.approx(0.2, abs=1e-5)
    np.testing.assert_allclose(_skin_matrices(found), np.tile(np.eye(4), (4, 1, 1)), atol=2e-6)
    moved = _skin_matrices(found, found.node_pose)
    np.testing.assert_allclose(moved[:, :3, 3], np.tile([-0.2, 0, 0], (4, 1)), atol=5e-6)


def test_real_rig_in_its_node_pose() -> None:
    """CesiumMan stands upright only by its nodes; joint globals come from trimesh's scene graph."""
    path = shared("gltf/CesiumMan.glb")
    document = glb.decode(path.read_bytes(), path.name)
    found = read_rig(document)
    graph = trimesh.load(path).graph
    bind = glb.accessor(document, document.document["skins"][0]["inverseBindMatrices"])
    order = [document.document["nodes"][n]["name"] for n in document.document["skins"][0]["joints"]]
    got = _skin_matrices(found, found.node_pose)
    for name, inverse in zip(order, bind, strict=True):
        want = graph.get(name)[0] @ inverse
        np.testing.assert_allclose(got[found.rig.joint_names.index(name)], want, atol=2e-6)
    posed = skin(found.rig, found.rig.vertices, got, np.zeros(0, np.float32))
    assert np.argmax(np.ptp(posed, axis=0)) == 1 and np.argmax(np.ptp(found.rig.vertices, axis=0)) == 2


Change = Callable[[dict[str, Any]], Any]


def _primitive(document: dict[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = document["meshes"][0]["primitives"][0]
    return found


def _node(document: dict[str, Any], name: str) -> dict[str, Any]:
    return next(n for n in document["nodes"] if n["name"] == name)


def _pop(owner: dict[str, Any], key: str) -> None:
    owner.pop(key)


BAD: dict[str, tuple[Change, str]] = {
    "no skinned mesh": (lambda d: _pop(_node(d, "mesh"), "skin"), "no node has a mesh and a skin"),
    "two skinned meshes": (
        lambda d: d["nodes"].append({"mesh": 0, "skin": 0}),
        "2 nodes have a mesh and a skin (mesh, unnamed)",
    ),
    "no such mesh": (lambda d: _node(d, "mesh").update(mesh=4), "meshes[4]: does not exist"),
    "two primitives": (lambda d: d["meshes"][0]["primitives"].append({}), "has 2 primitives, expected one"),
    "primitives no list": (lambda d: d["meshes"][0].update(primitives={}), "has 0 primitives, expected one"),
    "strips": (lambda d: _primitive(d).update(mode=5), "mode: is 5"),
    "draco": (lambda d: _primitive(d).update(extensions={"KHR_draco_mesh_compression": {}}), "compression"),
    "draco required": (
        lambda d: d.update(extensionsRequired=["KHR_draco_mesh_compression"]),
        "KHR_draco_mesh_compression cannot be read",
    ),
    "no positions": (
        lambda d: _pop(_primitive(d)["attributes"], "POSITION"),
        "attributes.POSITION: is missing",
    ),
    "positions of two": (lambda d: d["accessors"][0].update(type="VEC2"), "expected [V, 3]"),
    "no weights": (lambda d: _pop(_primitive(d)["attributes"], "WEIGHTS_0"), "WEIGHTS_0: is missing"),
    "weights as joints": (lambda d: _primitive(d)["attributes"].update(JOINTS_0=2), "JOINTS_0: is float32"),
    "joint out of range": (lambda d: _pop(d["skins"][0]["joints"], 3), "but the skin has 3 joints"),
    "joint twice": (
        lambda d: d["skins"][0]["joints"].__setitem__(0, 1),
        "names a node that does not exist, or a node twice",
    ),
    "joint that is not a node": (
        lambda d: d["skins"][0]["joints"].__setitem__(0, 99),
        "names a node that does not exist",
    ),
    "no joints": (lambda d: d["skins"][0].update(joints=[]), "is not a list of 1 to"),
    "no whole triangles": (
        lambda d: d["accessors"][_primitive(d)["indices"]].update(count=100),
        "has 100 values of type uint16, which are not triangles",
    ),
    "a name too few": (
        lambda d: d["meshes"][0]["extras"]["targetNames"].pop(),
        "has 2 names for 3 morph targets",
    ),
    "no names": (lambda d: d["meshes"][0].pop("extras"), "has 0 names for 3"),
    "a name twice": (
        lambda d: d["meshes"][0]["extras"].update(targetNames=["a", "b", "a"]),
        "targetNames[2]: a is not a name, or a duplicate",
    ),
    "another count in a target": (
        lambda d: d["accessors"][_primitive(d)["targets"][0]["POSITION"]].update(count=10),
        "targets[0].POSITION: has shape [10, 3], expected [64, 3]",
    ),
    "targets that share data": (
        lambda d: (
            _primitive(d).update(targets=_primitive(d)["targets"][:1] * 999),
            d["meshes"][0]["extras"].update(targetNames=[str(i) for i in range(999)]),
        ),
        "shares its data with other targets",
    ),
    "loop": (lambda d: _node(d, "jaw").update(children=[0]), "contains a loop"),
    "two parents": (lambda d: _node(d, "armature")["children"].append(4), "has two parents"),
    "child that does not exist": (
        lambda d: _node(d, "jaw").update(children=[-1]),
        "children: is not a list of nodes",
    ),
    "scale of zero": (
        lambda d: _node(d, "neck").update(scale=[1, 0, 1]),
        "joint neck: has a singular transform",
    ),
    "quaternion of zero": (
        lambda d: _node(d, "neck").update(rotation=[0, 0, 0, 0]),
        "quaternion of length 0",
    ),
    "text for a number": (
        lambda d: _node(d, "neck").update(scale=[1, "1", 1]),
        "scale: 1 is not a usable number",
    ),
    "true for a number": (
        lambda d: _node(d, "neck").update(scale=[1, True, 1]),
        "True is not a usable number",
    ),
    "a number too large": (
        lambda d: _node(d, "neck").update(scale=[1, 10**400, 1]),
        "a huge number is not a usable",
    ),
    "overflow": (lambda d: _deepen(d), "its transform overflows"),
    "perspective node": (lambda d: _node(d, "neck").update(matrix=[1.0] * 16), "matrix: is not affine"),
    "joint names alike": (
        lambda d: _node(d, "jaw").update(name="head"),
        "head is not a valid joint name, or a duplicate",
    ),
    "bind matrices too few": (lambda d: d["accessors"][-1].update(count=3), "expected float32[4, 4, 4]"),
    "bind matrices of another type": (
        lambda d: d["skins"][0].update(inverseBindMatrices=0),
        "inverseBindMatrices: is",
    ),
}


def _deepen(document: dict[str, Any]) -> None:
    """Twelve scaled nodes above the armature: 1e29 to the twelfth is beyond float64."""
    first = len(document["nodes"])
    for i in range(12):
        document["nodes"].append({"scale": [1e29] * 3, "children": [first + i + 1 if i < 11 else 0]})


@pytest.mark.parametrize("case", BAD)
def test_bad_rigs_are_named(case: str) -> None:
    change, message = BAD[case]
    with pytest.raises(AvatarError) as caught:
        _rig(edited(skin_glb(), change))
    assert message in str(caught.value)
    assert str(caught.value).startswith("rig.glb: ")


def _patched(name: str, row: int, value: float) -> bytes:
    """skin.glb with one row of an attribute, or one index, overwritten."""
    data = bytearray(skin_glb())
    document = glb.decode(bytes(data))
    primitive = _primitive(dict(document.document))
    index = primitive["indices"] if name == "indices" else primitive["attributes"][name]
    view = document.document["bufferViews"][document.document["accessors"][index]["bufferView"]]
    code, width = {"POSITION": ("<f4", 12), "WEIGHTS_0": ("<f4", 16), "indices": ("<u2", 2)}[name]
    at = len(data) - len(document.binary) + view["byteOffset"] + row * width
    data[at : at + width] = np.full(width // int(code[2]), value, code).tobytes()
    return bytes(data)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("POSITION", np.nan, "attributes.POSITION[5]: is not finite"),
        ("WEIGHTS_0", np.inf, "WEIGHTS_0[5]: is negative or not finite"),
        ("WEIGHTS_0", -0.5, "WEIGHTS_0[5]: is negative or not finite"),
        ("indices", 64, "indices[5]: is 64, but there are 64 vertices"),
        ("WEIGHTS_0", 0.0, "WEIGHTS_0[5]: the vertex has no weight"),
    ],
)
def test_bad_numbers_are_named(name: str, value: float, message: str) -> None:
    with pytest.raises(AvatarError) as caught:
        _rig(_patched(name, 5, value))
    assert message in str(caught.value)
