"""Rigs and clips of .fbx files: a made one against sums of its own numbers, a real one's facts, damaged bytes."""

from __future__ import annotations

import importlib.util
import io
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_export.clips import fbx_clip
from avatar_export.clips.poses import clip_poses, rig_avatar
from avatar_export.clips.sources import clips_from
from avatar_export.formats.fbx import file as fbx_file
from avatar_export.formats.fbx.file import open_fbx
from avatar_export.notes.note import fact
from avatar_export.rigs.fbx_rig import FbxRig, fbx_rig
from avatar_export.rigs.rig_driving import expressions_named, rig_driving
from avatar_runtime.avatar import Expression
from avatar_runtime.driving.arkit import ARKIT_NAMES, canonical
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.exporter.rigs import fbx_files
from tests.exporter.rigs.fbx_files import Settings
from tests.hostile import MANGLING, mangled, only_avatar_errors
from tests.measured import Measure
from tests.session.fuzz import examples
from tests.shared_data import shared

METRES = 2e-7


def _written(folder: Path, data: bytes) -> Path:
    path = folder / "made.fbx"
    path.write_bytes(data)
    return path


def _rig(folder: Path, s: Settings) -> FbxRig:
    return fbx_rig(open_fbx(_written(folder, fbx_files.fbx(s))))


def test_rest_pose_in_metres_y_up(tmp_path: Path) -> None:
    found = _rig(tmp_path, Settings())
    rig = found.rig
    np.testing.assert_allclose(rig.vertices, fbx_files.posed(0, 0), atol=METRES)
    assert rig.joint_names == ("hip", "head") and rig.parents.tolist() == [-1, 0]  # "link" has no weight
    quads = fbx_files.quads()
    fans = np.stack([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]], axis=1).reshape(-1, 3)
    np.testing.assert_array_equal(rig.triangles, fans)
    assert found.notes == (fact("polygons_cut", count=5, file="made.fbx"),)
    world = np.linalg.inv(rig.inverse_bind_matrix.astype(np.float64))
    for name, matrix in zip(rig.joint_names, world, strict=True):
        want = fbx_files.joint_worlds()[name]
        np.testing.assert_allclose(matrix[:3, 3], fbx_files.in_metres(want[:3, 3]), atol=METRES)
        assert np.linalg.det(matrix[:3, :3]) == pytest.approx(1, abs=1e-5), "no unit hides in a joint"
    np.testing.assert_allclose(world[0] @ rig.rest_local[1], world[1], atol=METRES)


def test_the_clip_is_the_files_own_sums(tmp_path: Path, measured: Measure) -> None:
    path = _written(tmp_path, fbx_files.fbx())
    found = fbx_rig(open_fbx(path))
    avatar = rig_avatar(found.rig, expressions_named(found.morph_names))
    (clip,) = clips_from(avatar, path)
    assert (clip.name, clip.fps, clip.frames) == ("nod", 30, 31)
    player = Player(avatar)
    for frame, pose in enumerate(clip_poses(avatar, clip)):
        off = np.abs(player.mesh(pose) - fbx_files.posed(frame / 30, frame / 60)).max()
        measured("FBX clip against its own sums m", off, METRES)
        assert off < METRES


@pytest.mark.parametrize("name", ["hip", "head", "jawOpen"])
def test_a_clip_goes_to_another_avatar_by_names(tmp_path: Path, name: str) -> None:
    """To one whose skeleton is cut elsewhere: only what is named moves."""
    path = _written(tmp_path, fbx_files.fbx())
    found = fbx_rig(open_fbx(path))
    names = tuple(joint if joint == name else f"my_{joint}" for joint in found.rig.joint_names)
    expression = "JawOpen" if name == "jawOpen" else "other"  # spelled otherwise
    avatar = rig_avatar(replace(found.rig, joint_names=names), (Expression(expression),))
    (clip,) = clips_from(avatar, path)
    assert clip.expression_weights[-1, 0] == pytest.approx(0.5 if name == "jawOpen" else 0)
    still = np.abs(clip.joint_delta[-1] - np.eye(4)).max(axis=(1, 2)) < 1e-5
    assert still.tolist() == [True, name != "head"]


