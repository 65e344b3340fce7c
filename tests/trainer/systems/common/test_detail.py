"""More Gaussians begin where frames come close, and none becomes a needle."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt
import torch
from samples.capture.head import blinking_head, camera_at, close_camera, write_head
from samples.capture.shots import Noise

from avatar_runtime.camera import Camera
from avatar_trainer.captures.load import load
from avatar_trainer.captures.model import Capture
from avatar_trainer.systems.common.detail import MOST, detail
from avatar_trainer.systems.common.needles import shorten

F64 = npt.NDArray[np.float64]


def test_close_frames_ask_for_more(tmp_path: Path) -> None:
    write_head(tmp_path, 16, 4, Noise())
    capture = load(tmp_path)
    head, one = blinking_head(), capture.train[0]

    def seen(views: list[tuple[F64, F64, F64]]) -> Capture:
        cameras = [Camera.from_opencv(r, t, k, 512, 512) for k, r, t in views]
        return replace(capture, frames=tuple(replace(one, camera=camera) for camera in cameras))

    take = [camera_at(k, 200, 512, 1.9) for k in range(0, 200, 5)]
    assert (detail(seen(take)) == 1).all(), "one distance, one density"
    density = detail(seen([*take, *(close_camera(head, k, 512) for k in range(0, 102, 5))]))
    assert density.min() == 1 and density.max() <= MOST
    middle = capture.rig.vertices[capture.rig.triangles].mean(axis=1)
    eye = (np.linalg.norm(middle - [0.03, 0.036, 0.095], axis=1) < 0.015) & (middle[:, 2] > 0.09)
    assert density[eye].mean() > 1.3 and (density[middle[:, 2] < -0.02] == 1).all()


def test_needles_are_shortened_and_disks_are_not() -> None:
    log_scale = torch.log(torch.tensor([[8.0, 1.0, 0.5], [3.0, 3.0, 0.01], [0.1, 2.0, 0.2]]))
    shorten(log_scale, 4.0)
    expected = torch.tensor([[4.0, 1.0, 0.5], [3.0, 3.0, 0.01], [0.1, 0.8, 0.2]])
    assert torch.allclose(log_scale.exp(), expected)
    before = log_scale.clone()
    shorten(log_scale, 0.0)
    assert torch.equal(log_scale, before)
