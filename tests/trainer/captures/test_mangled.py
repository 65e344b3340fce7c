"""Damaged files of a capture: an AvatarError or a capture, never another exception."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given

from avatar_trainer.captures.load import check_pixels, load
from tests.hostile import MANGLING, mangled, only_avatar_errors
from tests.trainer.captures import folders

CAMERA = {"K": [[40, 0, 6], [0, 41, 5], [0, 0, 1]], "R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "t": [0, 0, 1]}
FRAMES = [
    {
        "image": f"images/00{t}.png",
        "mask": f"masks/00{t}.png",
        "camera": CAMERA,
        "expression": [0.5],
        "eyelids": [1],
        "joints": {"jaw": [0.1, 0, 0]},
        "split": "train",
    }
    for t in range(2)
]
TEXT = json.dumps(
    {
        "version": "1.0",
        "name": "x",
        "width": 12,
        "height": 10,
        "fps": 30,
        "head_pose_in": "mesh",
        "expressions": ["exp_001"],
        "eyelids": ["left"],
        "body": {"kind": "body_model", "model": "body/body_model.npz", "eyelids": "body"},
        "frames": FRAMES,
    }
).encode()


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return folders.own(tmp_path_factory.mktemp("mangled") / "take", 2)


def loaded(folder: Path) -> None:
    check_pixels(load(folder))


def test_the_text_itself_is_a_capture(take: Path) -> None:
    (take / "capture.json").write_bytes(TEXT)
    loaded(take)


@MANGLING
@given(data=mangled(TEXT))
def test_mangled_json(take: Path, data: bytes) -> None:
    (take / "capture.json").write_bytes(data)
    only_avatar_errors(lambda: loaded(take))


@pytest.mark.parametrize("part", ["images", "masks"])
def test_mangled_images(take: Path, part: str, tmp_path: Path) -> None:
    (take / "capture.json").write_bytes(TEXT)
    file = take / part / "001.png"
    shutil.copy(file, tmp_path / "kept")

    @MANGLING
    @given(data=mangled((tmp_path / "kept").read_bytes()))
    def wounded(data: bytes) -> None:
        file.write_bytes(data)
        only_avatar_errors(lambda: loaded(take))

    wounded()
    shutil.copy(tmp_path / "kept", file)


def test_mangled_tracked_frame(tmp_path: Path) -> None:
    data, _ = folders.tracked(tmp_path, 2)
    file = data / "checkpoint" / "00001.frame"

    @MANGLING
    @given(wounded=mangled(file.read_bytes()))
    def read(wounded: Any) -> None:
        file.write_bytes(wounded)
        only_avatar_errors(lambda: load(data))

    read()