def test_a_clip_of_other_names_is_refused(tmp_path: Path) -> None:
    path = _written(tmp_path, fbx_files.fbx())
    found = fbx_rig(open_fbx(path))
    avatar = rig_avatar(replace(found.rig, joint_names=("a", "b")), expressions_named(("c",)))
    assert clips_from(avatar, path, optional=True) == ()
    with pytest.raises(AvatarError, match=r"made\.fbx: has no animation that moves a joint"):
        clips_from(avatar, path)
    with pytest.raises(AvatarError, match="is not a joint or expression of this avatar"):
        fbx_clip.clip_of(avatar, open_fbx(path), open_fbx(path).clips[0], "nod")


def test_other_units_and_axes(tmp_path: Path) -> None:
    """The same numbers read as inches and Y up: a change of frame of the same shape."""
    up = _rig(tmp_path, Settings(unit=2.54, up=(1, 1), front=(2, 1))).rig
    turned = _rig(tmp_path, Settings()).rig.vertices * 2.54
    np.testing.assert_allclose(
        up.vertices, np.stack([turned[:, 0], -turned[:, 2], turned[:, 1]], 1), atol=1e-6
    )


def test_a_shape_that_is_whole_at_another_weight(tmp_path: Path) -> None:
    """Offsets belong to 50 percent, so twice as much to a weight of 1."""
    half, whole = (_rig(tmp_path, Settings(full=full)).rig.morphs for full in (50, 100))
    np.testing.assert_allclose(half.values["position"], 2 * whole.values["position"], atol=METRES)
    np.testing.assert_array_equal(half.column, whole.column)


def test_weights_off_one_are_divided_by_their_sum(tmp_path: Path) -> None:
    found = _rig(tmp_path, Settings(weight=0.5))
    assert found.notes[-1] == fact("weights_renormalised", count=12)
    sums = np.add.reduceat(found.rig.skin.values["weight"], found.rig.skin.row_ptr[:-1].astype(int))
    np.testing.assert_allclose(sums, 1, atol=1e-6)


def test_two_meshes_are_joined(tmp_path: Path) -> None:
    found, one = _rig(tmp_path, Settings(meshes=2)), _rig(tmp_path, Settings()).rig
    rig, v = found.rig, len(one.vertices)
    np.testing.assert_array_equal(rig.vertices, np.concatenate([one.vertices] * 2))
    np.testing.assert_array_equal(rig.triangles, np.concatenate([one.triangles, one.triangles + v]))
    assert rig.joint_names == one.joint_names and found.morph_names == ("jawOpen",)
    for name in ("skin", "morphs"):
        both, single = getattr(rig, name), getattr(one, name)
        np.testing.assert_array_equal(both.column, np.concatenate([single.column] * 2))
        np.testing.assert_array_equal(np.diff(both.row_ptr), np.tile(np.diff(single.row_ptr), 2))
    assert found.notes[0] == fact("meshes_joined", file="made.fbx", meshes=["mesh0", "mesh1"])


def test_meshes_bound_in_two_poses_are_refused(tmp_path: Path) -> None:
    with pytest.raises(AvatarError, match=r"made\.fbx: joint 'hip': is bound in two poses"):
        _rig(tmp_path, Settings(meshes=2, second_bind_offset=0.02))


def test_left_handed_axes_are_refused(tmp_path: Path) -> None:
    with pytest.raises(AvatarError, match=r"made\.fbx: CoordAxis: has left-handed axes"):
        open_fbx(_written(tmp_path, fbx_files.fbx(Settings(right=(0, -1)))))


def test_a_still_animation_is_none(tmp_path: Path) -> None:
    path = _written(tmp_path, fbx_files.fbx(Settings(animated=False)))
    found = fbx_rig(open_fbx(path))
    assert clips_from(rig_avatar(found.rig, expressions_named(found.morph_names)), path, optional=True) == ()


def test_files_that_are_none(tmp_path: Path) -> None:
    for data in (b"", b"glTF", b"Kaydara FBX Binary  \0\x1a\0" + bytes(40), b"; FBX 7.4.0 project file\n"):
        path = _written(tmp_path, data)
        with pytest.raises(AvatarError, match=r"made\.fbx"):
            fbx_rig(open_fbx(path))
    with pytest.raises(AvatarError, match="cannot be read"):
        open_fbx(tmp_path / "missing.fbx")


