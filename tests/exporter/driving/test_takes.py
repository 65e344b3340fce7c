from __future__ import annotations

import csv
import gzip
import io
import struct
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_export.driving import live_link_udp
from avatar_export.driving.frames import DrivingTake, frame_rate
from avatar_export.driving.live_link_csv import read_live_link_csv
from avatar_export.driving.live_link_udp import parse_packet, read_live_link_udp
from avatar_export.driving.takes import read_take
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.io.errors import AvatarError
from tests.runtime.driving.recordings import CSV, UDP, recording
from tests.session.fuzz import examples

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
    ("last", "base"),
    [("00:00:01:23.9", 24), ("00:00:01:24.0", 25), ("00:00:01:29.5", 30), ("00:00:01:58.0", 60)],
)
def test_timecode_base(last: str, base: int) -> None:
    take = read(f"{HEADER}00:00:00:00.0,61,0,0,0\n{last},61,0,0,0\n")
    assert take.time[1] == pytest.approx(1 + float(last.split(":")[-1]) / base)


def test_within_one_second_the_base_is_60_and_midnight_may_pass() -> None:
    assert read(f"{HEADER}00:00:00:00.0,61,0,0,0\n00:00:00:03.0,61,0,0,0\n").time[1] == 0.05
    assert read(f"{HEADER}23:59:59:59.0,61,0,0,0\n00:00:00:01.0,61,0,0,0\n").time[1] == pytest.approx(2 / 60)


def test_rows_without_a_face_are_left_out() -> None:
    take = read(f"{HEADER}00:00:00:00.0,61,0.5,0,0\n00:00:00:01.0,0,,,\n\n00:00:00:02.0,61,0.25,0,0\n")
    assert (len(take), take.without_face) == (2, 1)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (HEADER, "no frame"),
        (f"{HEADER}00:00:00:00.0,61,x,0,0\n", "JawOpen: row 2: 'x'"),
        (f"{HEADER}00:00:00:00.0,61,0,0,0\n00:00:00:01.0,61,0,nan,0\n", "EyeBlinkLeft: row 3: 'nan'"),
        (f"{HEADER}00:00:00:00.0,61,0,0,1e300\n", "HeadYaw: row 2"),
        (f"{HEADER}00:00:00:00.0,61,0,0\n", "row 2 has 4 fields, but the header has 5"),
        (f"{HEADER}00:00:61:00.0,61,0,0,0\n", "Timecode: row 2: '00:00:61:00.0' is not a time of day"),
        (f"{HEADER}12.5,61,0,0,0\n", "Timecode: row 2: '12.5' is not a timecode HH:MM:SS:FF.sss"),
        (f"{HEADER}00:00:02:00.0,61,0,0,0\n00:00:01:00.0,61,0,0,0\n", "frame 1 is earlier"),
        ("Timecode,JawOpen,jaw_open\n", "columns 2 and 3 are both jawOpen"),
        ("Timecode,BlendShapeCount,Jaw\n", "is not an ARKit column"),
        ("Time,JawOpen\n", "no Timecode column"),
        ('Timecode,"JawOpen\n', "is not valid CSV"),
        ("Timecode,JawOpen\n\udcff", "is not UTF-8"),
    ],
)
def test_bad_csv(text: str, said: str) -> None:
    with pytest.raises(AvatarError, match=r"take\.csv") as caught:
        read_live_link_csv(text.encode("utf-8", "surrogateescape"), "take.csv")
    assert said in str(caught.value)


def test_frame_rate_snaps_to_a_whole_number_but_not_from_29_97() -> None:
    assert frame_rate(np.arange(10) / 30.005) == 30
    assert frame_rate(np.arange(10) * 1001 / 30000) == pytest.approx(29.97003, abs=1e-4)
    assert frame_rate(np.zeros(1)) == 30


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


def test_packet_fields() -> None:
    found = parse_packet(packet(FACE))
    assert (found.device, found.subject, found.time) == ("device", "face", 7.5 / 60)
    assert found.channels is not None and found.channels.tolist() == FACE
    assert parse_packet(packet(None)).channels is None


