from __future__ import annotations

import csv

import pytest

from avatar_runtime.driving.arkit import ARKIT_NAMES, CHANNELS, ROTATION_CHANNELS, canonical
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
        ("EYEBLINKLEFT", "eyeBlinkLeft"),
        ("eyeBlink_L", "eyeBlinkLeft"),
        ("eye_blink_right", "eyeBlinkRight"),
        ("BS_node.mouthSmile_R", "mouthSmileRight"),
        ("head|blendShape1.JawOpen", "jawOpen"),
        ("AK_18_JawOpen", "jawOpen"),
        ("mouth_L", "mouthLeft"),
        ("browInnerUp_L", "browInnerUp"),
        ("cheekPuff_R", "cheekPuff"),
        (" TongueOut ", "tongueOut"),
        ("mouthFunne_L", "mouthFunnel"),
        ("PupilDilate_L", None),
        ("", None),
        ("BS_node.", None),
    ],
)
def test_canonical(spelling: str, name: str | None) -> None:
    assert canonical(spelling) == name