def test_without_the_extra_its_name_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(AvatarError, match=r"needs the extra \[fbx\]: pip install -e .*\[fbx\]"):
        open_fbx(_written(tmp_path, fbx_files.fbx()))


def test_a_crash_of_the_reader_is_an_error_of_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    program = tmp_path / "crash.py"
    program.write_text("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n")
    monkeypatch.setattr(fbx_file, "PROGRAM", program)
    with pytest.raises(AvatarError, match="crashes the FBX reader"):
        open_fbx(_written(tmp_path, fbx_files.fbx()))
    program.write_text("import time\ntime.sleep(9)\n")
    monkeypatch.setattr(fbx_file, "MAX_SECONDS", 0.2)
    with pytest.raises(AvatarError, match=r"takes longer than 0.2 s"):
        open_fbx(_written(tmp_path, fbx_files.fbx()))


def test_rocketbox(measured: Measure) -> None:
    """A real character, 1.74 m tall, upright, facing +Z, its left at +X; its one animation stands still."""
    path = shared("body/rocketbox_female_01_facial.fbx")
    file = open_fbx(path)
    found = fbx_rig(file)
    rig = found.rig
    assert (len(rig.vertices), len(rig.triangles), rig.joint_count) == (4734, 8732, 80)
    assert np.diff(rig.skin.row_ptr.astype(int)).max() == 4 and not found.notes
    low, high = rig.vertices.min(axis=0), rig.vertices.max(axis=0)
    assert low[1] == pytest.approx(-0.005, abs=1e-3) and high[1] == pytest.approx(1.739, abs=1e-3)
    place = dict(zip(rig.joint_names, np.linalg.inv(rig.inverse_bind_matrix)[:, :3, 3], strict=True))
    assert place["Bip01 L Hand"][0] > 0.5 and place["Bip01 R Hand"][0] < -0.5
    assert place["Bip01 L Toe0"][2] > place["Bip01 L Foot"][2] + 0.05
    assert len(found.morph_names) == 175
    assert {canonical(name) for name in found.morph_names} - {None} == set(ARKIT_NAMES)
    expressions = expressions_named(found.morph_names)
    avatar = rig_avatar(rig, expressions)
    assert clips_from(avatar, path, optional=True) == ()
    driving = rig_driving(rig, expressions)
    assert (driving.mode, driving.head_joint, driving.left_eye_joint) == ("names", "Bip01 Head", None)
    player = Player(avatar)
    neutral, opened = player.mesh(Pose()), player.mesh(Pose({"jawOpen": 1.0}))  # by its alias
    moved = (opened - neutral)[np.argmax(np.abs(opened - neutral).max(axis=1))]
    assert moved[1] < -0.015, "the jaw goes down"
    np.testing.assert_allclose(neutral, rig.vertices, atol=1e-6)


ASCII = fbx_files.fbx()


@settings(MANGLING, max_examples=examples(20))
@given(mangled(ASCII))
def test_mangled_text(tmp_path_factory: Any, data: bytes) -> None:
    path = _written(tmp_path_factory.getbasetemp(), data)
    only_avatar_errors(lambda: fbx_rig(open_fbx(path)))


NUMBERS = [i for i in range(1, len(ASCII) - 1) if ASCII[i : i + 1].isdigit()]


@settings(MANGLING, max_examples=examples(20))
@given(
    st.sampled_from(NUMBERS), st.sampled_from([b"-1", b"9999999999", b"1e300", b"nan", b"", b"4294967295"])
)
def test_any_number_in_the_text(tmp_path_factory: Any, at: int, number: bytes) -> None:
    path = _written(tmp_path_factory.getbasetemp(), ASCII[:at] + number + ASCII[at + 1 :])
    only_avatar_errors(lambda: fbx_rig(open_fbx(path)))


def _arrays(tmp: Path) -> dict[str, Any]:
    data = fbx_file._run(_written(tmp, ASCII).read_bytes(), "made.fbx")
    with np.load(io.BytesIO(data)) as archive:
        return dict(archive)


