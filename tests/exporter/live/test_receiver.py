"""Motion over real sockets, from a sender to the page and into a recording."""

from __future__ import annotations

import json
import logging
import socket
import time
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from websockets.sync.client import ClientConnection, connect

from avatar_export.driving.takes import read_take
from avatar_export.live.inbox import Inbox, LiveFrame
from avatar_export.live.ports import Ports
from avatar_export.live.receiver import Receiver
from avatar_export.live.recording import Recorder, timecode
from avatar_export.live.vmc import VmcReader
from avatar_runtime.driving.arkit import ARKIT_NAMES, CHANNELS
from avatar_runtime.driving.axes import head_rotation
from avatar_runtime.driving.frame import frame_of
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rotation import matrix_from_rotvec
from tests.exporter.live.senders import live_link_packets, osc, vmc_bundle
from tests.exporter.serving.packs import Running, of, running
from tests.runtime.driving.recordings import UDP, recording
from tests.session.fuzz import examples


class Stage:
    """A server with a receiver, a page that is open, and a socket that sends."""

    def __init__(self, server: Running, receiver: Receiver, page: ClientConnection, lines: list[str]) -> None:
        self.server, self.receiver, self.page, self.lines = server, receiver, page, lines
        self._out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)

    def live_link(self, packet: bytes) -> None:
        self._out.sendto(packet, ("127.0.0.1", self.receiver.ports.live_link))

    def osc(self, packet: bytes) -> None:
        self._out.sendto(packet, ("127.0.0.1", self.receiver.ports.osc))

    def frame(self, timeout: float = 2.0) -> Any:
        """The next frame that the page gets; it says that it shows it."""
        said = json.loads(self.page.recv(timeout))
        assert said["type"] == "live"
        self.page.send(json.dumps({"type": "shown", "time": said["time"]}))
        return said


@contextmanager
def stage(record: Path | None = None) -> Iterator[Stage]:
    lines: list[str] = []
    receiver = Receiver(Ports(0, 0), lines.append, record)
    with running([of("head")], receiver=receiver) as server, connect(server.events) as page:
        assert page.ping().wait(2)
        one = Stage(server, receiver, page, lines)
        yield one
        one._out.close()
    receiver.close()


def test_twenty_packets_reach_the_page_and_the_recording(tmp_path: Path) -> None:
    packets, out = live_link_packets()[:20], tmp_path / "take.csv"
    want = read_take(recording(UDP))
    with stage(out) as live:
        for row, packet in enumerate(packets):
            live.live_link(packet)
            said = live.frame()
            np.testing.assert_allclose(said["weights"], want.channels[row, :52], atol=1e-5)
            turns = [*said["head"], *said["left_eye"], *said["right_eye"]]
            np.testing.assert_allclose(turns, want.channels[row, 52:], atol=1e-5)
            assert abs(said["received_ms"] - 1e3 * time.time()) < 1000
        time.sleep(0.1)
        assert not out.exists(), "a recording gets its name when it is whole"
    got = read_take(out)
    np.testing.assert_allclose(got.channels, want.channels[:20], atol=1e-6)
    np.testing.assert_allclose(got.time, want.time[:20], atol=1e-4)
    first, *_, latency, last = live.lines
    assert "Live Link Face" in first and " ms" in latency and last == f"{out}: 20 frames"
    assert [p.name for p in tmp_path.iterdir()] == ["take.csv"]


def test_vmc_reaches_the_page() -> None:
    single = (osc("/VMC/Ext/Blend/Val", "jawOpen", 0.25), osc("/VMC/Ext/Blend/Apply"))
    whole = vmc_bundle({"JawOpen": 0.5, "eyeBlink_L": 1, "Joy": 1.0}, {"Hips": (0, 0, 0, 1)})
    with stage() as live:
        for packets, jaw in (((whole,), 0.5), (single, 0.25)):
            for packet in packets:
                live.osc(packet)
            weights = dict(zip(ARKIT_NAMES, live.frame()["weights"], strict=True))
            moving = {name: value for name, value in weights.items() if value}
            assert moving == {"jawOpen": jaw, "eyeBlinkLeft": 1.0}


