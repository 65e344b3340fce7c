"""What is said of a recording for an avatar: what it lacks, what looks wrong in it, what it moves nothing with."""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avatar_export.clips.doubts import take_notes, unmoved
from avatar_export.conversion import read_source
from avatar_export.convert_options import SourceOptions
from avatar_export.driving.takes import read_take, take_of
from avatar_export.notes.text import text
from avatar_runtime.avatar import Avatar, Driving, SparseRows
from avatar_runtime.driving.arkit import ARKIT_NAMES
from tests import bundles
from tests.avatars import avatar_of, full_avatar, rig_of
from tests.runtime.driving.recordings import CSV, UDP, recording

RIG = rig_of(("head", "leftEye"), [-1, 0], np.tile(np.eye(4), (2, 1, 1)))


def csv_of(names: str, *rows: str) -> bytes:
    return "\n".join((f"Timecode,BlendShapeCount,{names}", *rows)).encode()


def moving(avatar: Avatar) -> Avatar:
    """`avatar` with a Gaussian that every expression moves."""
    count = len(avatar.expressions)
    values = {"mean": np.ones((count, 3), np.float32), "quat_wxyz": np.zeros((count, 4), np.float32)}
    columns = np.arange(count, dtype=np.uint16)
    geometry = SparseRows(np.array([0, count], np.uint32), columns, values, count)
    return replace(avatar, blendshapes=replace(avatar.blendshapes, geometry=geometry))


def json_of(weights: Iterable[float]) -> bytes:
    frames = [{"weights": [0, 0, weight], "time": k / 30} for k, weight in enumerate(weights)]
    return json.dumps({"names": FACES[::-1], "metadata": {"fps": 30}, "frames": frames}).encode()


FACES = ("jawOpen", "browInnerUp", "tongueOut")
EYES = Driving("names", left_eye_joint="leftEye", head_joint="head")
ALL = "JawOpen,BrowInnerUp,TongueOut,LeftEyeYaw,RightEyeYaw,EyeLookUpLeft,EyeLookDownLeft,EyeLookInLeft,EyeLookOutLeft"
STEADY = [f"00:00:00:{k:02}.0,61,{'0,' * 8}1" for k in range(0, 60, 2)]


@pytest.mark.parametrize(
    ("data", "driving", "said"),
    [
        (csv_of(ALL, *STEADY), EYES, []),
        (csv_of("JawOpen,EyeBlinkLeft", "00:00:00:00.0,61,0,0"), Driving("names"),
         ["fact: take lacks 2 of the 52 ARKit names, which stay 0: browInnerUp, tongueOut"]),
        # eyes that were measured need no weights; the others turn by four
        (csv_of(f"{','.join(FACES)},LeftEyeYaw,RightEyeYaw", "00:00:00:00.0,61,0,0,0,0,0"), EYES, []),
        (csv_of(",".join(FACES), "00:00:00:00.0,61,0,0,0"), EYES,
         ["fact: take lacks 4 of the 52 ARKit names, which stay 0: eyeLookDownLeft, eyeLookInLeft, eyeLookOutLeft, "
          "eyeLookUpLeft"]),
        (csv_of(ALL, *STEADY, "00:00:03:00.0,61,0,0,0,0,0,0,0,0,0"), EYES,
         ["doubt: gaps in take: 1, the first 2.03 s long, 0.967 s after the begin; what follows plays early, by 2 s "
          "in the end"]),
        (csv_of(ALL, *STEADY, "00:00:01:12.0,61,0,0,0,0,0,0,0,0,0"), EYES, []),  # 7 frames of 30 a second
        (csv_of(ALL, *STEADY[:-1], "00:00:00:58.0,61,45,0,0,0,0,0,0,0,0"), EYES,
         ["doubt: take: jawOpen is 45 in frame 29: are the weights percent? Divide them by 100: 1 is the whole shape"]),
        (csv_of(ALL, *STEADY[:-1], "00:00:00:58.0,61,4.5,0,0,3.1,0,0,0,0,0"), EYES, []),  # exaggerated; an angle
        (csv_of(ALL, *STEADY, "00:00:01:00.0,0,0,0,0,0,0,0,0,0,0"), EYES,
         ["fact: frames of take without a face are left out: 1"]),
        (csv_of(ALL, *STEADY[:-1], "00:00:00:58.0,61,0,0,0,-25.3,0,0,0,0,0"), EYES,
         ["doubt: take: leftEyeYaw is -25.3 in frame 29: are the angles degrees? They are radians"]),
        (json_of((0, 80 / 3, 160 / 3, 80)), Driving("names"),
         ["doubt: take: jawOpen is 80 in frame 3: are the weights percent? Divide them by 100: 1 is the whole shape"]),
        (json_of((0, 0.8)), Driving("names"), []),
    ],
)  # fmt: skip
def test_what_a_take_lacks_or_gets_wrong_is_said(data: bytes, driving: Driving, said: list[str]) -> None:
    avatar = moving(avatar_of(FACES, RIG, driving))
    found = [note for note in take_notes(avatar, take_of(data, "take")) if note.kind != "channels_unused"]
    assert [f"{note.severity}: {text(note)}" for note in found] == said


@pytest.mark.parametrize("name", [CSV, UDP])
def test_real_takes_give_no_false_alarm(name: str) -> None:
    avatar = moving(avatar_of(ARKIT_NAMES, RIG, EYES))
    assert take_notes(avatar, read_take(recording(name))) == []


def test_a_name_that_moves_nothing_is_found() -> None:
    """Not among the names, a column of zeros, a shape without differences; an eye's joint follows its weights."""
    matrix = np.array([[1.0, 0.0], [0.0, 0.0]], np.float32)
    driven = Driving(
        "matrix", ("jawOpen", "tongueOut"), ("expression/jawOpen", "expression/tongueOut"), matrix
    )
    avatar = avatar_of(FACES, RIG, driven)
    asked = ("jawOpen", "tongueOut", "cheekPuff", "eyeLookUpLeft")
    assert unmoved(moving(avatar), asked) == ["tongueOut", "cheekPuff", "eyeLookUpLeft"]
    assert unmoved(avatar, asked)[0] == "jawOpen", "its expression changes nothing"
    turning = replace(avatar, driving=replace(driven, left_eye_joint="leftEye"))
    assert unmoved(moving(turning), asked) == ["tongueOut", "cheekPuff"]


@pytest.mark.parametrize("missing", [0, 8])
def test_a_gap_in_a_given_clip_is_named_once(missing: int, tmp_path: Path) -> None:
    """Not again where the avatar brings the clip: it was judged when it was made."""
    times = np.delete(np.arange(90), slice(40, 40 + missing))
    (take := tmp_path / "take.json").write_bytes(json_of((0.5 + 0.5 * np.sin(times / 7)).tolist()))
    source = bundles.write(tmp_path / "bare", replace(full_avatar(), clips=()))
    for name, options in (("once", {"clips": (take,)}), ("again", {})):
        found = read_source(source, SourceOptions(**options), lambda _: None)
        said = [text(note) for note in found.clip_notes if note.kind == "clip_gaps"]
        gap = "clip take does not move after frame 39 as before: are frames missing?"
        assert said == [gap] * bool(missing and options)
        source = bundles.write(tmp_path / name, found.avatar)
