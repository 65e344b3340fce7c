"""The LAM sample: the export's members, the offset PLY, a skin at rest, clips by joint name."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path

import numpy as np
import pygltflib
import pytest
from plyfile import PlyData
from samples.make import make_lam
from samples.subjects.head import load_head

from avatar_export.readers.lam import read_lam
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation

GROUND = np.array([0.0, 1.6, 0.0])
MAX_LOGIT = np.float32(6.9067)


@pytest.fixture(scope="module")
def members(lam_zip: Path) -> dict[str, bytes]:
    with zipfile.ZipFile(lam_zip) as zip_:
        return {name: zip_.read(name) for name in zip_.namelist()}


@pytest.fixture(scope="module")
def skin(members: dict[str, bytes]) -> pygltflib.GLTF2:
    return pygltflib.GLTF2.load_from_bytes(members["head/skin.glb"])


def values(doc: pygltflib.GLTF2, index: int) -> np.ndarray:
    """A dense accessor, decoded."""
    item = doc.accessors[index]
    view = doc.bufferViews[item.bufferView]
    kind = {5121: "u1", 5123: "<u2", 5126: "<f4"}[item.componentType]
    width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[item.type]
    data = np.frombuffer(doc.binary_blob(), kind, item.count * width, view.byteOffset)
    return data.reshape(item.count, width)


def test_members(members: dict[str, bytes]) -> None:
    names = ("offset.ply", "skin.glb", "animation.glb", "vertex_order.json")
    assert list(members) == ["head/", *[f"head/{n}" for n in names]]


def test_offset_ply(members: dict[str, bytes], skin: pygltflib.GLTF2) -> None:
    ply = PlyData.read(io.BytesIO(members["head/offset.ply"]))
    assert ply.byte_order == "<" and not ply.text
    v = ply["vertex"].data
    assert v.dtype.names == (
        "x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity",
        "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3",
    )  # fmt: skip
    assert {v.dtype[n].str for n in v.dtype.names} == {"<f4"}
    assert len(v) == skin.accessors[skin.meshes[0].primitives[0].attributes.POSITION].count
    offset = np.stack([v["x"], v["y"], v["z"]], axis=1)
    length = np.linalg.norm(offset, axis=1)
    assert length.min() > 1e-4 and 1e-3 < length.max() < 0.01
    assert all(v[f"f_dc_{i}"].min() >= 0 and v[f"f_dc_{i}"].max() <= 1 for i in range(3))
    assert max(v[f"scale_{i}"].max() for i in range(3)) <= np.float32(np.log(0.01))
    assert np.abs(v["opacity"]).max() <= MAX_LOGIT
    quat = np.stack([v[f"rot_{i}"] for i in range(4)], axis=1)
    np.testing.assert_allclose(np.linalg.norm(quat, axis=1), 1, atol=1e-6)


def test_morph_targets_are_sparse_and_named(skin: pygltflib.GLTF2) -> None:
    mesh = skin.meshes[0]
    names = mesh.extras["targetNames"]
    targets = mesh.primitives[0].targets
    assert len(names) == len(set(names)) == len(targets) == 51
    assert "tongueOut" not in names and "jawOpen" in names
    for target in targets:
        item = skin.accessors[target["POSITION"]]
        assert item.bufferView is None and 0 < item.sparse.count < item.count
        view = skin.bufferViews[item.sparse.indices.bufferView]
        rows = np.frombuffer(skin.binary_blob(), "<u2", item.sparse.count, view.byteOffset).astype(int)
        assert (np.diff(rows) > 0).all() and rows[-1] < item.count


def local_matrix(node: pygltflib.Node) -> np.ndarray:
    x, y, z, w = node.rotation
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    out = np.eye(4)
    out[:3, :3] = rotation * np.array(node.scale)
    out[:3, 3] = node.translation
    return out


def test_the_skin_is_at_rest_under_a_turned_and_scaled_armature(skin: pygltflib.GLTF2) -> None:
    world: dict[int, np.ndarray] = {}

    def walk(index: int, parent: np.ndarray) -> None:
        node = skin.nodes[index]
        world[index] = parent @ local_matrix(node) if node.rotation else parent
        for child in node.children or []:
            walk(child, world[index])

    walk(skin.scenes[0].nodes[0], np.eye(4))
    joints = skin.skins[0].joints
    inverse_bind = values(skin, skin.skins[0].inverseBindMatrices).reshape(-1, 4, 4).transpose(0, 2, 1)
    for joint, bind in zip(joints, inverse_bind, strict=True):
        np.testing.assert_allclose(world[joint] @ bind, np.eye(4), atol=1e-6)
    assert skin.nodes[skin.scenes[0].nodes[0]].scale == [0.01] * 3
    turned = [j for j in joints if abs(abs(skin.nodes[j].rotation[3]) - 1) > 1e-3]
    assert len(turned) == len(joints)
    weights = values(skin, skin.meshes[0].primitives[0].attributes.WEIGHTS_0)
    np.testing.assert_allclose(weights.sum(axis=1), 1, atol=1e-6)
    assert ((weights > 0.01).sum(axis=1) > 1).any()
    assert values(skin, skin.meshes[0].primitives[0].attributes.JOINTS_0).max() < len(joints)


def test_the_face_turns_rigidly_with_the_head(lam_zip: Path) -> None:
    """Head at 30 degrees: face, mouth and eyes keep their shape, chest and shoulders stay, nothing tears."""
    avatar = read_lam(lam_zip)
    player = Player(avatar)
    rest = player.animate(Pose()).mean.astype(float)
    turned = player.animate(Pose(joints={"head": joint_rotation((0, np.radians(30), 0))})).mean.astype(float)
    head = load_head()
    _, y, z = (rest - GROUND).T
    inside = (
        nearest(rest - GROUND, head.vertices[head.in_part("mouth_socket", "left_eye", "right_eye")]) < 1e-5
    )
    face = inside | ((y > -0.088) & (z > 0.03)) | (y > 0.02)
    assert inside.sum() > 2000 and face.sum() > 15000
    a, b = (x[face] - x[face].mean(axis=0) for x in (rest, turned))
    u, _, vt = np.linalg.svd(b.T @ a)
    rotation = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
    assert abs(np.degrees(np.arccos((np.trace(rotation) - 1) / 2)) - 30) < 0.01
    assert np.linalg.norm(b - a @ rotation.T, axis=1).max() < 2e-6
    bust = y < -0.17
    assert bust.sum() > 100 and np.linalg.norm(turned - rest, axis=1)[bust].max() < 1e-3
    assert avatar.rig is not None
    edge = avatar.rig.triangles.astype(int)[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    before, after = (np.linalg.norm(np.diff(x[edge], axis=1)[:, 0], axis=1) for x in (rest, turned))
    assert (after / before)[before > 1e-3].max() < 2


def nearest(points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Distance from each point to the nearest of the others."""
    chunks = np.array_split(points, 60)
    return np.concatenate([np.linalg.norm(c[:, None] - others[None], axis=2).min(axis=1) for c in chunks])


