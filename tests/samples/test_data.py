"""The committed sample data: small, with its notices, the head as documented."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from samples.subjects.head import load_head

SAMPLES = Path(__file__).parents[2] / "samples"


def test_size_and_notices() -> None:
    files = [p for folder in ("data", "drive") for p in (SAMPLES / folder).iterdir()]
    assert sum(p.stat().st_size for p in files) < 7e6
    assert "USC Institute for Creative Technologies" in (SAMPLES / "data/LICENSE.ict-facekit.txt").read_text()
    assert "Lee Perry-Smith" in (SAMPLES / "data/LICENSE.lee-perry-smith.txt").read_text()
    assert {p.name for p in files} >= {
        "live_link_face_rom_300.csv",
        "LICENSE.live_link_face_rom.txt",
        "live_link_face_udp.gesichter",
        "LICENSE.llv.txt",
    }


def test_head_is_whole_and_in_metres() -> None:
    head = load_head()
    assert 0.2 < np.ptp(head.vertices[:, 1]) < 0.4
    assert head.triangles.min() == 0 and head.triangles.max() == len(head.vertices) - 1
    assert np.unique(head.part).tolist() == list(range(len(head.part_names)))
    assert len(head.expression_names) == 51
    assert all(np.any(shape) for shape in head.expressions)
    nose = head.vertices[np.argmax(head.vertices[:, 2])]
    assert abs(nose[0]) < 0.01 and nose[2] > 0.1, "+Z leaves the face"
    left, right = head.eye_centres
    assert left[0] > 0.02 and right[0] < -0.02, "+X is the subject's left"


def test_closed_lids_clear_the_eyeballs() -> None:
    head = load_head()
    for side, (centre, part) in enumerate(zip(head.eye_centres, ("left_eye", "right_eye"), strict=True)):
        ball = np.linalg.norm(head.vertices[head.in_part(part)] - centre, axis=1)
        skin = head.in_part("face")
        closed = (head.vertices + head.expression(("eyeBlinkLeft", "eyeBlinkRight")[side]))[skin] - centre
        reach = np.linalg.norm(closed, axis=1)
        front = closed[:, 2] > 0.4 * reach
        assert reach[front].min() > ball.max()
