"""Rotations, recordings and latency by themselves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from avatar_export.driving.takes import read_take
from avatar_export.live.inbox import Inbox, LiveFrame
from avatar_export.live.latency import Latency
from avatar_export.live.recording import Recorder, timecode
from avatar_export.live.vmc import VmcReader
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.driving.axes import head_rotation
from avatar_runtime.driving.frame import frame_of
from avatar_runtime.rotation import matrix_from_rotvec
from tests.exporter.live.senders import vmc_bundle
from tests.session.fuzz import examples

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
    np.testing.assert_allclose(
        head_rotation(frame_of(0, frames[0].channels)), want, atol=2e-6
    )  # OSC has float32


def test_names_that_are_not_of_arkit_are_said_once() -> None:
    lines: list[str] = []
    frames: list[LiveFrame] = []
    reader = VmcReader(Inbox(frames.append, lines.append))
    for _ in range(100):
        reader.packet(vmc_bundle({"Joy": 1.0, "A": 0.5}, {}), "me")
    assert not frames and len(lines) == 1 and "no blendshape has an ARKit name" in lines[0]


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


def test_latency_is_told_when_there_is_news() -> None:
    latency = Latency()
    assert latency.line() is None
    for seconds in (0.010, 0.020, 0.5, -1.0, 1e9, float("nan")):
        latency.add(seconds)
    assert latency.line() == "live: packet to picture 20 ms (median), 500 ms (worst), 3 frames"
    assert latency.line() is None
