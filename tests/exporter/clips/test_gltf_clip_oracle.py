"""Clips of real files against an evaluation of their own nodes."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.clips.gltf_clip import clip_poses, unmatched
from avatar_export.clips.gltf_files import gltf_of
from avatar_export.formats.gltf.animation import clip_names
from avatar_runtime.avatar import Avatar
from avatar_runtime.pose import Pose
from tests.avatars import avatar_of, rig_of
from tests.shared_data import shared

QUARTER = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]  # 90 degrees about Z, xyzw


class Fields(dict[str, Any]):
    """A JSON object whose members are attributes; None for one that it lacks."""

    __getattr__ = dict.get


def glb(path: Path) -> Fields:
    """The document of a .glb, and its buffer as `blob`. (pygltflib takes 15 s for a file of many clips.)"""
    data = path.read_bytes()
    size = int.from_bytes(data[12:16], "little")
    document: Fields = json.loads(data[20 : 20 + size], object_hook=Fields)
    document["blob"] = data[28 + size :]
    return document


def oracle_locals(gltf: Fields, animation: int, time: float) -> list[np.ndarray]:
    """parent_from_node of every node at a time that is a key of each channel: key values, nothing between."""
    blob = gltf.blob

    def floats(index: int, width: int) -> np.ndarray:
        a = gltf.accessors[index]
        view = gltf.bufferViews[a.bufferView]
        start = (view.byteOffset or 0) + (a.byteOffset or 0)
        return np.frombuffer(blob, "<f4", a.count * width, start).reshape(-1, width).astype(float)

    parts = [
        {
            "translation": n.translation or [0, 0, 0],
            "rotation": n.rotation or [0, 0, 0, 1],
            "scale": n.scale or [1] * 3,
        }
        for n in gltf.nodes
    ]
    for channel in gltf.animations[animation].channels:
        entry = gltf.animations[animation].samplers[channel.sampler]
        times = floats(entry.input, 1)[:, 0]
        values = floats(entry.output, 4 if channel.target.path == "rotation" else 3)
        key = int(np.argmin(np.abs(times - time)))
        # A channel that stands still has a key at either end only.
        assert abs(times[key] - time) < 1e-6 or np.ptp(values, axis=0).max() < 1e-4
        parts[channel.target.node][channel.target.path] = values[key]
    return [
        np.array(node.matrix, float).reshape(4, 4).T if node.matrix else trs(**part)
        for node, part in zip(gltf.nodes, parts, strict=True)
    ]


def trs(translation: Any, rotation: Any, scale: Any) -> np.ndarray:
    """Columns by rotating the axes with the vector formula v + 2 w (u x v) + 2 u x (u x v)."""
    rotation = np.asarray(rotation, float) / np.linalg.norm(rotation)
    u, w = rotation[:3], rotation[3]
    m = np.eye(4)
    for axis in range(3):
        v = np.eye(3)[axis]
        m[:3, axis] = (v + 2 * w * np.cross(u, v) + 2 * np.cross(u, np.cross(u, v))) * scale[axis]
    m[:3, 3] = translation
    return m


def worlds(gltf: Fields, local: list[np.ndarray]) -> list[np.ndarray]:
    parent = {child: i for i, node in enumerate(gltf.nodes) for child in node.children or []}

    def world(i: int) -> np.ndarray:
        return world(parent[i]) @ local[i] if i in parent else local[i]

    return [world(i) for i in range(len(local))]


def avatar_of_skin(gltf: Fields, rest_world: dict[str, np.ndarray]) -> Avatar:
    """An avatar with the skin's joints whose rest transforms are given in mesh space."""
    parent = {child: i for i, node in enumerate(gltf.nodes) for child in node.children or []}
    joints = gltf.skins[0].joints
    order = sorted(joints, key=lambda j: depth(parent, j))
    parents = [order.index(parent[j]) if parent.get(j) in order else -1 for j in order]
    names = tuple(gltf.nodes[j].name for j in order)
    local = [
        rest_world[n] if p < 0 else np.linalg.inv(rest_world[names[p]]) @ rest_world[n]
        for n, p in zip(names, parents, strict=True)
    ]
    return avatar_of((), rig_of(names, parents, np.stack(local)))


