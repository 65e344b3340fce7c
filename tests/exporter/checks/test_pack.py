"""`validate` of a pack: what it says of its own avatar is made again and compared."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.checks.pack import validate_pack
from avatar_export.measure.framing import framing, preview_webp, webp
from avatar_export.ops.bounds import bounds, bounds_of_levels
from avatar_export.packing.choices import Choices
from avatar_export.packing.make import make_pack
from avatar_runtime.packs import decode_pack, placed
from tests.exporter.packing.cases import AVATARS, COARSE, closed, levels_of, opened, prepare, write

Change = Callable[[dict[str, Any]], None]
LEVELS = prepare(levels_of(AVATARS["joints"]), COARSE)
FINEST = placed(LEVELS.levels[0])
FACTS = {"framing": framing(FINEST)}
PREVIEW = preview_webp(FINEST, 64)


def problems(file: bytes, folder: Path) -> list[str]:
    (folder / "x.avatar").write_bytes(file)
    return [str(problem) for problem in validate_pack(folder / "x.avatar") if not problem.warning]


def changed(change: Change, preview: bytes = PREVIEW) -> bytes:
    header, document, tensors = opened(write(LEVELS, FACTS, preview).file)
    change(document)
    return closed(header, document, tensors)


@pytest.mark.parametrize("name", list(AVATARS))
@pytest.mark.parametrize("handedness", ["right", "left"])
def test_what_pack_makes_is_sound(
    name: str, handedness: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avatar_export.packing.make.SIZE", 64)
    make_pack(AVATARS[name], tmp_path / "x.avatar", Choices(handedness=handedness))
    assert [str(problem) for problem in validate_pack(tmp_path / "x.avatar")] == []


def test_levels_are_sound(tmp_path: Path) -> None:
    for avatar in AVATARS.values():
        assert problems(write(prepare(levels_of(avatar), COARSE)).file, tmp_path) == []


def _another_rule(document: dict[str, Any]) -> None:
    """A rule that the manifest does not have; the access contract takes it."""
    (one,) = [
        one for one in document["program"]["levels"][0]["deform"] if "sh_direction" in one["constants"]
    ][:1]
    one["constants"]["sh_direction"] = 1 - one["constants"]["sh_direction"]


def _blurred(document: dict[str, Any]) -> None:
    """Another constant than the manifest's."""
    document["program"]["levels"][1]["view"][0]["constants"]["low_pass"] = 9.0


def _small_box(document: dict[str, Any]) -> None:
    box = document["avatar"]["bounds"]
    for end in ("min", "max"):
        box["swept"][end] = [value / 3 for value in box["swept"][end]]


def _looks_elsewhere(document: dict[str, Any]) -> None:
    document["framing"]["whole"]["target"][0] += 0.5


BROKEN: list[tuple[Change, str]] = [
    (_another_rule, "$.program: levels[0].deform["),
    (_blurred, "$.program: levels[1].view[0].constants"),
    (_small_box, "$.avatar.bounds.swept: Gaussians of level 0 leave it by"),
    (_looks_elsewhere, "$.framing.whole.target: differs from what the avatar of this pack gives"),
]


@pytest.mark.parametrize(("change", "message"), BROKEN, ids=[change.__name__ for change, _ in BROKEN])
def test_what_does_not_follow_from_the_avatar_is_found(change: Change, message: str, tmp_path: Path) -> None:
    file = changed(change)
    decode_pack(file, "x")  # players take it
    assert any(line.startswith(message) for line in problems(file, tmp_path)), problems(file, tmp_path)


def test_driving_is_made_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avatar_export.packing.make.SIZE", 64)
    made = make_pack(AVATARS["joints"], tmp_path / "y.avatar", Choices(preview=False))
    header, document, tensors = opened(made.file)
    document["driving"]["matrix"][0][0] += 0.1
    found = problems(closed(header, document, tensors), tmp_path)
    assert found == ["$.driving.matrix: differs from what the avatar of this pack gives"]


def test_another_version_may_lay_out_its_program_in_another_way(tmp_path: Path) -> None:
    def older(document: dict[str, Any]) -> None:
        _another_rule(document)
        document["asset"]["generator"] = "avatar-export 0.0.1"

    assert not [line for line in problems(changed(older), tmp_path) if line.startswith("$.program")]


@pytest.mark.parametrize(
    ("preview", "message"),
    [
        (b"RIFF" + bytes(60), "is not a still image that can be shown"),
        (webp(np.full((64, 32, 4), 255, np.uint8)), "is not a still image that can be shown: is 32 x 64"),
        (webp(np.full((64, 64, 4), 255, np.uint8)), "so it shows something else"),
    ],
    ids=["damaged", "not square", "another picture"],
)
def test_a_preview_shows_the_pack(preview: bytes, message: str, tmp_path: Path) -> None:
    found = problems(changed(lambda _: None, preview), tmp_path)
    assert len(found) == 1 and found[0].startswith("array preview") and message in found[0]


def test_the_swept_box_holds_the_coarser_levels_too() -> None:
    levels = [placed(level) for level in LEVELS.levels]
    document = opened(write(LEVELS).file)[1]
    swept = document["avatar"]["bounds"]["swept"]
    assert swept == json.loads(json.dumps(bounds_of_levels(levels)["swept"]))
    for level in levels:
        own = bounds(level)["swept"]
        assert np.less_equal(swept["min"], own["min"]).all() and np.less_equal(own["max"], swept["max"]).all()
