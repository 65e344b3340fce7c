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
from avatar_export.notes.text import stored
from avatar_export.rigs.fbx_rig import FbxRig, fbx_rig
from avatar_export.rigs.rig_driving import expressions_named, rig_driving
from avatar_runtime.driving.arkit import ARKIT_NAMES, canonical
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.exporter.refusals import put, refused
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


def test_a_clip_of_other_names_is_refused(tmp_path: Path) -> None:
    path = _written(tmp_path, fbx_files.fbx())
    file = open_fbx(path)
    avatar = rig_avatar(replace(fbx_rig(file).rig, joint_names=("a", "b")), expressions_named(("c",)))
    assert clips_from(avatar, path, optional=True) == ()
    refused(r"made\.fbx: has no animation that moves a joint", clips_from, avatar, path)
    refused(
        "is not a joint or expression of this avatar", fbx_clip.clip_of, avatar, file, file.clips[0], "nod"
    )


def test_weights_off_one_are_divided_by_their_sum(tmp_path: Path) -> None:
    found = _rig(tmp_path, Settings(weight=0.5))
    assert "12 vertices" in str(stored(found.notes))
    sums = np.add.reduceat(found.rig.skin.values["weight"], found.rig.skin.row_ptr[:-1].astype(int))
    np.testing.assert_allclose(sums, 1, atol=1e-6)


def test_two_meshes_are_joined(tmp_path: Path) -> None:
    found, one = _rig(tmp_path, Settings(meshes=2)), _rig(tmp_path, Settings()).rig
    rig, v = found.rig, len(one.vertices)
    np.testing.assert_array_equal(rig.vertices, np.concatenate([one.vertices] * 2))
    np.testing.assert_array_equal(rig.triangles, np.concatenate([one.triangles, one.triangles + v]))
    assert rig.joint_names == one.joint_names and found.morph_names == ("jawOpen",)
    np.testing.assert_array_equal(rig.skin.column, np.concatenate([one.skin.column] * 2))
    assert "mesh0, mesh1" in str(stored(found.notes))


def test_settings_that_are_refused(tmp_path: Path) -> None:
    two_poses, left = Settings(meshes=2, second_bind_offset=0.02), fbx_files.fbx(Settings(right=(0, -1)))
    refused(r"made\.fbx: joint 'hip': is bound in two poses", _rig, tmp_path, two_poses)
    refused(r"made\.fbx: CoordAxis: has left-handed axes", open_fbx, _written(tmp_path, left))


def test_other_files(tmp_path: Path) -> None:
    for data in (b"", b"glTF", b"Kaydara FBX Binary  \0\x1a\0" + bytes(40), b"; FBX 7.4.0 project file\n"):
        refused(r"made\.fbx", lambda path: fbx_rig(open_fbx(path)), _written(tmp_path, data))
    refused("cannot be read", open_fbx, tmp_path / "missing.fbx")


def test_without_the_extra_its_name_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    refused(
        r"needs the extra \[fbx\]: pip install -e .*\[fbx\]",
        lambda: open_fbx(_written(tmp_path, fbx_files.fbx())),
    )


