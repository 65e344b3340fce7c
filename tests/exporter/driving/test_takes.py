"""Recordings of a face: Live Link CSV and packets, bsData.json, and what they drive."""

from __future__ import annotations

import csv
import gzip
import json
import struct
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.clips.sources import clips_from
from avatar_export.driving import live_link_udp
from avatar_export.driving.drive import poses, unreached
from avatar_export.driving.expression_json import read_expression_json
from avatar_export.driving.frames import DrivingTake
from avatar_export.driving.live_link_csv import read_live_link_csv
from avatar_export.driving.live_link_udp import read_live_link_udp
from avatar_export.driving.takes import is_json_take, read_take
from avatar_runtime.avatar import Driving
from avatar_runtime.driving.arkit import ARKIT_NAMES, CHANNELS
from avatar_runtime.pose import resolve
from tests.avatars import avatar_of, rig_of
from tests.exporter.refusals import put, refused
from tests.runtime.driving.recordings import CSV, UDP, recording

HEADER = "Timecode,BlendShapeCount,JawOpen,EyeBlinkLeft,HeadYaw\n"


def read(text: str) -> DrivingTake:
    return read_live_link_csv(text.encode(), "take.csv")


def test_real_csv() -> None:
    take = read_take(recording(CSV))
    assert (len(take), take.fps, take.missing, take.without_face) == (300, 30.0, (), 0)
    with recording(CSV).open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    for channel in CHANNELS:
        title = channel[0].upper() + channel[1:]
        column = take.channels[:, CHANNELS.index(channel)]
        assert column.tolist() == [float(row[title]) for row in rows]
    frame = take.frame(0)
    assert frame.weights["jawOpen"] == 0.8082652092
    assert frame.left_eye == (-0.0454859883, 0.2549059093, -0.0118478378)
    # 13:15:04:00.682 to 13:15:14:00.601 in frames of 60 a second
    assert take.time[-1] == pytest.approx(10 - 0.081 / 60, abs=1e-9)
    assert take.time[1] == pytest.approx(2 / 60, abs=1e-9)


def test_columns_in_any_order_and_case_and_missing_ones_said() -> None:
    take = read("jawOPEN,extra,TIMECODE,HeadYaw\n0.5,x,01:02:03:00.000,0.25\n0.75,y,01:02:04:30.000,0\n")
    assert take.frame(0).weights["jawOpen"] == 0.5
    assert take.frame(0).head == (0.25, 0.0, 0.0)
    assert take.time.tolist() == [0, 1 + 30 / 48]
    assert set(CHANNELS) - set(take.missing) == {"jawOpen", "headYaw"}


@pytest.mark.parametrize(
    ("first", "last", "seconds"),
    [
        *(("00:00:00:00.0", f"00:00:01:{frame}", 1 + float(frame) / base)
          for frame, base in (("23.9", 24), ("24.0", 25), ("29.5", 30), ("58.0", 60))),
        ("00:00:00:00.0", "00:00:00:03.0", 0.05),  # within one second the base is 60
        ("23:59:59:59.0", "00:00:00:01.0", 2 / 60),  # midnight may pass
    ],
)  # fmt: skip
def test_timecode_base(first: str, last: str, seconds: float) -> None:
    take = read(f"{HEADER}{first},61,0,0,0\n{last},61,0,0,0\n")
    assert take.time[1] == pytest.approx(seconds)


def test_rows_without_a_face_are_left_out() -> None:
    take = read(f"{HEADER}00:00:00:00.0,61,0.5,0,0\n00:00:00:01.0,0,,,\n\n00:00:00:02.0,61,0.25,0,0\n")
    assert (len(take), take.without_face) == (2, 1)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "no frame"),
        ("00:00:00:00.0,61,x,0,0\n", "JawOpen: row 2: 'x'"),
        ("00:00:00:00.0,61,0,0,0\n00:00:00:01.0,61,0,nan,0\n", "EyeBlinkLeft: row 3: 'nan'"),
        ("00:00:00:00.0,61,0,0\n", "row 2 has 4 fields, but the header has 5"),
        ("00:00:61:00.0,61,0,0,0\n", "Timecode: row 2: '00:00:61:00.0' is not a time of day"),
        ("12.5,61,0,0,0\n", "Timecode: row 2: '12.5' is not a timecode HH:MM:SS:FF.sss"),
        ("00:00:02:00.0,61,0,0,0\n00:00:01:00.0,61,0,0,0\n", "frame 1 is earlier"),
        ("Timecode,JawOpen,jaw_open\n", "columns 2 and 3 are both jawOpen"),
        ("Timecode,BlendShapeCount,Jaw\n", "is not an ARKit column"),
        ("Time,JawOpen\n", "no Timecode column"),
        ('Timecode,"JawOpen\n', "is not valid CSV"),
        ("Timecode,JawOpen\n\udcff", "is not UTF-8"),
    ],
)
def test_bad_csv(text: str, said: str) -> None:
    whole = text if text.startswith("Time") else HEADER + text
    refused(rf"take\.csv.*{said}", read_live_link_csv, whole.encode("utf-8", "surrogateescape"), "take.csv")


