"""bsData.json: a take of ARKit weights, and what is wrong with files that are none."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from avatar_export.clips.sources import clips_from
from avatar_export.driving.expression_json import read_expression_json
from avatar_export.driving.takes import is_json_take, read_take
from avatar_runtime.avatar import Driving
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.io.errors import AvatarError
from tests.avatars import avatar_of
from tests.exporter.driving.test_takes import MANGLE, clean, mangled
from tests.hostile import MANGLING

NAMES = ["tongueOut", "jawOpen", "unknown", "browInnerUp"]


def document(frames: int = 5, fps: float = 30.0) -> dict[str, Any]:
    return {
        "names": list(NAMES),
        "metadata": {"fps": fps, "frame_count": frames, "blendshape_names": NAMES},
        "frames": [
            {"weights": [0.1 * k, 0.2, 3.0, 0.3 * k], "time": k / fps, "rotation": []} for k in range(frames)
        ],
    }


def test_a_take_by_name(tmp_path: Path) -> None:
    path = tmp_path / "bsData.json"
    path.write_text(json.dumps(document(), indent=2), "utf-8-sig")
    found = read_take(path)
    assert is_json_take(path) and (found.fps, len(found)) == (30, 5)
    want = np.zeros((5, len(CHANNELS)))
    want[:, CHANNELS.index("tongueOut")] = 0.1 * np.arange(5)
    want[:, CHANNELS.index("jawOpen")] = 0.2
    want[:, CHANNELS.index("browInnerUp")] = 0.3 * np.arange(5)
    np.testing.assert_array_equal(found.channels, want)
    np.testing.assert_allclose(found.time, np.arange(5) / 30)
    assert len(found.missing) == len(CHANNELS) - 3
    (clip,) = clips_from(replace(avatar_of(("jawOpen",)), driving=Driving(mode="names")), path)
    assert (clip.name, clip.frames) == ("bsData", 5) and clip.expression_weights.any()


def without(key: str) -> Callable[[Any], None]:
    return lambda said: said.pop(key)


def frame(key: str, value: Any) -> Callable[[Any], None]:
    return lambda said: said["frames"][2].update({key: value})


def metadata(key: str, value: Any) -> Callable[[Any], None]:
    return lambda said: said["metadata"].update({key: value})


WRONG: dict[str, tuple[Callable[[Any], None], str]] = {
    "cut names": (lambda said: said["names"].pop(), r"frames\[0\].weights: expected 3 numbers"),
    "a name twice": (lambda said: said["names"].__setitem__(0, "JawOpen"), "names: has jawOpen twice"),
    "no ARKit name": (lambda said: said.update(names=list("abcd")), "is not an ARKit name"),
    "text": (frame("weights", ["1", 2, 3, 4]), r"frames\[2\].weights"),
    "not a number": (frame("weights", [float("nan"), 2, 3, 4]), r"frames\[2\].weights"),
    "percent": (frame("weights", [500, 2, 3, 4]), "tongueOut: frame 2: 500.0 is neither"),
    "rotations": (frame("rotation", [0.1, 0, 0]), r"frames\[2\].rotation: is not empty"),
    "time back": (frame("time", 0.0), r"frames\[2\].time"),
    "time of text": (frame("time", "now"), r"frames\[2\].time"),
    "another rate": (metadata("fps", 25), "metadata.fps: is 25, but the times of its frames make 30"),
    "no rate": (metadata("fps", None), "metadata.fps: is None"),
    "frames lost": (metadata("frame_count", 6), "frame_count: is 6, but there are 5 frames"),
    "no frame": (lambda said: said.update(frames=[], metadata={"fps": 30}), "has no frame with a face"),
    "frames of numbers": (lambda said: said["frames"].__setitem__(0, 3), r"frames\[0\].weights"),
    "no list": (lambda said: said.update(names={"a": 1}), "names: is missing or not a list"),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_is_wrong_is_named(case: str) -> None:
    change, message = WRONG[case]
    said = document()
    change(said)
    with pytest.raises(AvatarError, match=message):
        read_expression_json(json.dumps(said).encode(), "bsData.json")


@MANGLING
@given(MANGLE)
def test_mangled_files_give_a_take_or_an_avatar_error(edits: list[tuple[int, bytes]]) -> None:
    clean(read_expression_json, mangled(json.dumps(document()).encode(), edits))
