"""Cameras of all kinds: beside the axis, without perspective, and far from the origin."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from avatar_export.images import seen
from avatar_runtime.avatar import F64
from avatar_runtime.camera import Camera
from avatar_runtime.rotation import homogeneous
from tests.measured import Measure
from tests.players.godot import light
from tests.players.godot.desk import STILL, Job, numbers
from tests.players.godot.samples import Sample, sample, write_pack
from tests.players.played_cases import drawn

pytestmark = pytest.mark.godot
BYTE, MEAN = 1 / 255, 3e-5
SIZE = 192
WINDOW = (0.006, 0.001, 0.0006)  # metres: of a frustum at its near plane, and how far beside the axis
HEIGHT = 0.5  # metres: of an orthogonal camera
FAR, FARTHER = 60.0, 2048.0  # from where perspective is little
AFAR = homogeneous(np.eye(3), np.array([8192.0, 0.0, -4096.0]))  # float32 has steps of a millimetre


@dataclass(frozen=True)
class Cameras:
    """A job that was played, and its head."""

    job: Job
    head: Sample

    def camera(self, away: float) -> Camera:
        """One that sees HEIGHT."""
        low, high = seen(self.head.avatar, self.head.poses[1])
        return Camera.orbit(
            (low + high) / 2, away, 0.4, 0.1, 2 * float(np.arctan(HEIGHT / 2 / away)), SIZE, SIZE
        )

    def off(self, name: str, camera: Camera) -> F64:
        """How far a picture is from that of backend `gl`."""
        want = drawn(self.head.avatar, self.head.poses[1], camera)
        return light.off(self.job.accumulated(name), want)


@pytest.fixture(scope="module")
def cameras(tmp_path_factory: pytest.TempPathFactory) -> Cameras:
    folder = tmp_path_factory.mktemp("godot_cameras")
    head = sample(write_pack("head_points", folder), 4, SIZE)
    job = Job(folder)
    made = Cameras(job, head)
    job.avatar("head", head.file)
    job.pose("head", head.avatar, head.poses[1])
    job.camera(made.camera(1.0))
    job.say("frustum", *WINDOW)
    job.say("shot", "frustum")
    job.say("orthogonal", HEIGHT)
    job.say("shot", "orthogonal")
    low, high = seen(head.avatar, head.poses[1])
    job.say(
        "box",
        "box",
        numbers(homogeneous(np.eye(3), (low + high) / 2)),
        (0.5 * (high - low)).tolist(),
        [1, 0, 0],
        False,
    )
    job.say("shot", "cut")
    job.camera(made.camera(FAR))
    job.say("shot", "cut from far")
    job.say("remove", "box")
    job.say("place", "head", numbers(AFAR))
    job.camera(made.camera(1.0), place=AFAR)
    job.say("shot", "afar")
    job.play()
    return made


@pytest.mark.parametrize(("name", "place"), [("frustum", STILL), ("afar", AFAR)])
def test_what_a_camera_sees(cameras: Cameras, measured: Measure, name: str, place: F64) -> None:
    off = float(cameras.off(name, cameras.job.seen(name, place)).max())
    measured(f"godot, camera {name}", off, BYTE)
    assert off <= BYTE


def test_a_camera_without_perspective(cameras: Cameras, measured: Measure) -> None:
    """It shows what a camera far away shows, and the scene cuts the head where it does for that one.

    Splats of almost the same depth change places with any step of the distance: so the mean counts.
    """
    off = float(cameras.off("orthogonal", cameras.camera(FARTHER)).mean())
    measured("godot, orthogonal camera, mean", off, MEAN)
    assert off <= MEAN
    whole, cut, near = (
        cameras.job.accumulated(name)[..., 3] for name in ("orthogonal", "cut", "cut from far")
    )
    assert (whole - cut).mean() > 0.005 and np.abs(cut - near).mean() < 0.1 * (whole - cut).mean()
