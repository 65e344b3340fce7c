"""The visitor's camera: how a face is read, what a browser says, and the closed loop of `bench.visitor`."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from bench.visitor import film, takes
from bench.visitor.__main__ import SAMPLE, watched
from PIL import Image

from avatar_export.driving.takes import read_take
from tests.players.web import run_node_test

DRIVEN = Path(__file__).parents[3] / "samples" / "driven.webp"
AT_REST = 40  # pictures
CHOSEN = [("jawOpen",), ("eyeBlinkLeft", "eyeBlinkRight"), ("mouthSmileLeft", "mouthSmileRight")]


def test_a_face_is_read_and_python_reads_the_recording(tmp_path: Path) -> None:
    run_node_test("visitor/reading.test.mjs", RECORDING=str(takes.RECORDING), OUT=str(tmp_path))
    written, recorded = read_take(tmp_path / "face.csv"), read_take(takes.RECORDING)
    assert written.fps == pytest.approx(recorded.fps, rel=1e-3) and not written.missing
    np.testing.assert_allclose(written.channels, recorded.channels, atol=1e-7)
    np.testing.assert_allclose(written.time, recorded.time, atol=1e-5)


def test_a_browser_says_what_hinders_and_follows_a_face(tmp_path: Path) -> None:
    with Image.open(DRIVEN) as driven:
        images = []
        for number in range(driven.n_frames):
            driven.seek(number)
            images.append(np.asarray(driven.convert("RGB")))
    film.write_y4m(tmp_path / "face.y4m", [images[0]] * AT_REST + images, 15)
    run_node_test("visitor/camera.test.mjs", FACE=str(tmp_path / "face.y4m"))


@pytest.mark.more
def test_the_page_reads_what_a_head_does(tmp_path: Path) -> None:
    """The sample head; another one where AVATAR_LAM names its file."""
    heads = [SAMPLE, *map(Path, filter(None, [os.environ.get("AVATAR_LAM")]))]
    for number, head in enumerate(heads):
        part = watched(head, tmp_path / str(number), {"ramps": takes.ramps(CHOSEN)}, fps=15).parts["ramps"]
        for name in ("jawOpen", "eyeBlinkLeft", "eyeBlinkRight"):
            assert part.r(name) >= 0.85, (head.name, name, part.r(name))
        off = np.sqrt(np.mean(part.off() ** 2, axis=0))
        assert (off <= 3).all(), (head.name, off)
