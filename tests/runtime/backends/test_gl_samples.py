"""Backend `gl` on the sample avatars of every system, and on LAM's own where it is present, against the reference."""

from __future__ import annotations

from collections.abc import Iterator

import moderngl
import numpy as np
import pytest

from avatar_export.pictures import frame_camera, robust_box
from avatar_export.read import read
from avatar_runtime.avatar import Avatar
from avatar_runtime.backends.gl.context import own_context
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation
from avatar_runtime.posed import Clock
from tests.measured import Measure
from tests.runtime.backends.gl_cases import BACKGROUND, PICTURE_LIMIT, backend, check_stage, stage_inputs
from tests.shared_data import shared

SAMPLES = (
    "blendshapes_avatar",
    "lam_avatar",
    "splatting_head_avatar",
    "splatting_head_sh3_avatar",
    "body_avatar",
    "lam_original",
)


@pytest.fixture(scope="module")
def lam_original() -> Avatar:
    return read(shared("lam/p2-1.zip"))


@pytest.fixture(scope="module", params=[False, True], ids=["desktop", "es"])
def context(request: pytest.FixtureRequest) -> Iterator[moderngl.Context]:
    made = own_context(es=request.param)
    yield made
    made.release()


def busy_pose(avatar: Avatar) -> Pose:
    rng = np.random.default_rng(1)
    joints = avatar.rig.joint_names if avatar.rig else ()
    return Pose(
        {name: float(rng.uniform(0, 0.4)) for name in avatar.expression_names},
        {name: joint_rotation(rng.normal(0, 0.05, 3)) for name in joints},
        {name: 0.3 for name in avatar.late_morph_names},
    )


@pytest.mark.parametrize("sample", SAMPLES)
def test_sample(
    sample: str, context: moderngl.Context, request: pytest.FixtureRequest, measured: Measure
) -> None:
    avatar: Avatar = request.getfixturevalue(sample)
    seen: Camera = frame_camera(robust_box(avatar.gaussians.mean), 128, 128)
    pose = busy_pose(avatar)
    with backend(avatar, context=context) as gl:
        for stage, (inputs, outputs) in stage_inputs(avatar, seen, pose).items():
            check_stage(stage, gl.stage(stage, inputs, seen, "engine"), outputs, measured)
        player = Player(avatar, "reference")
        want = player.frame(pose, seen, tuple(BACKGROUND.tolist()), "engine").picture
        got = gl.frame(player.posed(pose), seen, BACKGROUND, "engine", Clock())
    assert want.transmittance.min() < 0.5
    for array in ("colour", "transmittance"):
        worst = float(np.abs(getattr(got, array) - getattr(want, array)).max())
        measured("gl sample picture end to end, 1/255", 255 * worst)
        assert worst <= PICTURE_LIMIT, array
