"""What does not fit is found, and named; what fits is left in peace."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from avatar_runtime.io.errors import AvatarError
from avatar_trainer.captures.checks import overlays
from avatar_trainer.captures.checks.verdict import judge
from avatar_trainer.captures.load import load
from tests.trainer.captures.folders import changed
from tests.trainer.captures.wrong import MISTAKES, Mistake, invert_masks, made


def said(folder: Path) -> str:
    """What stops a training on the capture in `folder`; "" if nothing does."""
    try:
        capture = load(folder)
        judge(capture).refuse(capture)
    except AvatarError as error:
        return str(error)
    return ""


def test_a_right_capture_is_left_in_peace(head_take: Path) -> None:
    verdict = judge(load(head_take))
    assert (verdict.wrong, verdict.odd) == ((), ())


@pytest.mark.parametrize("mistake", MISTAKES, ids=lambda m: m.what)
def test_a_mistake_is_named(head_take: Path, tmp_path: Path, mistake: Mistake) -> None:
    text = said(made(head_take, mistake, tmp_path / "take"))
    assert mistake.says in text and "\n" not in text


def test_masks_of_the_background(head_take: Path, tmp_path: Path) -> None:
    take = made(head_take, Mistake("", lambda _: None, ""), tmp_path / "take")
    assert "255 is the background" in said(invert_masks(take))


def test_a_body_in_millimetres_is_told_by_its_size(head_take: Path) -> None:
    from dataclasses import replace

    capture = load(head_take)
    rig = replace(capture.rig, vertices=capture.rig.vertices * 1000)
    assert "millimetres" in " ".join(judge(replace(capture, rig=rig)).odd)


def test_overlays_show_mesh_and_mask(head_take: Path, tmp_path: Path) -> None:
    capture = load(head_take)
    assert overlays.write(capture, tmp_path / "out") == len(capture.frames)
    frame = capture.frames[0]
    drawn = np.asarray(Image.open(tmp_path / "out" / f"{frame.name}.png")).astype(int)
    image, mask = np.asarray(Image.open(frame.image)).astype(int), np.asarray(Image.open(frame.mask)) > 127
    edge = (drawn == (26, 255, 51)).all(axis=-1)
    assert edge.any() and mask[edge].all()
    blue = (drawn[..., 2] - drawn[..., 0]) - (image[..., 2] - image[..., 0])
    assert np.median(blue[mask & ~edge]) > 40, "the mesh lies over the person"
    together = np.asarray(Image.open(tmp_path / "out" / "sheet.png")).astype(int)
    assert together.shape == (2 * 64, 4 * 64, 3), "six overlays in rows of four"
    np.testing.assert_array_equal(together[:64, :64], drawn)
    with pytest.raises(AvatarError, match="exists; name a new"):
        overlays.expect_place(tmp_path / "out")


def test_keys_that_are_unknown_but_like_none_are_told(head_take: Path, tmp_path: Path) -> None:
    take = made(head_take, Mistake("", lambda d: d.update(camera_model="pinhole"), ""), tmp_path / "take")
    assert "not read: camera_model" in load(take).notes[0]
    assert said(changed(take, lambda d: d["body"].update(eyelid=d["body"].pop("eyelids")))).endswith(
        "body: 'eyelid' is not a key here; did you mean eyelids?"
    )
