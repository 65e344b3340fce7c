from __future__ import annotations

import json
import struct
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pygltflib
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_export.clips.gltf_clip import clip_poses, clips, unmatched
from avatar_export.formats.gltf.sampler import Sampler, evaluate
from avatar_runtime.avatar import Avatar, Expression
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import Pose, resolve
from tests.exporter.driving.recordings import avatar_of, rig_of
from tests.shared_data import shared

QUARTER = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]  # 90 degrees about Z, xyzw


def sampler(
    values: Any, interpolation: str, rotation: bool = False, times: tuple[float, ...] = (1.0, 3.0)
) -> Sampler:
    return Sampler(np.array(times), np.array(values, float), interpolation, rotation)


def test_step_and_linear() -> None:
    at = np.array([0.0, 1.0, 1.5, 2.999, 3.0, 9.0])
    assert evaluate(sampler([[0], [8]], "STEP"), at)[:, 0].tolist() == [0, 0, 0, 0, 8, 8]
    assert evaluate(sampler([[0], [8]], "LINEAR"), at)[:, 0] == pytest.approx([0, 0, 2, 7.996, 8, 8])
    three = sampler([[0], [8], [2]], "LINEAR", times=(0.0, 1.0, 4.0))
    assert evaluate(three, np.array([0.5, 1.0, 2.0, 4.0]))[:, 0] == pytest.approx([4, 8, 6, 2])
    assert evaluate(sampler([[5]], "LINEAR", times=(1.0,)), at)[:, 0].tolist() == [5] * 6


def test_rotations_go_by_the_shorter_arc_at_constant_speed() -> None:
    for end in (QUARTER, [-v for v in QUARTER]):
        q = evaluate(sampler([[0, 0, 0, 1], end], "LINEAR", True), np.array([1.0, 1.5, 2.0, 3.0]))
        angles = 2 * np.degrees(np.arctan2(q[:, 2], q[:, 3]))
        assert angles == pytest.approx([0, 22.5, 45, 90])
    same = evaluate(sampler([QUARTER, QUARTER], "LINEAR", True), np.array([1.7]))
    assert same[0] == pytest.approx(QUARTER)


def test_cubic_spline_by_hand() -> None:
    # Keys 0 at t=1 with out-tangent 1 and 4 at t=3 with in-tangent -2; td = 2. At u = 1/2:
    # 0.5*0 + 2*0.125*1 + 0.5*4 + 2*(-0.125)*(-2) = 2.75
    cubic = sampler([[[9], [0], [1]], [[-2], [4], [9]]], "CUBICSPLINE")
    assert evaluate(cubic, np.array([0.0, 1.0, 2.0, 3.0, 5.0]))[:, 0] == pytest.approx([0, 0, 2.75, 4, 4])
    zero = [0.0] * 4
    turn = sampler([[zero, [0, 0, 0, 1], zero], [zero, QUARTER, zero]], "CUBICSPLINE", True)
    assert evaluate(turn, np.array([2.0]))[0] == pytest.approx([0, 0, np.sin(np.pi / 8), np.cos(np.pi / 8)])


class Builder:
    """A .glb of nodes and one clip."""

    def __init__(self, nodes: list[dict[str, Any]], **rest: Any) -> None:
        self.binary = b""
        self.animation: dict[str, Any] = {"name": "wave", "samplers": [], "channels": []}
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "nodes": nodes,
            "animations": [self.animation],
            "accessors": [],
            "bufferViews": [],
            **rest,
        }

    def accessor(self, values: Any, kind: str, dtype: str = "<f4", **extra: Any) -> int:
        data = np.asarray(values, dtype).tobytes()
        self.document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)}
        )
        self.binary += data
        component = {"<f4": 5126, "<i2": 5122, "u1": 5121}[dtype]
        entry = {
            "bufferView": len(self.document["bufferViews"]) - 1,
            "componentType": component,
            "type": kind,
        }
        width = {"SCALAR": 1, "VEC3": 3, "VEC4": 4}[kind]
        entry["count"] = np.asarray(values).size // width
        self.document["accessors"].append(entry | extra)
        return len(self.document["accessors"]) - 1

    def channel(self, node: int, path: str, times: list[float], output: int, kind: str = "LINEAR") -> Builder:
        given = self.accessor(times, "SCALAR")
        self.animation["samplers"].append({"input": given, "output": output, "interpolation": kind})
        self.animation["channels"].append(
            {"sampler": len(self.animation["samplers"]) - 1, "target": {"node": node, "path": path}}
        )
        return self

    def data(self) -> bytes:
        self.document["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.document).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<I4s", len(text), b"JSON") + text
        chunks += struct.pack("<I4s", len(self.binary), b"BIN\0") + self.binary
        return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks

    def write(self, path: Path) -> Path:
        path.write_bytes(self.data())
        return path


