from __future__ import annotations

import csv

import pytest

from avatar_runtime.driving.arkit import ARKIT_NAMES, CHANNELS, ROTATION_CHANNELS, canonical, rotation_channel
from tests.runtime.driving.recordings import CSV, recording


def test_the_table_is_the_recording_s_own_order() -> None:
    with recording(CSV).open(newline="") as stream:
        header = next(csv.reader(stream))[2:]
    assert [name[0].lower() + name[1:] for name in header] == list(CHANNELS)
    assert (len(ARKIT_NAMES), len(ROTATION_CHANNELS), len(set(CHANNELS))) == (52, 9, 61)


@pytest.mark.parametrize(
    ("spelling", "name"),
    [
        ("eyeBlinkLeft", "eyeBlinkLeft"),
        ("EyeBlinkLeft", "eyeBlinkLeft"),
        ("EYEBLINKLEFT", "eyeBlinkLeft"),
        ("eyeBlink_L", "eyeBlinkLeft"),
        ("eyeBlink_R", "eyeBlinkRight"),
        ("eye_blink_right", "eyeBlinkRight"),
        ("BS_node.eyeBlinkLeft", "eyeBlinkLeft"),
        ("BS_node.mouthSmile_R", "mouthSmileRight"),
        ("head|blendShape1.JawOpen", "jawOpen"),
        ("AK_18_JawOpen", "jawOpen"),
        ("jawLeft", "jawLeft"),
        ("mouth_L", "mouthLeft"),
        ("mouthRollLower", "mouthRollLower"),
        ("browInnerUp_L", "browInnerUp"),
        ("browInnerUp_R", "browInnerUp"),
        ("cheekPuff_R", "cheekPuff"),
        (" TongueOut ", "tongueOut"),
        ("HeadYaw", None),
        ("mouthFunne_L", "mouthFunnel"),
        ("PupilDilate_L", None),
        ("jawOpen2", None),
        ("", None),
        ("BS_node.", None),
    ],
)
def test_canonical(spelling: str, name: str | None) -> None:
    assert canonical(spelling) == name


@pytest.mark.parametrize("name", ARKIT_NAMES)
def test_every_name_has_its_four_spellings(name: str) -> None:
    raw = name.replace("Left", "_L").replace("Right", "_R") if name[-4:] in ("Left", "ight") else name
    for spelling in (name, name[0].upper() + name[1:], raw, f"BS_node.{name}", name.upper()):
        assert canonical(spelling) == name


def test_rotation_channels() -> None:
    assert [rotation_channel(name.upper()) for name in ROTATION_CHANNELS] == list(ROTATION_CHANNELS)
    assert rotation_channel("jawOpen") is None