def test_packets_are_sorted_repeats_dropped_and_faceless_counted() -> None:
    zero = [0.0] * 61
    data = recorded(
        packet(FACE, frame=9), packet(zero, frame=8), packet(FACE, frame=9), packet(None, frame=10)
    )
    for form in (data, gzip.compress(data, mtime=0)):
        take = read_live_link_udp(form, "take")
        assert (take.time * 60).tolist() == pytest.approx([0, 1])
        assert take.channels[:, 1].tolist() == [0, FACE[1]]
        assert take.without_face == 1


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"\x06", "is not a recording"),
        (b"\x05" + recorded()[1:], "is not a recording"),
        (recorded(), "no frame"),
        (recorded(packet(None)), "no frame"),
        (struct.pack(">BI", 6, 1 << 31), "announces 2147483648 packets"),
        (recorded(packet(FACE))[:-1], "announces 280 bytes, but 279 are left"),
        (recorded(packet(FACE)) + b"x", "1 bytes after packet 0"),
        (recorded(packet(FACE), b"\x05" + packet(FACE)[1:]), "packet 1: version 5"),
        (recorded(packet(FACE[:60])), "60 channels"),
        (recorded(packet(FACE) + b"\0"), "61 channels in 245 bytes"),
        (recorded(packet([*FACE[:60], float("nan")])), "rightEyeRoll: frame 0: nan"),
        (recorded(packet(FACE, sub=float("nan"))), "frame time"),
        (recorded(packet(FACE), packet(FACE, subject="other", frame=8)), "2 devices or subjects"),
        (recorded(b"\x06" + struct.pack(">I", 5000) + bytes(6000)), "device id of 5000 bytes"),
        (recorded(packet(FACE).replace(b"device", b"\xff\xfe\xfd\xfc\xfb\xfa")), "device id is not UTF-8"),
        (gzip.compress(b"anything", mtime=0), "is not a recording"),
        (gzip.compress(recorded(packet(FACE)), mtime=0)[:-9], "damaged gzip"),
    ],
)
def test_bad_packets(data: bytes, said: str) -> None:
    with pytest.raises(AvatarError, match=r"take\.bin") as caught:
        read_live_link_udp(data, "take.bin")
    assert said in str(caught.value)


def test_a_gzip_bomb_is_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(live_link_udp, "MAX_BYTES", 1 << 20)
    with pytest.raises(AvatarError, match="unpacks to more than 1 MiB"):
        read_live_link_udp(gzip.compress(bytes(2 << 20), mtime=0), "bomb")


def test_formats_are_told_by_content(tmp_path: Path) -> None:
    path = tmp_path / "take.json"
    path.write_bytes(recorded(packet(FACE)))
    assert len(read_take(path)) == 1
    path.write_text(f"{HEADER}00:00:00:00.0,61,0,0,0\n")
    assert len(read_take(path)) == 1
    for other in (b"", b"{}", b"\x89PNG"):
        path.write_bytes(other)
        with pytest.raises(AvatarError, match="is neither"):
            read_take(path)
    with pytest.raises(AvatarError, match="cannot be read"):
        read_take(tmp_path / "absent")
    with pytest.raises(AvatarError, match="cannot be read"):
        read_take(tmp_path)


def clean(reader: Callable[[bytes, str], DrivingTake], data: bytes) -> None:
    try:
        take = reader(data, "take")
    except AvatarError as error:
        assert "\n" not in str(error)
    else:
        assert take.channels.shape == (len(take), 61)
        assert np.isfinite(take.channels).all() and np.isfinite(take.time).all() and np.isfinite(take.fps)


MANGLE = st.lists(st.tuples(st.integers(0, 10_000), st.binary(max_size=6)), max_size=4)


def mangled(data: bytes, edits: list[tuple[int, bytes]]) -> bytes:
    for at, new in edits:
        at %= len(data) + 1
        data = data[:at] + new + data[at + max(len(new), 1) :]
    return data


@settings(max_examples=examples(150))
@given(MANGLE, st.binary(max_size=200))
def test_no_bytes_break_the_packet_reader(edits: list[tuple[int, bytes]], noise: bytes) -> None:
    clean(read_live_link_udp, mangled(recorded(packet(FACE), packet(FACE, frame=8)), edits))
    clean(read_live_link_udp, mangled(gzip.compress(recorded(packet(FACE)), mtime=0), edits))
    clean(read_live_link_udp, noise)


@settings(max_examples=examples(150))
@given(MANGLE, st.binary(max_size=200), st.text(alphabet='0123456789:.,-"eEn\n\r\0;', max_size=60))
def test_no_bytes_break_the_csv_reader(edits: list[tuple[int, bytes]], noise: bytes, tail: str) -> None:
    rows = io.StringIO(f"{HEADER}00:00:00:00.5,61,0.5,0.25,0\n00:00:01:20.0,61,1,0,0\n")
    clean(read_live_link_csv, mangled(rows.getvalue().encode(), edits))
    clean(read_live_link_csv, HEADER.encode() + tail.encode())
    clean(read_live_link_csv, noise)