def test_crashes_of_the_reader(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "crash.py"
    program.write_text("import os, signal\nos.kill(os.getpid(), signal.SIGSEGV)\n")
    monkeypatch.setattr(fbx_file, "PROGRAM", program)
    refused("crashes the FBX reader", lambda: open_fbx(_written(tmp_path, fbx_files.fbx())))
    program.write_text("import time\ntime.sleep(9)\n")
    monkeypatch.setattr(fbx_file, "_run", lambda *_: b"PK")
    refused("gives no arrays", open_fbx, _written(tmp_path, fbx_files.fbx()))
    monkeypatch.undo()
    monkeypatch.setattr(fbx_file, "PROGRAM", program)
    monkeypatch.setattr(fbx_file, "MAX_SECONDS", 0.2)
    refused(r"takes longer than 0.2 s", lambda: open_fbx(_written(tmp_path, fbx_files.fbx())))


def test_rocketbox() -> None:
    """A real character, 1.74 m tall, upright, facing +Z, its left at +X; its one animation stands still."""
    path = shared("body/rocketbox_female_01_facial.fbx")
    found = fbx_rig(open_fbx(path))
    rig, expressions = found.rig, expressions_named(found.morph_names)
    assert (len(rig.vertices), len(rig.triangles), rig.joint_count) == (4734, 8732, 80)
    assert np.ptp(rig.vertices[:, 1]) == pytest.approx(1.744, abs=2e-3)
    place = dict(zip(rig.joint_names, np.linalg.inv(rig.inverse_bind_matrix)[:, :3, 3], strict=True))
    assert place["Bip01 L Hand"][0] > 0.5 and place["Bip01 L Toe0"][2] > place["Bip01 L Foot"][2] + 0.05
    assert {canonical(name) for name in found.morph_names} - {None} == set(ARKIT_NAMES)
    avatar = rig_avatar(rig, expressions)
    assert clips_from(avatar, path, optional=True) == ()
    driving, player = rig_driving(rig, expressions), Player(avatar)
    assert (driving.mode, driving.head_joint, driving.left_eye_joint) == ("names", "Bip01 Head", None)
    moved = player.mesh(Pose({"jawOpen": 1.0})) - player.mesh(Pose())  # by its alias
    assert moved[np.argmax(np.abs(moved).max(axis=1)), 1] < -0.015, "the jaw goes down"


ASCII = fbx_files.fbx()
NUMBERS = [i for i in range(1, len(ASCII) - 1) if ASCII[i : i + 1].isdigit()]
OTHERS = st.sampled_from([b"-1", b"9999999999", b"1e300", b"nan", b"", b"4294967295"])
ANY_NUMBER = st.builds(
    lambda at, number: ASCII[:at] + number + ASCII[at + 1 :], st.sampled_from(NUMBERS), OTHERS
)


@settings(MANGLING, max_examples=examples(40))
@given(mangled(ASCII) | ANY_NUMBER)
def test_mangled_text(tmp_path_factory: Any, data: bytes) -> None:
    path = _written(tmp_path_factory.getbasetemp(), data)
    only_avatar_errors(lambda: fbx_rig(open_fbx(path)))


def _arrays(tmp: Path) -> dict[str, Any]:
    data = fbx_file._run(_written(tmp, ASCII).read_bytes(), "made.fbx")
    with np.load(io.BytesIO(data)) as archive:
        return dict(archive)


Change = Callable[[dict[str, Any]], object]


def _header(*at: Any) -> Change:
    def apply(arrays: dict[str, Any]) -> None:
        header = json.loads(bytes(arrays["header"]))
        put(*at)(header)
        arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)

    return apply


def _no_weight(arrays: dict[str, Any]) -> None:
    for cluster in ("mesh0.cluster0", "mesh0.cluster1"):
        arrays[f"{cluster}.weights"].fill(0)


BAD: list[tuple[Change, str]] = [
    (lambda a: a.pop("header"), "header: is missing"),
    (put("header", np.frombuffer(b"[]", np.uint8)), "header: is not a JSON object"),
    (_header("unit_metres", 0), "UnitScaleFactor: is 0 m per unit"),
    (put("axes", np.array([6, 6, 6])), "UpAxis: does not name an axis"),
    (put("parents", 1, 4), "nodes: contains a loop"),
    (put("mesh0.indices", 0, 12), "mesh0.indices: holds"),
    (put("mesh0.faces", (4, 1), 9), "mesh0: has a face that reads beyond its corners"),
    (put("mesh0.vertices", (0, 0), np.nan), "not a finite number"),
    (put("mesh0.cluster0.weights", np.zeros(1)), "mesh0: a cluster has 1 values"),
    (put("mesh0.cluster0.weights", 0, -1), "joint hip: has a negative weight"),
    (_no_weight, "skin: vertex 0 has no joint"),
    (lambda a: a["mesh0.cluster1.geometry_to_bone"].fill(0), "joint 'head': has a singular bind matrix"),
    (_header("meshes", 0, "bones", [1, 7]), "bones: is not a list of indices"),
    (_header("nodes", 1, "\x1b"), "is not a valid name of a joint"),
    (lambda a: a["mesh0.shape0.vertices"].fill(4), "blend shapes: moves a vertex twice"),
    (_header("meshes", []), "meshes: has no skinned mesh"),
]


@pytest.mark.parametrize(("change", "message"), BAD, ids=[message for _, message in BAD])
def test_bad_arrays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, change: Change, message: str) -> None:
    arrays = _arrays(tmp_path)
    change(arrays)
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    monkeypatch.setattr(fbx_file, "_run", lambda data, file: stream.getvalue())
    refused(f"^made.fbx: .*{message}", lambda: fbx_rig(open_fbx(tmp_path / "made.fbx")))