def depth(parent: dict[int, int], node: int) -> int:
    return 1 + depth(parent, parent[node]) if node in parent else 0


def posed_worlds(avatar: Avatar, joints: Any) -> dict[str, np.ndarray]:
    rig = avatar.rig
    assert rig is not None
    found: dict[str, np.ndarray] = {}
    for row, name in enumerate(rig.joint_names):
        local = rig.rest_local[row].astype(float) @ joints.get(name, np.eye(4))
        found[name] = local if rig.parents[row] < 0 else found[rig.joint_names[rig.parents[row]]] @ local
    return found


def difference(gltf: Fields, avatar: Avatar, animation: int, pose: Pose, time: float) -> float:
    """Largest difference of a joint's entries in mesh space between the posed avatar and the oracle."""
    posed = posed_worlds(avatar, pose.joints)
    expected = worlds(gltf, oracle_locals(gltf, animation, time))
    by_name = {node.name: expected[i] for i, node in enumerate(gltf.nodes)}
    shared_joints = [name for name in posed if name in by_name]
    assert len(shared_joints) >= 19
    return max(float(np.abs(posed[name] - by_name[name]).max()) for name in shared_joints)


def test_cesium_man_walks() -> None:
    path = shared("gltf/CesiumMan.glb")
    gltf = glb(path)
    assert clip_names(gltf_of(path)) == ["animation_0"]
    still = [np.array(n.matrix, float).reshape(4, 4).T if n.matrix else None for n in gltf.nodes]
    local = [
        m if m is not None else trs(n.translation or [0] * 3, n.rotation or [0, 0, 0, 1], n.scale or [1] * 3)
        for m, n in zip(still, gltf.nodes, strict=True)
    ]
    rest = {n.name: w for n, w in zip(gltf.nodes, worlds(gltf, local), strict=True)}
    avatar = avatar_of_skin(gltf, rest)
    poses = clip_poses(avatar, gltf_of(path), "animation_0", 24)
    assert len(poses) == 49 and unmatched(avatar, gltf_of(path), "animation_0") == []
    assert difference(gltf, avatar, 0, poses[30], 30 / 24) < 1e-12


def test_lam_clip_on_the_lam_skeleton(tmp_path: Path) -> None:
    with zipfile.ZipFile(shared("lam/p2-1.zip")) as archive:
        for name in ("skin.glb", "animation.glb"):
            (tmp_path / name).write_bytes(archive.read(f"p2-1/{name}"))
    skin = glb(tmp_path / "skin.glb")
    a = skin.accessors[skin.skins[0].inverseBindMatrices]
    start = (skin.bufferViews[a.bufferView].byteOffset or 0) + (a.byteOffset or 0)
    bind = np.frombuffer(skin.blob, "<f4", a.count * 16, start).reshape(-1, 4, 4).transpose(0, 2, 1)
    names = [skin.nodes[j].name for j in skin.skins[0].joints]
    rest = {n: np.linalg.inv(m.astype(float)) for n, m in zip(names, bind, strict=True)}
    avatar = avatar_of_skin(skin, rest)
    path = tmp_path / "animation.glb"
    known = clip_names(gltf_of(path))
    assert len(known) == 12 and known[0] == "head_test"
    assert unmatched(avatar, gltf_of(path), "head_test") == []
    poses = clip_poses(avatar, gltf_of(path), "yumi_h5_a3_hello", 24)
    assert len(poses) == 53
    gltf = glb(path)
    for frame in (0, 20):
        assert difference(gltf, avatar, 1, poses[frame], frame / 24) < 1e-6
