"""The measure of crops: it passes a clean image of lower resolution and finds each fault that was planted in it."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from samples.capture import unseen
from samples.capture.unseen import chosen, read_crops, recorded, write_unseen

from avatar_runtime.avatar import Avatar
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.load import load, pixels
from avatar_trainer.captures.model import Capture, Frame
from samples import closeups

F32 = npt.NDArray[np.float32]
Fault = Callable[[F32], None]  # plants something in an image
ROOT = Path(__file__).parents[2]
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


def test_one_loose_needle_is_found(truth: Capture) -> None:
    """A bright one of two pixels before the cheek; a dark one between eyes and mouth; one beside the head."""

    def across(top: int, left: int, colour: float) -> Fault:
        def needle(image: F32) -> None:
            for k in range(40):
                image[top + k, left + k // 3 : left + 2 + k // 3] = colour

        return needle

    for needle in (across(270, 370, 1.0), across(250, 180, 0.2)):
        assert any(line.startswith("face: smooth") for line in missed(truth, NEAR_SHUT, needle))
    left, top, _, _ = read_crops(truth.folder)["00004"]["head"]
    beside = missed(truth, "00004", across(top + 10, left + 10, 0.8))
    assert any(line.startswith("head: smooth") for line in beside)


def test_frayed_teeth_are_found(truth: Capture) -> None:
    """Their edge is torn: every other six columns hang ten pixels lower."""
    left, top, right, bottom = read_crops(truth.folder)["00003"]["mouth"]

    def frayed(image: F32) -> None:
        inside = image[top:bottom, left:right].copy()
        for at in range(0, right - left - 6, 12):
            image[top + 10 : bottom, left + at : left + at + 6] = inside[:-10, at : at + 6]

    found = missed(truth, "00003", frayed)
    assert any(line.startswith("mouth: block") and "frame 00003" in line for line in found)


def test_a_sample_whose_eye_shows_through_its_lid_fails(
    truth: Capture, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    """The command: exit code 1, what fails by name, and a sheet of three pictures a crop."""
    page = tmp_path / "sheet.png"
    bundle = ROOT / "samples" / "trained" / "head_blendshapes"
    monkeypatch.setattr(closeups, "load_bundle", _spoilt(closeups.load_bundle))
    monkeypatch.setattr(sys, "argv", ["closeups", str(bundle), str(truth.folder), "--sheet", str(page)])
    with pytest.raises(SystemExit) as ended:
        closeups.main()
    assert ended.value.code == 1
    assert "left_lid: block, dB" in capsys.readouterr().out
    with Image.open(page) as sheet:
        assert sheet.size == (5 * 3 * closeups.TILE[0], 2 * closeups.TILE[1])


def _spoilt(load_bundle: Callable[[Path], Avatar]) -> Callable[[Path], Avatar]:
    """The bundle without its skin before the left eye: the eye shows whatever the lid does."""

    def spoilt(path: Path) -> Avatar:
        avatar = load_bundle(path)
        mean = avatar.gaussians.mean
        near = np.linalg.norm(mean - (0.0295, 0.0364, 0.0796), axis=1)
        avatar.gaussians.opacity_logit[(near > 0.0148) & (near < 0.022)] = -20
        return avatar

    return spoilt


def test_the_poses_show_what_people_look_at() -> None:
    names = ("eyeBlinkLeft", "eyeBlinkRight", "jawOpen", "mouthSmileLeft", "eyeLookInLeft", "eyeLookOutLeft")
    every = unseen.STRONGEST
    wanted = tuple(sorted({*names, *(name for _, group in every for name in group)}))
    weights = dict(zip(wanted, recorded(wanted).T, strict=True))
    poses = chosen(weights, 20)
    assert len(set(poses)) == 20 and poses == sorted(poses)
    left, right = weights["eyeBlinkLeft"][poses], weights["eyeBlinkRight"][poses]
    assert (np.minimum(left, right) > 0.85).sum() >= 3
    assert ((np.abs(left - 0.5) < 0.2) & (np.abs(right - 0.5) < 0.2)).sum() >= 2
    for name in names:
        assert weights[name][poses].max() > 0.9 * weights[name].max(), name
    with pytest.raises(ValueError, match="the recording has room for"):
        chosen(weights, 100)


def test_boxes_hold_what_they_are_called(tmp_path: Path) -> None:
    """Glasses change nothing outside their box; the subject's left eye is to the right, the mouth below both."""
    shown = []
    for name, worn in (("bare", ()), ("worn", ("glasses",))):
        write_unseen(tmp_path / name, 96, 1, worn)
        shown.append(np.asarray(Image.open(tmp_path / name / "images" / "00003.png")).astype(int))
    boxes = read_crops(tmp_path / "worn")["00003"]
    rows, columns = np.nonzero(np.abs(shown[0] - shown[1]).max(axis=-1) > 8)
    left, top, right, bottom = boxes["glasses"]
    assert len(rows) > 200
    assert left <= columns.min() and columns.max() < right and top <= rows.min() and rows.max() < bottom
    eyes = [box for name, box in boxes.items() if name.endswith(("eye", "lid"))]
    assert eyes[0][0] > eyes[1][2] and boxes["mouth"][1] > eyes[0][3]


def test_a_folder_without_boxes_is_refused(truth: Capture, tmp_path: Path) -> None:
    with pytest.raises(AvatarError, match="capture FOLDER --unseen 20"):
        read_crops(tmp_path)
