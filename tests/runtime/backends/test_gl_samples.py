"""Backend `gl` on the sample avatars of every system, and on LAM's own where it is present, against the reference."""

from __future__ import annotations

import moderngl
import numpy as np
from bench.backends import busy_pose

from avatar_export.images import frame_camera, robust_box
from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.posed import Clock
from tests.measured import Measure
from tests.runtime.backends.gl_cases import BACKGROUND, IMAGE_LIMIT, backend, check_stage, stage_inputs


def test_sample(sample: Avatar, context: moderngl.Context, measured: Measure) -> None:
    avatar = sample
    seen: Camera = frame_camera(robust_box(avatar.gaussians.mean), 128, 128)
    pose = busy_pose(avatar, 1)
    with backend(avatar, context=context) as gl:
        for stage, (inputs, outputs) in stage_inputs(avatar, seen, pose).items():
            check_stage(stage, gl.stage(stage, inputs, seen, "engine"), outputs, measured)
        player = Player(avatar, "reference")
        want = player.frame(pose, seen, tuple(BACKGROUND.tolist()), "engine").image
        got = gl.frame(player.posed(pose), seen, BACKGROUND, "engine", Clock())
    assert want.transmittance.min() < 0.5
    for array in ("colour", "transmittance"):
        worst = float(np.abs(getattr(got, array) - getattr(want, array)).max())
        measured("gl sample image end to end, 1/255", 255 * worst, 255 * IMAGE_LIMIT)
        assert worst <= IMAGE_LIMIT, array