def packet(
    values: list[float] | None = None, *, subject: str = "face", frame: int = 7, sub: float = 0.5
) -> bytes:
    texts = b"".join(struct.pack(">I", len(t)) + t.encode() for t in ("device", subject))
    body = b"" if values is None else struct.pack(f">B{len(values)}f", len(values), *values)
    return b"\x06" + texts + struct.pack(">ifii", frame, sub, 60, 1) + body


def recorded(*packets: bytes) -> bytes:
    return struct.pack(">BI", 6, len(packets)) + b"".join(struct.pack(">I", len(p)) + p for p in packets)


FACE = [i / 64 for i in range(61)]


def test_real_packets() -> None:
    take = read_take(recording(UDP))
    assert (len(take), take.fps, take.missing, take.without_face) == (180, 60.0, (), 0)
    plain = gzip.decompress(recording(UDP).read_bytes())
    assert len(plain) == 5 + 180 * (4 + 320)
    # The last packet, taken apart by hand: its channels are its last 244 bytes.
    assert take.channels[-1].tolist() == list(struct.unpack(">61f", plain[-244:]))
    assert take.frame(0).head == pytest.approx((0.0596, 0.0184, -0.1138), abs=5e-4)
    first, last = (struct.unpack(">if", plain[at : at + 8]) for at in (5 + 4 + 59, len(plain) - 320 + 59))
    assert take.time[-1] == pytest.approx((sum(last) - sum(first)) / 60)


def test_packets_are_sorted_repeats_dropped_and_faceless_counted() -> None:
    zero = [0.0] * 61
    twice = packet(FACE, frame=9)
    data = recorded(twice, packet(zero, frame=8), twice, packet(None, frame=10))
    for form in (data, gzip.compress(data, mtime=0)):
        take = read_live_link_udp(form, "take")
        assert (take.time * 60).tolist() == pytest.approx([0, 1])
        assert take.channels[:, 1].tolist() == [0, FACE[1]]
        assert take.without_face == 1


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"\x06", "is not a recording"),
        (recorded(), "no frame"),
        (struct.pack(">BI", 6, 1 << 31), "announces 2147483648 packets"),
        (recorded(packet(FACE))[:-1], "announces 280 bytes, but 279 are left"),
        (recorded(packet(FACE)) + b"x", "1 bytes after packet 0"),
        (recorded(packet(FACE), b"\x05" + packet(FACE)[1:]), "packet 1: version 5"),
        (recorded(packet(FACE[:60])), "60 channels"),
        (recorded(packet(FACE) + b"\0"), "61 channels in 245 bytes"),
        (recorded(packet([*FACE[:60], float("nan")])), "rightEyeRoll: frame 0: nan"),
        (recorded(packet(FACE), packet(FACE, subject="other", frame=8)), "2 devices or subjects"),
        (recorded(b"\x06" + struct.pack(">I", 5000) + bytes(6000)), "device id of 5000 bytes"),
        (recorded(packet(FACE).replace(b"device", b"\xff\xfe\xfd\xfc\xfb\xfa")), "device id is not UTF-8"),
        (gzip.compress(recorded(packet(FACE)), mtime=0)[:-9], "damaged gzip"),
    ],
)
def test_bad_packets(data: bytes, said: str) -> None:
    refused(rf"take\.bin.*{said}", read_live_link_udp, data, "take.bin")


def test_a_gzip_bomb_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_link_udp, "MAX_BYTES", 1 << 20)
    bomb = gzip.compress(bytes(2 << 20), mtime=0)
    refused("unpacks to more than 1 MiB", read_live_link_udp, bomb, "bomb")


def test_formats_are_told_by_content(tmp_path: Path) -> None:
    path = tmp_path / "take.json"
    path.write_bytes(recorded(packet(FACE)))
    assert len(read_take(path)) == 1
    path.write_text(f"{HEADER}00:00:00:00.0,61,0,0,0\n")
    assert len(read_take(path)) == 1
    for other in (b"", b"{}", b"\x89PNG"):
        path.write_bytes(other)
        refused("is neither", read_take, path)
    for missing in (tmp_path / "absent", tmp_path):
        refused("cannot be read", read_take, missing)