def test_json_reaches_the_page() -> None:
    with stage() as live, connect(live.server.events.replace("events", "live")) as program:
        program.send(json.dumps({"weights": {"jawOpen": 0.5}, "head": [0.1, 0.2, 0.3]}))
        said = live.frame()
        assert said["weights"][ARKIT_NAMES.index("jawOpen")] == 0.5 and said["head"] == [0.1, 0.2, 0.3]
        assert said["left_eye"] == said["right_eye"] == [0, 0, 0]
        program.send(json.dumps({"weights": list(range(52)), "right_eye": [1, 2, 3]}))
        said = live.frame()
        assert said["weights"] == list(range(52)) and said["right_eye"] == [1, 2, 3]
        for text, why in (
            ("{", "is not JSON"),
            ("[]", "is not an object"),
            ('{"weights": {"jaw": 1}}', "'jaw' is not an ARKit name"),
            ('{"weights": [1, 2]}', "weights: is not 52 numbers"),
            ('{"weights": {"jawOpen": "1"}}', "weights.jawOpen: is not 1 number"),
            ('{"head": [0, true, 0]}', "head: is not 3 numbers"),
            ("[" * 50_000, "is not JSON"),
            (f'{{"head": [{"9" * 400}, 0, 0]}}', "head: is too large"),
        ):
            program.send(text)
            answer = json.loads(program.recv(2))
            assert answer["type"] == "message" and why in answer["text"]
        program.send('{"head": [NaN, 0, 0]}')
        program.send('{"head": [0.5, 0, 0]}')
        assert live.frame()["head"] == [0.5, 0, 0]
        assert live.receiver.inbox.nonsense == 9


NONSENSE = (
    b"", b"\0", b"\6", b"\6" + b"\xff" * 300, b"#bundle\0", b"/VMC/Ext/Blend/Val\0\0", b"x" * 1400, b"/a\0\0,?\0\0",
)  # fmt: skip
BROKEN = (
    osc("/VMC/Ext/Blend/Val", "jawOpen"), osc("/VMC/Ext/Blend/Val", 1.0, "jawOpen"), osc("/VMC/Ext/Bone/Pos", "Head"),
    osc("/VMC/Ext/Blend/Val", "jawOpen", float("nan")), osc("/VMC/Ext/Bone/Pos", "Head", *[0.0] * 7),
    osc("/VMC/Ext/Bone/Pos", "Head", *["0"] * 7), b"#bundle\0" + b"\0" * 7 + b"\1" + b"\0\0\0\x10#bundle\0" * 60,
)  # fmt: skip


def test_a_flood_of_nonsense_takes_no_memory_and_says_little(caplog: pytest.LogCaptureFixture) -> None:
    with stage() as live:
        good = live_link_packets()[0]
        for packet in (*NONSENSE, *BROKEN):  # once, so that all is loaded
            live.live_link(packet)
            live.osc(packet)
        live.live_link(good)
        live.frame()
        tracemalloc.start(1)
        before = tracemalloc.get_traced_memory()[0]
        end = time.monotonic() + 1.0
        while time.monotonic() < end:
            for packet in (*NONSENSE, *BROKEN):
                live.live_link(packet)
                live.osc(packet)
            time.sleep(0.001)
        assert live.server.get(live.server.start)[0] == 200, "the page is served meanwhile"
        assert tracemalloc.get_traced_memory()[0] - before < 1 << 20
        tracemalloc.stop()
        time.sleep(0.2)
        live.live_link(good)
        live.frame()
        assert live.receiver.inbox.nonsense > 1000 and live.receiver.inbox.frames == 2
    said = [line for line in live.lines if "not understood" in line]
    assert len(said) == 2, said  # the first, and the rest at the end
    assert not [r for r in caplog.records if r.levelno >= logging.WARNING]


def test_hostile_names_of_senders_are_plain_and_few() -> None:
    packet = live_link_packets()[0]
    at = 5 + int.from_bytes(packet[1:5], "big")
    rest = packet[at + 4 + int.from_bytes(packet[at : at + 4], "big") :]
    with stage() as live:
        for number in range(30):
            name = f"\x1b[31m{number}\r\n{'x' * 300}".encode()
            live.live_link(packet[:at] + len(name).to_bytes(4, "big") + name + rest)
            live.frame()
    named = [line for line in live.lines if "motion from" in line]
    assert len(named) == 8 and all(line.isprintable() and len(line) < 160 for line in live.lines)


def test_a_port_that_another_program_has(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("0.0.0.0", 0))
        port = other.getsockname()[1]
        with pytest.raises(AvatarError, match=f"--osc-port: UDP port {port} cannot be used"):
            Receiver(Ports(0, port), print)
    with pytest.raises(AvatarError, match=r"x\.csv: cannot be written"):
        Receiver(Ports(0, 0), print, tmp_path / "missing" / "x.csv")


