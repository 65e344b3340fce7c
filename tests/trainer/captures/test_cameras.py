"""The exporter's tracked cameras are those with which the trainer trains, in every layout."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from avatar_export.bodies.tracked_cameras import read_cameras
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.load import load
from tests.trainer.captures import folders, vhap_files


def layouts(head_take: Path, tmp_path: Path) -> list[Path]:
    own = folders.own(tmp_path / "own")
    tracked = folders.tracked(tmp_path / "tracked")[0]
    imavatar = folders.imavatar(tmp_path / "imavatar")[0]
    return [own, tracked, imavatar, vhap_files.write(head_take, tmp_path / "vhap")]


def test_cameras_are_the_trainers(head_take: Path, tmp_path: Path) -> None:
    for folder in layouts(head_take, tmp_path):
        capture, cameras = load(folder), read_cameras(folder)
        assert len(cameras) == len(capture.frames)
        for frame, camera in zip(capture.frames, cameras, strict=True):
            found = camera.of_size(capture.width, capture.height)
            assert np.array_equal(found.camera_from_world, frame.camera.camera_from_world)
            assert np.abs(found.clip_from_world - frame.camera.clip_from_world).max() < 1e-6


@pytest.mark.parametrize(("content", "message"), [
    ("{", "is not valid JSON"),
    ("[]", "frames: holds no list of frames"),
    ('{"frames": [{"image": "x"}]}', "its frames have none of camera, transform_matrix, world_mat"),
    ('{"width": 9, "height": 9, "frames": [{"camera": {"K": [], "R": [], "t": []}}]}', r"frames\[0\].camera.R"),
    ('{"w": 9, "h": 0, "fl_x": 1, "fl_y": 1, "cx": 0, "cy": 0, "frames": [{"transform_matrix": []}]}', "sizes in"),
])  # fmt: skip
def test_files_without_cameras_are_named(tmp_path: Path, content: str, message: str) -> None:
    (tmp_path / "transforms.json").write_text(content)
    with pytest.raises(AvatarError, match=message):
        read_cameras(tmp_path)


def test_cameras_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(AvatarError, match="holds no tracked cameras"):
        read_cameras(tmp_path)
    file = folders.own(tmp_path / "own") / "capture.json"
    document = json.loads(file.read_text())
    document["frames"][1]["camera"]["R"] = np.diag([1, 1, -1]).tolist()
    file.write_text(json.dumps(document))
    with pytest.raises(AvatarError, match=r"frames\[1\]: its matrix is not a rotation"):
        read_cameras(file)
