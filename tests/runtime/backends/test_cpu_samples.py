"""Backend `cpu` on the sample avatars of every system, in both profiles, against the reference."""

from __future__ import annotations

import numpy as np
import pytest
from bench.backends import busy_pose

from avatar_export.images import frame_camera, robust_box
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.stages.raster import PROFILES
from tests.measured import Measure

SAME, FLIPPED = 1e-4, 4e-3  # a pixel; one where alpha at 1/255 or T at 1e-4 was decided the other way
MOST_FLIPS = 4  # of 128 x 128 pixels


@pytest.mark.parametrize("profile", PROFILES)
def test_sample(sample: Avatar, profile: str, measured: Measure) -> None:
    camera = frame_camera(robust_box(sample.gaussians.mean), 128, 128)
    pose, background = busy_pose(sample, 1), (0.2, 0.5, 0.1)
    want = Player(sample, "reference").frame(pose, camera, background, profile).image
    assert want.transmittance.min() < 0.5
    got = Player(sample, "cpu").frame(pose, camera, background, profile).image
    for array in ("colour", "transmittance"):
        difference = np.abs(getattr(got, array) - getattr(want, array)).reshape(128 * 128, -1).max(axis=1)
        flipped = difference > SAME
        measured("cpu sample image, pixels but flipped ones", float(difference[~flipped].max()), SAME)
        measured("cpu sample image, flipped pixels, count", float(flipped.sum()), MOST_FLIPS)
        measured(
            "cpu sample image, a flipped pixel", float(difference.max(initial=0, where=flipped)), FLIPPED
        )
        assert flipped.sum() <= MOST_FLIPS and difference.max() <= FLIPPED, array
