"""The synthetic captures: what they state is what their images show."""

from __future__ import annotations

import hashlib
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from samples.capture import __main__ as command
from samples.capture import head as capture_head
from samples.capture import shots as capture_shots
from samples.capture.body import write_body
from samples.capture.head import write_head
from samples.capture.shots import Noise
from samples.subjects.take import posed_vertices

from avatar_runtime.avatar import Rig
from avatar_runtime.pose import PoseArrays
from avatar_runtime.posed import posed_mesh
from avatar_runtime.stages.joints import joints
from avatar_trainer.captures.load import check_pixels, load
from avatar_trainer.captures.model import Capture
from avatar_trainer.head import BodyModel, Head, load_tracking_head
from tests.measured import Measure

Array = npt.NDArray[Any]

SIZE, FRAMES = 64, 10


@pytest.fixture(scope="module", autouse=True)
def fewer_rays() -> Iterator[None]:
    """Images of tests need not be as fine as those for training."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(capture_shots, "RAYS", 192)
        yield


@pytest.fixture(scope="module")
def head_capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    folder = tmp_path_factory.mktemp("head")
    write_head(folder, SIZE, FRAMES, Noise())
    return load(folder)


@pytest.fixture(scope="module")
def body_capture(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    folder = tmp_path_factory.mktemp("body")
    write_body(folder, SIZE, FRAMES, Noise())
    return load(folder)


def posed(rig: Rig, pose: PoseArrays) -> Array:
    """The rig's mesh as the runtime poses it."""
    return posed_mesh(rig, pose, joints(rig, pose))


def test_both_are_sound_captures(head_capture: Capture, body_capture: Capture) -> None:
    for found in (head_capture, body_capture):
        check_pixels(found)
        assert len(found.frames) == FRAMES
        assert [f.split for f in found.frames] == ["train"] * 8 + ["test"] * 2
        assert found.rights["source"].startswith("synthetic")
        assert {"licence", "author", "consent"} <= found.rights.keys()
    assert "Lee Perry-Smith" in head_capture.rights["licence"]
    assert "CC BY 4.0" in body_capture.rights["licence"]
    assert head_capture.eyelids == ("left", "right")
    assert all((f.pose.late_weights == 0).all() for f in head_capture.frames)
    assert (head_capture.folder / "driving.json").is_file()


def test_the_tracked_mesh(head: Head, body: BodyModel, head_capture: Capture, measured: Measure) -> None:
    take = capture_head.perform(body, FRAMES, ())
    _, rows = load_tracking_head(head)
    for k, frame in enumerate(head_capture.frames):
        away = posed(head_capture.rig, frame.pose) - posed_vertices(body, take, k)[rows]
        measured("tracking mesh against full mesh, m", float(np.abs(away).max()))
        assert np.abs(away).max() < 1e-6


def test_command(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    digests = []
    for name in ("a", "b"):
        argv = ["capture", str(tmp_path / name), "--size", "32", "--frames", "3", "--hold-out", "jawOpen"]
        monkeypatch.setattr(sys, "argv", argv)
        command.main()
        files = sorted(p for p in (tmp_path / name).rglob("*") if p.is_file())
        digests.append([hashlib.sha256(p.read_bytes()).hexdigest() for p in files])
    assert digests[0] == digests[1], "the same bytes every time"
    assert capsys.readouterr().out.splitlines()[0] == str(tmp_path / "a" / "capture.json")
    assert len(load(tmp_path / "a").frames) == 3
