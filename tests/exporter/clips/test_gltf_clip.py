"""Clips of a .glb on an avatar: joints and expressions by name, and what damaged files get."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.clips.gltf_clip import clip_poses, unmatched
from avatar_export.clips.gltf_files import gltf_of
from avatar_export.formats.gltf.animation import clip_names
from avatar_export.formats.gltf.sampler import Sampler, evaluate
from avatar_runtime.avatar import Expression
from avatar_runtime.pose import resolve
from tests.avatars import avatar_of, rig_of
from tests.exporter.glb_files import Builder
from tests.exporter.refusals import put, refused

QUARTER = [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)]  # 90 degrees about Z, xyzw


class Clip(Builder):
    """A .glb of nodes and one clip."""

    def __init__(self, nodes: list[dict[str, Any]], **rest: Any) -> None:
        self.animation: dict[str, Any] = {"name": "wave", "samplers": [], "channels": []}
        super().__init__(nodes=nodes, animations=[self.animation], **rest)

    def channel(self, node: int, path: str, times: list[float], output: int, kind: str = "LINEAR") -> Clip:
        samplers, channels = self.animation["samplers"], self.animation["channels"]
        channels.append({"sampler": len(samplers), "target": {"node": node, "path": path}})
        samplers.append({"input": self.add(times, "SCALAR", "<f4"), "output": output, "interpolation": kind})
        return self


def waving() -> Clip:
    """armature (scaled) > hip > spacer > head; the clip turns head and raises hip by one over two seconds."""
    nodes = [
        {"name": "head", "translation": [0, 2, 0]},
        {"name": "spacer", "children": [0], "translation": [0, 1, 0]},
        {"name": "hip", "children": [1], "rotation": QUARTER},
        {"name": "armature", "children": [2], "scale": [0.5, 0.5, 0.5]},
        {"name": "face", "mesh": 0},
    ]
    names = {"targetNames": ["jaw_Open", "grin", "odd"]}
    primitive = {"attributes": {}, "targets": [{"POSITION": 0}] * 3}
    built = Clip(nodes, meshes=[{"primitives": [primitive], "extras": names}])
    built.channel(0, "rotation", [0, 2], built.add([[0, 0, 0, 1], QUARTER], "VEC4", "<f4"))
    built.channel(2, "translation", [0, 2], built.add([[0, 0, 0], [0, 1, 0]], "VEC3", "<f4"))
    built.channel(4, "weights", [0, 1], built.add([0, 0, 0, 1, 0.5, 1], "SCALAR", "<f4"))
    return built


# The same skeleton at rest; the head's rest transform spans the spacer, the hip's the armature.
REST = np.array(
    [
        [[0, -0.5, 0, 0], [0.5, 0, 0, 0], [0, 0, 0.5, 0], [0, 0, 0, 1]],
        [[1, 0, 0, 0], [0, 1, 0, 3], [0, 0, 1, 0], [0, 0, 0, 1]],
    ]
)
PUPPET = avatar_of(("jawOpen", Expression("smile", ("grin",))), rig_of(("hip", "head"), [-1, 0], REST))


def test_a_clip_poses_joints_and_expressions(tmp_path: Path) -> None:
    path = waving().write(tmp_path / "a.glb")
    assert clip_names(gltf_of(path)) == ["wave"]
    poses = clip_poses(PUPPET, gltf_of(path), "wave", 2.0)
    assert len(poses) == 5
    for name in ("hip", "head"):
        assert poses[0].joints[name] == pytest.approx(np.eye(4))
    # After one second: the hip half a unit up in the armature (0.25 after its scale), the head 45 degrees on.
    raised = np.zeros((4, 4))
    raised[1, 3] = 0.25
    assert REST[0] @ poses[2].joints["hip"] == pytest.approx(REST[0] + raised)
    for pose, degrees in ((poses[1], 22.5), (poses[2], 45)):
        turned, angle = np.eye(4), np.radians(degrees)
        turned[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        assert pose.joints["head"] == pytest.approx(turned)
    assert [p.expressions["jawOpen"] for p in poses] == [0, 0.5, 1, 1, 1]
    assert [p.expressions["smile"] for p in poses] == [0, 0.25, 0.5, 0.5, 0.5]
    assert unmatched(PUPPET, gltf_of(path), "wave") == ["odd"]
    resolve(poses[3], PUPPET)


CHANNEL, SAMPLER = ("animations", 0, "channels", 0), ("animations", 0, "samplers", 0)


@pytest.mark.parametrize(
    ("at", "said"),
    [
        (("animations", 0, "name", "wav"), r"'wave' is not a clip of this file; did you mean wav\?"),
        ((*SAMPLER, "interpolation", "BEZIER"), "interpolation BEZIER is not one of STEP"),
        ((*SAMPLER, "output", 1), r"float32\[T, \*\(4,\)\]"),
        ((*SAMPLER, "interpolation", "CUBICSPLINE"), "has 2 values for 2 keys of 3"),
        ((*CHANNEL, "target", "node", -1), "node -1 does not exist; there are 5"),
        ((*CHANNEL, "target", "path", "colour"), "path colour"),
        (("animations", 0, "channels", 1, "target", {"node": 0, "path": "rotation"}), "a second time"),
        (("accessors", 0, "count", 1 << 60), "elements end at byte"),
        (("nodes", 0, "matrix", [1.0] * 16), "which has a matrix"),
        (("nodes", 0, "children", [3]), "is its own ancestor"),
        (("nodes", 4, "children", [0]), "has two parents"),
        (("nodes", 1, "name", 3), r"nodes\[1\].name"),
    ],
)
def test_bad_documents(tmp_path: Path, at: tuple[Any, ...], said: str) -> None:
    built = waving()
    put(*at)(built.document)
    file = built.write(tmp_path / "bad.glb")
    refused(rf"bad\.glb.*{said}", lambda: clip_poses(PUPPET, gltf_of(file), "wave", 30))


TURNS = ([0, 0, 0, 1], [0, 0, 0, 1])


@pytest.mark.parametrize(
    ("times", "values", "said"),
    [
        *((times, TURNS, "strictly increase") for times in ([1, 1], [-1, 1])),
        ([0, float("nan")], TURNS, "holds NaN or an infinity"),
        ([0, 1], ([0, 0, 0, 1], [0, 0, 0, float("inf")]), "holds NaN or an infinity"),
        ([0, 3e38], TURNS, "is too long"),
    ],
)
def test_bad_keys(tmp_path: Path, times: list[float], values: Any, said: str) -> None:
    built = Clip([{"name": "hip"}])
    path = built.channel(0, "rotation", times, built.add(values, "VEC4", "<f4")).write(tmp_path / "a.glb")
    refused(said, clip_poses, PUPPET, gltf_of(path), "wave", 30)


def test_clips_that_do_not_fit_the_avatar(tmp_path: Path) -> None:
    file = gltf_of(waving().write(tmp_path / "a.glb"))
    refused("is not a joint or expression of this avatar", clip_poses, avatar_of(("x",)), file, "wave", 30)
    for fps in (0, -1, float("nan"), float("inf")):
        with pytest.raises(ValueError, match="fps"):
            clip_poses(PUPPET, file, "wave", fps)
    large = [{"name": f"n{i}", "children": [i], "scale": [1e29] * 3} for i in range(12)]
    built = Clip([{"name": "hip"}, *large])
    path = built.channel(0, "scale", [0], built.add([[1, 1, 1]], "VEC3", "<f4")).write(tmp_path / "b.glb")
    refused("moves hip out of the range of float32", clip_poses, PUPPET, gltf_of(path), "wave", 30)


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