def test_without_a_frame_there_is_no_recording(tmp_path: Path) -> None:
    with stage(tmp_path / "take.csv") as live:
        pass
    assert live.lines == ["live: nothing came, nothing is recorded"] and not list(tmp_path.iterdir())


NECK = np.array([0.1, -0.05, 0.02])  # rotation vectors in mesh axes, radians
AXIS = st.floats(-0.7, 0.7)


def unity(rotvec: np.ndarray) -> tuple[float, ...]:
    """x, y, z, w of the same rotation seen in a mirror at x = 0, by the matrix."""
    flip = np.diag([-1.0, 1, 1])
    m = flip @ matrix_from_rotvec(rotvec) @ flip
    w = np.sqrt(max(0, 1 + np.trace(m))) / 2
    x, y, z = (m[2, 1] - m[1, 2]) / (4 * w), (m[0, 2] - m[2, 0]) / (4 * w), (m[1, 0] - m[0, 1]) / (4 * w)
    return float(x), float(y), float(z), float(w)


@given(st.tuples(AXIS, AXIS, AXIS))
@settings(max_examples=examples(50), database=None)
def test_the_head_of_vmc_turns_as_the_channels_say(turn: tuple[float, float, float]) -> None:
    frames: list[LiveFrame] = []
    reader = VmcReader(Inbox(frames.append, lambda _: None))
    bones = {"Neck": unity(NECK), "Head": unity(np.array(turn)), "LeftHand": (1.0, 0.0, 0.0, 0.0)}
    reader.packet(vmc_bundle({"jawOpen": 0.5}, bones), "me")
    want = matrix_from_rotvec(NECK) @ matrix_from_rotvec(np.array(turn))
    found = head_rotation(frame_of(0, frames[0].channels))
    np.testing.assert_allclose(found, want, atol=2e-6)  # OSC has float32


def test_names_that_are_not_of_arkit_are_said_once() -> None:
    lines: list[str] = []
    frames: list[LiveFrame] = []
    reader = VmcReader(Inbox(frames.append, lines.append))
    for _ in range(100):
        reader.packet(vmc_bundle({"Joy": 1.0, "A": 0.5}, {}), "me")
    assert not frames and len(lines) == 1 and "ARKit" in lines[0]


def recorded(tmp_path: Path, frames: list[LiveFrame]) -> Path:
    recorder = Recorder(tmp_path / "take.csv")
    for frame in frames:
        recorder.add(frame)
    assert recorder.close()
    return recorder.out


@pytest.mark.parametrize("fps", [2.0, 5.0, 24.0, 30.0, 59.94, 60.0])
def test_recordings_keep_their_time_at_any_rate(tmp_path: Path, fps: float) -> None:
    """The timecode's rate is found by its highest frame number, so the first row has the highest there is."""
    rng = np.random.default_rng(1)
    frames = [LiveFrame(100.7 + k / fps, None, tuple(rng.uniform(-1, 1, len(CHANNELS)))) for k in range(30)]
    got = read_take(recorded(tmp_path, frames))
    np.testing.assert_allclose(got.time, [k / fps for k in range(30)], atol=2e-5)
    np.testing.assert_allclose(got.channels, [f.channels for f in frames], rtol=1e-8)
    assert got.fps == pytest.approx(fps, rel=1e-3)


def test_recordings_follow_the_sender_s_clock_and_survive_its_jumps(tmp_path: Path) -> None:
    still = (0.0,) * len(CHANNELS)
    received = np.array([0.0, 0.05, 0.06, 0.12, 0.2])  # a network that stutters
    sent = np.array([50.0, 50.033, 50.066, 50.1, 9.0])  # at last the app starts again
    repeated = LiveFrame(0.121, 50.1, still)
    frames = [LiveFrame(float(r), float(s), still) for r, s in zip(received, sent, strict=True)]
    got = read_take(recorded(tmp_path, [*frames[:4], repeated, *frames[4:]]))
    np.testing.assert_allclose(got.time, [0, 0.033, 0.066, 0.1, 0.2], atol=2e-5)


def test_a_flood_does_not_fill_the_disk(tmp_path: Path) -> None:
    still = (0.0,) * len(CHANNELS)
    path = recorded(tmp_path, [LiveFrame(k * 1e-5, None, still) for k in range(100_000)])
    assert len(path.read_text().splitlines()) <= 1 + 251


def test_timecodes() -> None:
    assert timecode(59 / 60) == "00:00:00:59.000"
    assert timecode(3600 + 62 + 1.5 / 60) == "01:01:02:01.500"
    assert timecode(86400 - 1e-7) == "00:00:00:00.000"