Change = Callable[[dict[str, Any]], object]


def _header(change: Change) -> Change:
    def apply(arrays: dict[str, Any]) -> None:
        header = json.loads(bytes(arrays["header"]))
        change(header)
        arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)

    return apply


BAD: dict[str, tuple[Change, str]] = {
    "no header": (lambda a: a.pop("header"), "header: is missing"),
    "another header": (lambda a: a.update(header=np.frombuffer(b"[]", np.uint8)), "header: is not a JSON object"),
    "unit of zero": (_header(lambda h: h.update(unit_metres=0)), "UnitScaleFactor: is 0 m per unit"),
    "unit of text": (_header(lambda h: h.update(unit_metres="1")), "unit_metres: is not a number"),
    "unknown axes": (lambda a: a.update(axes=np.array([6, 6, 6])), "UpAxis: does not name an axis"),
    "loop": (lambda a: a["parents"].__setitem__(1, 4), "nodes: contains a loop"),
    "parent that is not there": (lambda a: a["parents"].__setitem__(1, 9), "parents: holds values -1..9"),
    "corner that is not there": (lambda a: a["mesh0.indices"].__setitem__(0, 12), "mesh0.indices: holds"),
    "face beyond": (
        lambda a: a["mesh0.faces"].__setitem__((4, 1), 9),
        "mesh0: has a face that reads beyond its corners",
    ),
    "not finite": (lambda a: a["mesh0.vertices"].__setitem__((0, 0), np.nan), "not a finite number"),
    "another shape": (lambda a: a.update({"mesh0.vertices": np.zeros((3, 2))}), "or has another shape"),
    "weights too few": (
        lambda a: a.update({"mesh0.cluster0.weights": np.zeros(1)}),
        "mesh0: a cluster has 1 values",
    ),
    "negative weight": (
        lambda a: a["mesh0.cluster0.weights"].__setitem__(0, -1),
        "joint hip: has a negative weight",
    ),
    "no weight": (
        lambda a: [a[f"mesh0.cluster{i}.weights"].fill(0) for i in range(2)],
        "skin: vertex 0 has no joint",
    ),
    "flat bind": (
        lambda a: a["mesh0.cluster1.geometry_to_bone"].fill(0),
        "joint 'head': has a singular bind matrix",
    ),
    "bone that is not there": (
        _header(lambda h: h["meshes"][0].update(bones=[1, 7])),
        "bones: is not a list of indices",
    ),
    "joint without a name": (_header(lambda h: h["nodes"].__setitem__(1, "\x1b")), "is not a valid name of a joint"),
    "joints of one name": (_header(lambda h: h["nodes"].__setitem__(4, "hip")), "a duplicate"),
    "a vertex twice": (
        lambda a: a["mesh0.shape0.vertices"].fill(4),
        "blend shapes: moves a vertex twice",
    ),
    "no mesh": (_header(lambda h: h.update(meshes=[])), "meshes: has no skinned mesh"),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_what_comes_back_is_checked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, case: str) -> None:
    change, message = BAD[case]
    arrays = _arrays(tmp_path)
    change(arrays)
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    monkeypatch.setattr(fbx_file, "_run", lambda data, file: stream.getvalue())
    with pytest.raises(AvatarError) as caught:
        fbx_rig(open_fbx(tmp_path / "made.fbx"))
    assert message in str(caught.value) and str(caught.value).startswith("made.fbx: ")


def test_what_comes_back_mangled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stream = io.BytesIO()
    np.savez(stream, **_arrays(tmp_path))
    sound, rng = stream.getvalue(), np.random.default_rng(8)
    for _ in range(300):
        data = bytearray(sound)
        for at in rng.integers(0, len(data), rng.integers(1, 4)):
            data[at : at + 2] = rng.choice([b"\0\0", b"\xff\xff", b"", b"7", rng.bytes(2)])
        monkeypatch.setattr(fbx_file, "_run", lambda *_, given=bytes(data): given)
        only_avatar_errors(lambda: fbx_rig(open_fbx(tmp_path / "made.fbx")))
