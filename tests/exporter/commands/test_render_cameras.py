"""`render --camera`: what a tracked camera sees, in its size or another."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from avatar_runtime.bundle import load
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.commands import Run

BUNDLE = Path(__file__).parents[3] / "samples" / "trained" / "head_blendshapes"
WIDTH, HEIGHT = 24, 18
K = np.array([[60.0, 0, 13], [0, 60, 8], [0, 0, 1]])


def view(t: int) -> tuple[np.ndarray, np.ndarray]:
    turn = 0.3 * t
    rotation = np.array([[np.cos(turn), 0, -np.sin(turn)], [0, -1, 0], [-np.sin(turn), 0, -np.cos(turn)]])
    return rotation, np.array([0.01, 0.02, 0.8])


@pytest.fixture
def take(tmp_path: Path) -> Path:
    frames = [
        {"camera": {"K": K.tolist(), "R": view(t)[0].tolist(), "t": view(t)[1].tolist()}} for t in range(3)
    ]
    (tmp_path / "take").mkdir()
    document = {"width": WIDTH, "height": HEIGHT, "frames": frames}
    (tmp_path / "take" / "capture.json").write_text(json.dumps(document))
    return tmp_path / "take"


def test_a_pose_is_seen_by_each_camera(take: Path, tmp_path: Path, run: Run) -> None:
    out = tmp_path / "seen"
    code, said, err = run(
        "render", BUNDLE, "-o", out, "--camera", take, "--camera-frames", "1:", "-e", "jawOpen=0.5"
    )
    assert code == 0, err
    assert f"2 images of {WIDTH}x{HEIGHT}" in said
    player = Player(load(BUNDLE))
    for index, t in enumerate((1, 2)):
        camera = Camera.from_opencv(*view(t), K, WIDTH, HEIGHT)
        wanted = player.frame(Pose({"jawOpen": 0.5}), camera).rgb8()
        with Image.open(out / f"frame_{index:05d}.png") as drawn:
            assert np.array_equal(np.asarray(drawn), wanted)
        assert wanted.std() > 5, "there is something to see"


def test_sizes_and_counts(take: Path, tmp_path: Path, run: Run) -> None:
    camera = ("--camera", take / "capture.json")
    code, said, _ = run(
        "render", BUNDLE, "-o", tmp_path / "a.png", *camera, "--camera-frames", "0:1", "--size", "48"
    )
    assert code == 0 and "1 image of 48x36" in said
    for arguments, message in (
        (("--size", "24x24x"), "is not N or WxH"),
        (("--size", "48x24"), "has another shape than the images, 24x18"),
        (("--camera-frames", "7:"), "holds no camera; the capture has 3"),
        (("--clip", "held_out", "--frames", "0:2"), "3 cameras for 2 poses"),
        (("--yaw", "3"), "cannot be used together"),
    ):
        code, _, err = run("render", BUNDLE, "-o", tmp_path / "b", *camera, *arguments)
        assert code == 2 and message in err, err
        assert not (tmp_path / "b").exists()
    code, _, err = run("render", BUNDLE, "-o", tmp_path / "b", "--camera-frames", "1:")
    assert code == 2 and "needs --camera" in err
