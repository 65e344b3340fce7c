"""`validate` of a pack: what it says of its own avatar is made again and compared."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.checks.pack import validate_pack
from avatar_export.measure.framing import framing, preview_webp, webp
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


def another_rule(document: dict[str, Any]) -> None:
    """A rule that the manifest does not have; the access contract takes it."""
    passes = document["program"]["levels"][0]["deform"]
    constants = next(one["constants"] for one in passes if "sh_direction" in one["constants"])
    constants["sh_direction"] = 1 - constants["sh_direction"]


def blurred(document: dict[str, Any]) -> None:
    document["program"]["levels"][1]["view"][0]["constants"]["low_pass"] = 9.0


def small_box(document: dict[str, Any]) -> None:
    box = document["avatar"]["bounds"]["swept"]
    box.update({end: [value / 3 for value in box[end]] for end in ("min", "max")})


def looks_elsewhere(document: dict[str, Any]) -> None:
    document["framing"]["whole"]["target"][0] += 0.5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (another_rule, "$.program: levels[0].deform["),
        (blurred, "$.program: levels[1].view[0].constants"),
        (small_box, "$.avatar.bounds.swept: "),
        (looks_elsewhere, "$.framing.whole.target: "),
    ],
)
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
    assert [line.partition(":")[0] for line in found] == ["$.driving.matrix"]


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