def test_clips_address_joints_by_name(members: dict[str, bytes], skin: pygltflib.GLTF2) -> None:
    doc = pygltflib.GLTF2.load_from_bytes(members["head/animation.glb"])
    assert [a.name for a in doc.animations] == ["idle", "nod"]
    joints = {skin.nodes[j].name: skin.nodes[j] for j in skin.skins[0].joints}
    assert [n.name for n in doc.nodes][: len(joints)] != list(joints), "node order differs from the skin's"
    for clip in doc.animations:
        targets = {(doc.nodes[c.target.node].name, c.target.path) for c in clip.channels}
        assert targets == {(n, p) for n in joints for p in ("translation", "rotation", "scale")}
        for channel in clip.channels:
            sampler = clip.samplers[channel.sampler]
            times, keys = values(doc, sampler.input)[:, 0], values(doc, sampler.output)
            assert len(times) == len(keys) and (np.diff(times) > 0).all()
            if channel.target.path == "rotation":
                np.testing.assert_allclose(np.linalg.norm(keys, axis=1), 1, atol=1e-6)
    moving = [
        c
        for c in doc.animations[1].channels
        if doc.animations[1].samplers[c.sampler].interpolation == "LINEAR"
    ]
    assert {doc.nodes[c.target.node].name for c in moving} == {"head", "neckLower"}


def test_vertex_order_is_a_trap(members: dict[str, bytes]) -> None:
    order = json.loads(members["head/vertex_order.json"])
    assert sorted(order) == list(range(len(order))) and order != sorted(order)


def test_same_bytes_every_time_and_full_differs(lam_zip: Path, tmp_path: Path) -> None:
    assert make_lam(tmp_path).read_bytes() == lam_zip.read_bytes()
    full = make_lam(tmp_path / "full", full=True)
    with zipfile.ZipFile(full) as zip_:
        v = PlyData.read(io.BytesIO(zip_.read("head/offset.ply")))["vertex"].data
    for name in set(v.dtype.names) - {"nx", "ny", "nz"}:
        assert np.ptp(v[name]) > 0.01, name
    assert v["opacity"].min() < -1 and v["opacity"].max() == MAX_LOGIT