NAMES = ["tongueOut", "jawOpen", "unknown", "browInnerUp"]


def document(frames: int = 5, fps: float = 30.0) -> dict[str, Any]:
    return {
        "names": list(NAMES),
        "metadata": {"fps": fps, "frame_count": frames, "blendshape_names": NAMES},
        "frames": [
            {"weights": [0.1 * k, 0.2, 3.0, 0.3 * k], "time": k / fps, "rotation": []} for k in range(frames)
        ],
    }


def test_a_take_by_name(tmp_path: Path) -> None:
    path = tmp_path / "bsData.json"
    path.write_text(json.dumps(document(), indent=2), "utf-8-sig")
    found = read_take(path)
    assert is_json_take(path) and (found.fps, len(found)) == (30, 5)
    want = np.zeros((5, len(CHANNELS)))
    want[:, CHANNELS.index("tongueOut")] = 0.1 * np.arange(5)
    want[:, CHANNELS.index("jawOpen")] = 0.2
    want[:, CHANNELS.index("browInnerUp")] = 0.3 * np.arange(5)
    np.testing.assert_array_equal(found.channels, want)
    np.testing.assert_allclose(found.time, np.arange(5) / 30)
    assert len(found.missing) == len(CHANNELS) - 3
    (clip,) = clips_from(replace(avatar_of(("jawOpen",)), driving=Driving(mode="names")), path)
    assert (clip.name, clip.frames) == ("bsData", 5) and clip.expression_weights.any()


def test_other_spellings_are_the_same_take(tmp_path: Path) -> None:
    said = document()
    rows = [one["weights"] for one in said["frames"]]
    own = {"names": NAMES, "fps": 30, "frames": rows}
    audio2face = {"exportFps": 30.0, "facsNames": NAMES, "numPoses": 4, "numFrames": 5, "weightMat": rows}
    path = tmp_path / "weights.json"
    for other in (own, audio2face):
        path.write_text(json.dumps(other), "utf-8")
        found = read_take(path)
        assert is_json_take(path) and (found.fps, len(found)) == (30, 5)
        np.testing.assert_array_equal(
            found.channels, read_expression_json(json.dumps(said).encode(), "a").channels
        )
    for wrong, message in (
        ({**own, "fps": 0}, "weights.json: fps: is 0, not frames per second"),
        ({**own, "frames": [[1]]}, r"frames\[0\]: expected 4 numbers"),
        ({**audio2face, "numFrames": 6}, "numFrames: is 6, but there are 5 frames"),
    ):
        path.write_text(json.dumps(wrong), "utf-8")
        refused(message, read_take, path)


def frame(key: str, value: Any) -> Callable[[Any], None]:
    return put("frames", 2, key, value)


def metadata(key: str, value: Any) -> Callable[[Any], None]:
    return put("metadata", key, value)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda said: said["names"].pop(), r"frames\[0\].weights: expected 3 numbers"),
        (put("names", 0, "JawOpen"), "names: has jawOpen twice"),
        (put("names", list("abcd")), "is not an ARKit name"),
        *((frame("weights", values), r"frames\[2\].weights") for values in (["1", 2, 3, 4], [float("nan"), 2, 3, 4])),
        (frame("weights", [500, 2, 3, 4]), "tongueOut: frame 2: 500.0 is neither"),
        (frame("rotation", [0.1, 0, 0]), r"frames\[2\].rotation: is not empty"),
        *((frame("time", value), r"frames\[2\].time") for value in (0.0, "now")),
        (metadata("fps", 25), "metadata.fps: is 25, but the times of its frames make 30"),
        (metadata("frame_count", 6), "frame_count: is 6, but there are 5 frames"),
        (lambda said: said.update(frames=[], metadata={"fps": 30}), "has no frame with a face"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(change: Callable[[Any], None], message: str) -> None:
    said = document()
    change(said)
    refused(message, read_expression_json, json.dumps(said).encode(), "bsData.json")
    refused("is not valid JSON", read_expression_json, b"{", "bsData.json")


RIG = rig_of(("head", "leftEye"), [-1, 0], np.tile(np.eye(4), (2, 1, 1)))


def test_the_real_take_drives_and_resolves() -> None:
    avatar = avatar_of(ARKIT_NAMES[:51], RIG, Driving("names", left_eye_joint="leftEye", head_joint="head"))
    take = read_take(recording(CSV))
    made = poses(avatar, take)
    assert len(made) == 300 and unreached(avatar) == ["tongueOut"]
    jaw = [resolve(p, avatar).expression_weights[ARKIT_NAMES.index("jawOpen")] for p in made]
    assert jaw == pytest.approx(take.channels[:, ARKIT_NAMES.index("jawOpen")], abs=1e-7)
