"""Clips of a .glb on an avatar: joints and expressions by name, and what damaged files get."""

from __future__ import annotations

import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_export.clips.gltf_clip import clip_poses, unmatched
from avatar_export.clips.gltf_files import gltf_of
from avatar_export.formats.gltf.animation import clip_names
from avatar_runtime.avatar import Expression
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import resolve
from tests.avatars import avatar_of, rig_of
from tests.session.fuzz import examples

QUARTER = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]  # 90 degrees about Z, xyzw


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
    assert clip_names(gltf_of(path)) == ["wave"]
    poses = clip_poses(PUPPET, gltf_of(path), "wave", 2.0)
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
    assert unmatched(PUPPET, gltf_of(path), "wave") == ["odd"]
    resolve(poses[3], PUPPET)


def test_a_joint_the_clip_does_not_move_rests(tmp_path: Path) -> None:
    built = waving()
    del built.animation["channels"][1]
    assert set(clip_poses(PUPPET, gltf_of(built.write(tmp_path / "a.glb")), "wave", 1)[0].joints) == {"head"}


def test_normalised_integers(tmp_path: Path) -> None:
    built = Builder([{"name": "hip"}])
    packed = built.accessor([[0, 0, 0, 32767], [0, 0, 23170, 23170]], "VEC4", "<i2", normalized=True)
    path = built.channel(0, "rotation", [0, 1], packed).write(tmp_path / "a.glb")
    avatar = avatar_of((), rig_of(("hip",), [-1], np.eye(4)[None]))
    turned = clip_poses(avatar, gltf_of(path), "wave", 1)[1].joints["hip"]
    assert turned[:3, :3] == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), abs=1e-7)


def test_clip_names(tmp_path: Path) -> None:
    built = waving()
    built.document["animations"] = [{"name": "a"}, {}, {"name": "a"}, {"name": 3}]
    assert clip_names(gltf_of(built.write(tmp_path / "a.glb"))) == [
        "a",
        "animation_1",
        "animation_2",
        "animation_3",
    ]


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
        ("animations.0.name", "wav", "'wave' is not a clip of this file; did you mean wav?"),
        ("animations.0.samplers.0.interpolation", "BEZIER", "interpolation BEZIER is not one of STEP"),
        ("animations.0.samplers.0.input", 99, "accessors[99]"),
        ("animations.0.samplers.0.output", 1, "float32[T, *(4,)]"),
        ("animations.0.samplers.0.interpolation", "CUBICSPLINE", "has 2 values for 2 keys of 3"),
        ("animations.0.channels.0.sampler", 7, "sampler 7 does not exist; there are 3"),
        ("animations.0.channels.0.target.node", -1, "node -1 does not exist; there are 5"),
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
        clip_poses(PUPPET, gltf_of(file), "wave", 30)
    assert said in str(caught.value)


@pytest.mark.parametrize(
    ("times", "values", "said"),
    [
        ([1, 1], [0, 0, 0, 1, 0, 0, 0, 1], "strictly increase"),
        ([-1, 1], [0, 0, 0, 1, 0, 0, 0, 1], "strictly increase"),
        ([0, float("nan")], [0, 0, 0, 1, 0, 0, 0, 1], "holds NaN or an infinity"),
        ([0, 1], [0, 0, 0, 1, 0, 0, 0, float("inf")], "holds NaN or an infinity"),
        ([0, 3e38], [0, 0, 0, 1, 0, 0, 0, 1], "is too long"),
    ],
)
def test_bad_keys(tmp_path: Path, times: list[float], values: list[float], said: str) -> None:
    built = Builder([{"name": "hip"}])
    path = built.channel(0, "rotation", times, built.accessor(values, "VEC4")).write(tmp_path / "a.glb")
    with pytest.raises(AvatarError, match=said):
        clip_poses(PUPPET, gltf_of(path), "wave", 30)


def test_values_that_overflow_are_refused(tmp_path: Path) -> None:
    built = Builder(
        [{"name": "hip"}, *({"name": f"n{i}", "children": [i], "scale": [1e29] * 3} for i in range(12))]
    )
    path = built.channel(0, "scale", [0], built.accessor([[1, 1, 1]], "VEC3")).write(tmp_path / "a.glb")
    with pytest.raises(AvatarError, match="moves hip out of the range of float32"):
        clip_poses(PUPPET, gltf_of(path), "wave", 30)


def test_a_clip_that_moves_nothing_here_is_refused(tmp_path: Path) -> None:
    path = waving().write(tmp_path / "a.glb")
    with pytest.raises(AvatarError, match="is not a joint or expression of this avatar"):
        clip_poses(avatar_of(("x",)), gltf_of(path), "wave", 30)
    for fps in (0, -1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="fps"):
            clip_poses(PUPPET, gltf_of(path), "wave", fps)


@settings(max_examples=examples(200))
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
        for name in clip_names(gltf_of(path)):
            unmatched(PUPPET, gltf_of(path), name)
            for pose in clip_poses(PUPPET, gltf_of(path), name, 4):
                resolve(pose, PUPPET)
    except AvatarError as error:
        assert "\n" not in str(error)
