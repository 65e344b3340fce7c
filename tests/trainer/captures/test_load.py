"""Which layout is read, and images of a loaded capture."""

from __future__ import annotations

from pathlib import Path

import pytest
from PIL import Image

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.load import check_pixels, load, pixels
from tests.trainer.captures import folders


def test_what_is_no_capture_is_named(tmp_path: Path) -> None:
    with pytest.raises(
        AvatarError, match=r"holds none of capture\.json, checkpoint/\*\.frame, flame_params\.json"
    ):
        load(tmp_path)
    with pytest.raises(AvatarError, match="nowhere: is not a folder"):
        load(tmp_path / "nowhere")


def test_images_that_change_after_loading_are_named(tmp_path: Path) -> None:
    capture = load(folders.own(tmp_path / "take"))
    frame = capture.frames[1]
    Image.new("L", (5, 5)).save(frame.mask)
    with pytest.raises(AvatarError, match=r"001\.png: is now 5x5 pixels, was 12x10"):
        pixels(frame)


def test_every_image_is_decoded_when_asked_for(tmp_path: Path) -> None:
    capture = load(folders.own(tmp_path / "take"))
    check_pixels(capture)
    Image.new("L", (12, 10)).save(capture.frames[4].mask)
    with pytest.raises(AvatarError, match=r"masks/004\.png: is empty: it shows no person"):
        check_pixels(capture)
    data = bytearray(capture.frames[2].image.read_bytes())
    at = data.index(b"IDAT") + 8
    data[at : at + 60] = bytes(60)
    capture.frames[2].image.write_bytes(data)
    with pytest.raises(AvatarError, match=r"images/002\.png: cannot be read"):
        check_pixels(capture)
