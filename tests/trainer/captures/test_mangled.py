"""Damaged files of a capture: an AvatarError or a capture, never another exception."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given

from avatar_trainer.captures.load import check_pixels, load
from tests.hostile import MANGLING, mangled, only_avatar_errors
from tests.trainer.captures import folders


@pytest.fixture(scope="module")
def take(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return folders.own(tmp_path_factory.mktemp("mangled") / "take", 2)


def loaded(folder: Path) -> None:
    check_pixels(load(folder))


def test_mangled_json(take: Path) -> None:
    file = take / "capture.json"
    text = file.read_bytes()

    @MANGLING
    @given(data=mangled(text))
    def wounded(data: bytes) -> None:
        file.write_bytes(data)
        only_avatar_errors(lambda: loaded(take))

    wounded()
    file.write_bytes(text)


@pytest.mark.parametrize("part", ["images", "masks"])
def test_mangled_images(take: Path, part: str, tmp_path: Path) -> None:
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
