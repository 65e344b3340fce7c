"""Any bundle on any capture: images that it drew itself, and such with a known error."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load as load_bundle
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture
from avatar_trainer.evaluation.bundle import evaluate_bundle, left_out
from tests.trainer import toy

ROOT = Path(__file__).parents[3]
BUNDLE = ROOT / "samples" / "trained" / "head_blendshapes"
ROUNDED = 58.0  # dB: half a step of 8 bits at most, uniform, is 58.9
STEP = 26  # of 255, by which an image is made brighter


@pytest.fixture(scope="module")
def avatar() -> Avatar:
    return load_bundle(BUNDLE)


@pytest.fixture(scope="module")
def capture(tmp_path_factory: pytest.TempPathFactory, avatar: Avatar) -> Capture:
    """Four frames that the bundle drew, in poses by the names of its own rig; the last is made brighter."""
    found = load(toy.capture_folder(tmp_path_factory.mktemp("drawn") / "toy", count=4))
    assert avatar.rig is not None
    names, joints = avatar.expression_names, avatar.rig.joint_names
    rng, player, frames = np.random.default_rng(5), Player(avatar, "reference"), []
    for t, frame in enumerate(found.frames):
        weights = rng.uniform(0, 0.6, len(names)).astype(np.float32)
        delta = np.tile(np.eye(4), (len(joints), 1, 1))
        delta[joints.index("jaw"), 1:3, 1:3] = [[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]]
        pose = replace(
            frame.pose,
            expression_weights=weights,
            late_weights=np.zeros(0, np.float32),
            joint_delta=delta,
            world_from_avatar=np.eye(4),
        )
        asked = Pose(dict(zip(names, weights.tolist(), strict=True)), {"jaw": delta[joints.index("jaw")]})
        image = player.frame(asked, frame.camera, (0.0, 0.0, 0.0), "trainer").image
        pixels = np.rint(np.clip(image.colour, 0, 1) * 255).astype(int) + (STEP if t == 3 else 0)
        Image.fromarray(np.clip(pixels, 0, 255).astype(np.uint8)).save(frame.image)
        Image.fromarray(np.full(pixels.shape[:2], 255, np.uint8)).save(frame.mask)
        frames.append(replace(frame, pose=pose))
    return replace(found, frames=tuple(frames), expression_names=names, eyelids=(), rig=avatar.rig)


def test_what_the_bundle_drew_is_measured_as_equal(avatar: Avatar, capture: Capture) -> None:
    result = evaluate_bundle(avatar, capture, "reference")
    scores = {score["frame"]: score for score in result["frames"]}
    for frame in capture.frames[:3]:
        found = scores[frame.name]["psnr_db"]
        assert found is None or found > ROUNDED
    brighter = scores[capture.frames[3].name]["psnr_db"]
    assert abs(brighter + 20 * np.log10(STEP / 255)) < 0.3, "the brightness that was added"
    assert result["notes"] == [] and result["gaussians"] == avatar.gaussians.count
    assert "lpips" not in result["splits"]["train"]


def test_names_that_the_bundle_lacks_are_told(avatar: Avatar, capture: Capture) -> None:
    renamed = replace(capture, expression_names=("smile", *capture.expression_names[1:]))
    assert left_out(renamed, avatar) == [
        f"1 of the {len(capture.expression_names)} expressions that the capture moves are not in the bundle, and "
        "rest: smile"
    ]


def test_an_avatar_that_poses_cannot_move_is_refused(capture: Capture) -> None:
    still = replace(load_bundle(BUNDLE.parent / "head_splatting"), rig=None)
    with pytest.raises(AvatarError, match="tracked poses cannot move it"):
        evaluate_bundle(still, capture)