def waving() -> Builder:
    """armature (scaled) > hip > spacer > head; the clip turns head and raises hip by one over two seconds."""
    nodes = [
        {"name": "head", "translation": [0, 2, 0]},
        {"name": "spacer", "children": [0], "translation": [0, 1, 0]},
        {"name": "hip", "children": [1], "rotation": QUARTER},
        {"name": "armature", "children": [2], "scale": [0.5, 0.5, 0.5]},
        {"name": "face", "mesh": 0},
    ]
    targets = [{"POSITION": 0}, {"POSITION": 0}, {"POSITION": 0}]
    names = {"targetNames": ["jaw_Open", "grin", "odd"]}
    built = Builder(nodes, meshes=[{"primitives": [{"attributes": {}, "targets": targets}], "extras": names}])
    built.channel(0, "rotation", [0, 2], built.accessor([[0, 0, 0, 1], QUARTER], "VEC4"))
    built.channel(2, "translation", [0, 2], built.accessor([[0, 0, 0], [0, 1, 0]], "VEC3"))
    built.channel(4, "weights", [0, 1], built.accessor([0, 0, 0, 1, 0.5, 1], "SCALAR"))
    return built


# The same skeleton at rest; the head's rest transform spans the spacer, the hip's the armature.
REST = np.stack(
    [
        np.array([[0, -0.5, 0, 0], [0.5, 0, 0, 0], [0, 0, 0.5, 0], [0, 0, 0, 1]]),
        np.array([[1, 0, 0, 0], [0, 1, 0, 3], [0, 0, 1, 0], [0, 0, 0, 1]], float),
    ]
)
PUPPET = avatar_of(("jawOpen", Expression("smile", ("grin",))), rig_of(("hip", "head"), [-1, 0], REST))


