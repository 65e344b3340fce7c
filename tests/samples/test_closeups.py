"""The measure of crops: it passes a clean image of lower resolution and finds each fault that was planted in it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from samples.capture import unseen
from samples.capture.unseen import read_crops, write_unseen

from avatar_trainer.captures.load import load, pixels
from avatar_trainer.captures.model import Capture, Frame
from samples import closeups

F32 = npt.NDArray[np.float32]
Fault = Callable[[F32], None]  # plants something in an image
SIZE, SHUT, TEETH = 512, 126, 98  # frames of the recording
NEAR_SHUT = "00005"  # the second pose from near


@pytest.fixture(scope="module")
def truth(tmp_path_factory: pytest.TempPathFactory) -> Capture:
    """Two poses: parted lips with open eyes, then closed lids."""
    folder = tmp_path_factory.mktemp("truth")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(unseen, "chosen", lambda weights, count: [TEETH, SHUT])
        write_unseen(folder, SIZE, 2)
    return load(folder)


def coarse(frame: Frame) -> F32:
    """The truth over black, as an avatar of half its resolution shows it."""
    image, mask = pixels(frame)
    whole, half = (SIZE, SIZE), (SIZE // 2, SIZE // 2)
    planes = [
        Image.fromarray(image[..., c] * mask)
        .resize(half, Image.Resampling.BOX)
        .resize(whole, Image.Resampling.BICUBIC)
        for c in range(3)
    ]
    return np.stack([np.asarray(plane) for plane in planes], axis=-1)


def missed(truth: Capture, name: str = "", fault: Fault = lambda image: None) -> list[str]:
    """What the measure finds where one frame has a fault."""

    def drawn(frame: Frame) -> F32:
        image = coarse(frame)
        if frame.name == name:
            fault(image)
        return image

    return closeups.judged(list(closeups.compared(truth, drawn)))[1]


def test_a_clean_image_passes(truth: Capture) -> None:
    regions = {crop.region for crop in closeups.compared(truth, coarse)}
    assert regions == {"head", "face", "left_eye", "right_eye", "left_lid", "right_lid", "mouth"}
    assert missed(truth) == []


def test_a_trace_of_an_iris_on_a_closed_lid_is_found(truth: Capture) -> None:
    """A quarter of its colour is enough."""
    left, top, right, bottom = read_crops(truth.folder)[NEAR_SHUT]["left_lid"]
    y, x = np.ogrid[:SIZE, :SIZE]
    disc = np.hypot(x - (left + right) / 2, y - (top + bottom) / 2) < 14

    def iris(image: F32) -> None:
        image[disc] += (np.array((0.25, 0.38, 0.46), np.float32) - image[disc]) / 4

    found = missed(truth, NEAR_SHUT, iris)
    assert all(line.startswith("left_lid: ") for line in found)
    assert any(line.startswith("left_lid: block") and f"frame {NEAR_SHUT}" in line for line in found)
