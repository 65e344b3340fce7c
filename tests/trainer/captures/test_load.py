"""Which layout is read, and images of a loaded capture."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from jsonschema import Draft202012Validator
from PIL import Image

from avatar_runtime.io.errors import AvatarError
from avatar_schema import schema
from avatar_trainer.captures.load import check_pixels, load, pixels
from tests.trainer.captures import folders


def test_layouts_are_told_apart(tmp_path: Path) -> None:
    own = folders.own(tmp_path / "own")
    tracked, _ = folders.tracked(tmp_path / "tracked")
    imavatar, _, _ = folders.imavatar(tmp_path / "imavatar")
    found = [load(folder).layout.split()[0] for folder in (own, tracked, imavatar)]
    assert found == ["capture.json", "metrical-tracker", "IMavatar"]


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
    with pytest.raises(AvatarError, match=r"masks/004\.png: is empty: nobody is in the image"):
        check_pixels(capture)
    data = bytearray(capture.frames[2].image.read_bytes())
    at = data.index(b"IDAT") + 8
    data[at : at + 60] = bytes(60)
    capture.frames[2].image.write_bytes(data)
    with pytest.raises(AvatarError, match=r"images/002\.png: cannot be read"):
        check_pixels(capture)


DOCUMENT = Path(__file__).parents[3] / "schema" / "CAPTURE.md"


def test_the_documents_example_is_of_the_schema() -> None:
    example = json.loads(re.findall(r"```json\n(.*?)```", DOCUMENT.read_text("utf-8"), re.DOTALL)[0])
    assert not list(Draft202012Validator(schema("capture")).iter_errors(example))


def test_every_field_is_in_the_document() -> None:
    text, found = DOCUMENT.read_text("utf-8"), schema("capture")
    kinds = [found, *(found["$defs"][kind] for kind in ("body_model", "rig", "frame"))]
    missing = [
        key for kind in kinds for key in kind["properties"] if not re.search(rf"`\.?(camera\.)?{key}", text)
    ]
    assert not missing