def test_a_clip_poses_joints_and_expressions(tmp_path: Path) -> None:
    path = waving().write(tmp_path / "a.glb")
    assert clips(path) == ["wave"]
    poses = clip_poses(PUPPET, path, "wave", 2.0)
    assert len(poses) == 5
    assert poses[0].joints["hip"] == pytest.approx(np.eye(4)) and poses[0].joints["head"] == pytest.approx(
        np.eye(4)
    )
    # After one second: the hip half a unit up in the armature (0.25 after its scale), the head 45 degrees on.
    hip = REST[0] @ poses[2].joints["hip"]
    assert hip == pytest.approx(REST[0] + np.array([[0, 0, 0, 0], [0, 0, 0, 0.25], [0] * 4, [0] * 4]))
    c = np.sqrt(0.5)
    assert poses[2].joints["head"] == pytest.approx(
        np.array([[c, -c, 0, 0], [c, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    )
    quarter = poses[1].joints["head"]
    assert np.degrees(np.arctan2(quarter[1, 0], quarter[0, 0])) == pytest.approx(22.5)
    assert [p.expressions["jawOpen"] for p in poses] == [0, 0.5, 1, 1, 1]
    assert [p.expressions["smile"] for p in poses] == [0, 0.25, 0.5, 0.5, 0.5]
    assert unmatched(PUPPET, path, "wave") == ["odd"]
    resolve(poses[3], PUPPET)


def test_a_joint_the_clip_does_not_move_rests(tmp_path: Path) -> None:
    built = waving()
    del built.animation["channels"][1]
    assert set(clip_poses(PUPPET, built.write(tmp_path / "a.glb"), "wave", 1)[0].joints) == {"head"}


def test_normalised_integers(tmp_path: Path) -> None:
    built = Builder([{"name": "hip"}])
    packed = built.accessor([[0, 0, 0, 32767], [0, 0, 23170, 23170]], "VEC4", "<i2", normalized=True)
    path = built.channel(0, "rotation", [0, 1], packed).write(tmp_path / "a.glb")
    avatar = avatar_of((), rig_of(("hip",), [-1], np.eye(4)[None]))
    turned = clip_poses(avatar, path, "wave", 1)[1].joints["hip"]
    assert turned[:3, :3] == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=1e-7)


def test_clip_names(tmp_path: Path) -> None:
    built = waving()
    built.document["animations"] = [{"name": "a"}, {}, {"name": "a"}, {"name": 3}]
    assert clips(built.write(tmp_path / "a.glb")) == ["a", "animation_1", "animation_2", "animation_3"]


def edited(path: str, value: Any) -> bytes:
    built = waving()
    keys = path.split(".")
    at: Any = built.document
    for key in keys[:-1]:
        at = at[int(key)] if key.isdigit() else at[key]
    at[int(keys[-1]) if keys[-1].isdigit() else keys[-1]] = value
    return built.data()


@pytest.mark.parametrize(
    ("path", "value", "said"),
    [
        ("animations.0.name", "wav", "'wave' is no clip of this file; did you mean wav?"),
        ("animations.0.samplers.0.interpolation", "BEZIER", "interpolation BEZIER is none of STEP"),
        ("animations.0.samplers.0.input", 99, "accessors[99]"),
        ("animations.0.samplers.0.output", 1, "float32[T, *(4,)]"),
        ("animations.0.samplers.0.interpolation", "CUBICSPLINE", "has 2 values for 2 keys of 3"),
        ("animations.0.channels.0.sampler", 7, "sampler 7 is none of 3"),
        ("animations.0.channels.0.target.node", -1, "node -1 is none of 5"),
        ("animations.0.channels.0.target.path", "colour", "path colour"),
        ("animations.0.channels.1.target", {"node": 0, "path": "rotation"}, "a second time"),
        ("animations.0.channels.0.target", 3, "needs a target"),
        ("accessors.0.count", 1 << 60, "elements end at byte"),
        ("bufferViews.1.byteLength", 1 << 60, "ends at byte"),
        ("nodes.0.matrix", [1.0] * 16, "which has a matrix"),
        ("nodes.0.children", [3], "is its own ancestor"),
        ("nodes.4.children", [0], "has two parents"),
        ("nodes.1.translation", [0, 1, "x"], "nodes[1].translation"),
        ("nodes.1.name", 3, "nodes[1].name"),
        ("meshes.0.primitives", 5, "meshes[0].primitives"),
    ],
)
def test_bad_documents(tmp_path: Path, path: str, value: Any, said: str) -> None:
    file = tmp_path / "bad.glb"
    file.write_bytes(edited(path, value))
    with pytest.raises(AvatarError, match=r"bad\.glb") as caught:
        clip_poses(PUPPET, file, "wave", 30)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("times", "values", "said"),
    [
        ([1, 1], [0, 0, 0, 1, 0, 0, 0, 1], "strictly rise"),
        ([-1, 1], [0, 0, 0, 1, 0, 0, 0, 1], "strictly rise"),
        ([0, float("nan")], [0, 0, 0, 1, 0, 0, 0, 1], "no finite number"),
        ([0, 1], [0, 0, 0, 1, 0, 0, 0, float("inf")], "no finite number"),
        ([0, 3e38], [0, 0, 0, 1, 0, 0, 0, 1], "is too long"),
    ],
)
def test_bad_keys(tmp_path: Path, times: list[float], values: list[float], said: str) -> None:
    built = Builder([{"name": "hip"}])
    path = built.channel(0, "rotation", times, built.accessor(values, "VEC4")).write(tmp_path / "a.glb")
    with pytest.raises(AvatarError, match=said):
        clip_poses(PUPPET, path, "wave", 30)


def test_values_that_overflow_are_refused(tmp_path: Path) -> None:
    built = Builder(
        [{"name": "hip"}, *({"name": f"n{i}", "children": [i], "scale": [1e29] * 3} for i in range(12))]
    )
    path = built.channel(0, "scale", [0], built.accessor([[1, 1, 1]], "VEC3")).write(tmp_path / "a.glb")
    with pytest.raises(AvatarError, match="moves hip beyond"):
        clip_poses(PUPPET, path, "wave", 30)


def test_a_clip_that_moves_nothing_here_is_refused(tmp_path: Path) -> None:
    path = waving().write(tmp_path / "a.glb")
    with pytest.raises(AvatarError, match="is no joint or expression of this avatar"):
        clip_poses(avatar_of(("x",)), path, "wave", 30)
    for fps in (0, -1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="fps"):
            clip_poses(PUPPET, path, "wave", fps)


@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, 100_000), st.binary(min_size=1, max_size=4)), min_size=1, max_size=3)
)
def test_no_bytes_break_the_clip_reader(
    tmp_path_factory: pytest.TempPathFactory, edits: list[tuple[int, bytes]]
) -> None:
    data = waving().data()
    for at, new in edits:
        at %= len(data)
        data = data[:at] + new + data[at + len(new) :]
    path = tmp_path_factory.getbasetemp() / "any.glb"
    path.write_bytes(data)
    try:
        for name in clips(path):
            unmatched(PUPPET, path, name)
            for pose in clip_poses(PUPPET, path, name, 4):
                resolve(pose, PUPPET)
    except AvatarError as error:
        assert "\n" not in str(error)


