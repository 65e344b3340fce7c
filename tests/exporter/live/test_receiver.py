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
from websockets.sync.client import ClientConnection, connect

from avatar_export.driving.takes import read_take
from avatar_export.live.ports import Ports
from avatar_export.live.receiver import Receiver
from avatar_runtime.driving.arkit import ARKIT_NAMES
from avatar_runtime.io.errors import AvatarError
from tests.exporter.live.senders import live_link_packets, osc, vmc_bundle
from tests.exporter.serving.packs import Running, of, running
from tests.runtime.driving.recordings import UDP, recording


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
    assert live.lines[0].startswith("live: motion from Live Link Face ")
    assert live.lines[-2].startswith("live: packet to picture ") and live.lines[-2].endswith(" 20 frames")
    assert live.lines[-1] == f"{out}: 20 frames"
    assert [p.name for p in tmp_path.iterdir()] == ["take.csv"]


def test_vmc_reaches_the_page() -> None:
    with stage() as live:
        live.osc(vmc_bundle({"JawOpen": 0.5, "eyeBlink_L": 1, "Joy": 1.0}, {"Hips": (0, 0, 0, 1)}))
        weights = dict(zip(ARKIT_NAMES, live.frame()["weights"], strict=True))
        assert {name: value for name, value in weights.items() if value} == {
            "jawOpen": 0.5,
            "eyeBlinkLeft": 1.0,
        }
        for packet in (osc("/VMC/Ext/Blend/Val", "jawOpen", 0.25), osc("/VMC/Ext/Blend/Apply")):
            live.osc(packet)
        weights = dict(zip(ARKIT_NAMES, live.frame()["weights"], strict=True))
        assert (weights["jawOpen"], weights["eyeBlinkLeft"]) == (0.25, 1.0)


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
    b"",
    b"\0",
    b"\6",
    b"\6" + b"\xff" * 300,
    b"#bundle\0",
    b"/VMC/Ext/Blend/Val\0\0",
    b"x" * 1400,
    b"/a\0\0,?\0\0",
)
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


def test_a_flood_of_frames_shows_the_newest() -> None:
    packets = live_link_packets()
    with stage() as live:
        got, end = [], time.monotonic() + 1.0
        while time.monotonic() < end:
            for packet in packets:
                live.live_link(packet)
            got.append(live.frame()["time"])
        time.sleep(0.3)
        live.live_link(packets[7])
        want = read_take(recording(UDP)).channels[7, 52]
        for _ in range(5):
            said = live.frame()
            if said["head"][0] == pytest.approx(want, abs=1e-5):
                break
        assert said["head"][0] == pytest.approx(want, abs=1e-5)
        assert len(got) <= 70 and live.receiver.inbox.frames > 1000


def test_hostile_names_of_senders_are_plain_and_few() -> None:
    packet = bytearray(live_link_packets()[0])
    (device,) = np.frombuffer(packet[1:5], ">u4")
    at = 5 + int(device)
    (size,) = np.frombuffer(packet[at : at + 4], ">u4")
    with stage() as live:
        for number in range(30):
            name = f"\x1b[31m{number}\r\n{'x' * 300}".encode()
            live.live_link(
                bytes(packet[:at]) + len(name).to_bytes(4, "big") + name + bytes(packet[at + 4 + int(size) :])
            )
            live.frame()
    named = [line for line in live.lines if "motion from" in line]
    assert len(named) == 8 and all(line.isprintable() and len(line) < 160 for line in live.lines)


def test_a_port_that_another_program_has(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("0.0.0.0", 0))
        port = other.getsockname()[1]
        with pytest.raises(
            AvatarError, match=f"--osc-port: UDP port {port} cannot be used .*another program"
        ):
            Receiver(Ports(0, port), print)
    with pytest.raises(AvatarError, match=r"x\.csv: cannot be written"):
        Receiver(Ports(0, 0), print, tmp_path / "missing" / "x.csv")


def test_without_a_frame_there_is_no_recording(tmp_path: Path) -> None:
    with stage(tmp_path / "take.csv") as live:
        pass
    assert live.lines == ["live: nothing came, nothing is recorded"] and not list(tmp_path.iterdir())