def oracle_locals(gltf: pygltflib.GLTF2, animation: int, time: float) -> list[np.ndarray]:
    """parent_from_node of every node at a time that is a key of each channel: key values, nothing between."""
    blob = gltf.binary_blob()

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


def worlds(gltf: pygltflib.GLTF2, local: list[np.ndarray]) -> list[np.ndarray]:
    parent = {child: i for i, node in enumerate(gltf.nodes) for child in node.children or []}

    def world(i: int) -> np.ndarray:
        return world(parent[i]) @ local[i] if i in parent else local[i]

    return [world(i) for i in range(len(local))]


def avatar_of_skin(gltf: pygltflib.GLTF2, rest_world: dict[str, np.ndarray]) -> Avatar:
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


def difference(gltf: pygltflib.GLTF2, avatar: Avatar, animation: int, pose: Pose, time: float) -> float:
    """Largest difference of a joint's entries in mesh space between the posed avatar and the oracle."""
    posed = posed_worlds(avatar, pose.joints)
    expected = worlds(gltf, oracle_locals(gltf, animation, time))
    by_name = {node.name: expected[i] for i, node in enumerate(gltf.nodes)}
    shared_joints = [name for name in posed if name in by_name]
    assert len(shared_joints) >= 19
    return max(float(np.abs(posed[name] - by_name[name]).max()) for name in shared_joints)


def test_cesium_man_walks() -> None:
    path = shared("gltf/CesiumMan.glb")
    gltf = pygltflib.GLTF2().load(str(path))
    assert clips(path) == ["animation_0"]
    still = [np.array(n.matrix, float).reshape(4, 4).T if n.matrix else None for n in gltf.nodes]
    local = [
        m if m is not None else trs(n.translation or [0] * 3, n.rotation or [0, 0, 0, 1], n.scale or [1] * 3)
        for m, n in zip(still, gltf.nodes, strict=True)
    ]
    rest = {n.name: w for n, w in zip(gltf.nodes, worlds(gltf, local), strict=True)}
    avatar = avatar_of_skin(gltf, rest)
    poses = clip_poses(avatar, path, "animation_0", 24)
    assert len(poses) == 49 and unmatched(avatar, path, "animation_0") == []
    assert difference(gltf, avatar, 0, poses[30], 30 / 24) < 1e-12


def test_lam_clip_on_the_lam_skeleton(tmp_path: Path) -> None:
    with zipfile.ZipFile(shared("lam/p2-1.zip")) as archive:
        for name in ("skin.glb", "animation.glb"):
            (tmp_path / name).write_bytes(archive.read(f"p2-1/{name}"))
    skin = pygltflib.GLTF2().load(str(tmp_path / "skin.glb"))
    a = skin.accessors[skin.skins[0].inverseBindMatrices]
    start = (skin.bufferViews[a.bufferView].byteOffset or 0) + (a.byteOffset or 0)
    bind = np.frombuffer(skin.binary_blob(), "<f4", a.count * 16, start).reshape(-1, 4, 4).transpose(0, 2, 1)
    names = [skin.nodes[j].name for j in skin.skins[0].joints]
    rest = {n: np.linalg.inv(m.astype(float)) for n, m in zip(names, bind, strict=True)}
    avatar = avatar_of_skin(skin, rest)
    path = tmp_path / "animation.glb"
    known = clips(path)
    assert len(known) == 12 and known[0] == "head_test"
    assert unmatched(avatar, path, "head_test") == []
    poses = clip_poses(avatar, path, "yumi_h5_a3_hello", 24)
    assert len(poses) == 53
    gltf = pygltflib.GLTF2().load(str(path))
    for frame in (0, 20):
        assert difference(gltf, avatar, 1, poses[frame], frame / 24) < 1e-6
