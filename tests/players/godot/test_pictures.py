"""What Godot shows of every sample: what our effect accumulates, and what people see of it over a background."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from avatar_runtime.avatar import F32, F64
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.stages.raster import Image
from tests.measured import Measure
from tests.players.godot import light
from tests.players.godot.desk import Job
from tests.players.godot.samples import SAMPLES, sample, there, write_pack
from tests.session.shared_folder import made_once

pytestmark = pytest.mark.godot
BYTE = 1 / 255
CAMERA = 1e-5  # of an entry of a camera that Godot has rounded to float32
COUNT, SIZE = 20, 128  # poses, pixels
BACKGROUND = (0.04, 0.35, 0.8)  # display-referred


class Kind(NamedTuple):
    """A renderer, and whether its viewport keeps linear light."""

    renderer: str
    hdr: bool


KINDS = (Kind("forward_plus", False), Kind("mobile", True), Kind("mobile", False))


@pytest.fixture(scope="module")
def packs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    def make(folder: Path) -> Path:
        for name in there():
            write_pack(name, folder)
        return folder

    return made_once(tmp_path_factory, "godot_packs", make)


@pytest.fixture(scope="module", params=("forward_plus", "mobile"))
def played(request: pytest.FixtureRequest, packs: Path, tmp_path_factory: pytest.TempPathFactory) -> Job:
    """All pictures of a renderer, by one start of the engine."""
    job = Job(tmp_path_factory.mktemp(f"godot_{request.param}"), renderer=request.param)
    job.say("background", *BACKGROUND)
    for name in there():
        one = sample(packs / f"{name}.avatar", COUNT, SIZE)
        job.avatar(name, one.file)
        for p, pose in enumerate(one.poses):
            job.pose(name, one.avatar, pose)
            for c, camera in enumerate(one.cameras):
                job.camera(camera)
                for kind in KINDS:
                    if kind.renderer == request.param:
                        job.say("viewport", "use_hdr_2d", kind.hdr)
                        job.say("shot", f"{name}_{p}_{c}_{kind.hdr}")
        job.say("remove", name)
    return job.play()


WANTED: dict[tuple[Path, int, bytes], F32] = {}  # what backend `gl` draws, by pack, pose and camera


def wanted(file: Path, pose: int, camera: Camera) -> F32:
    """What backend `gl` draws, the same for all renderers."""
    key = file, pose, camera.clip_from_world.tobytes()
    if key not in WANTED:
        one = sample(file, COUNT, SIZE)
        WANTED[key] = image_of(player(file).frame(one.poses[pose], camera, (0.0, 0.0, 0.0)).image)
    return WANTED[key]


@cache
def player(file: Path) -> Player:
    """One a pack, which compiles once."""
    return Player(sample(file, COUNT, SIZE).avatar, "gl", target="rgba32f")


def image_of(image: Image) -> F32:
    """[H, W, 4]."""
    return np.dstack([image.colour, 1 - image.transmittance])


def pictures(played: Job, file: Path, hdr: bool) -> tuple[F32, F32, F64]:
    """(what our effect accumulated, what `gl` draws, the viewport), each [pictures, H, W, ...]."""
    one = sample(file, COUNT, SIZE)
    at = [
        (p, c, f"{file.stem}_{p}_{c}_{hdr}") for p in range(len(one.poses)) for c in range(len(one.cameras))
    ]
    for _, c, name in at:
        seen, asked = played.seen(name), one.cameras[c]
        for part in ("camera_from_world", "clip_from_world"):
            np.testing.assert_allclose(getattr(seen, part)[:2], getattr(asked, part)[:2], atol=CAMERA)
    want = np.stack([wanted(file, p, played.seen(name)) for p, _, name in at])
    shown = np.stack([played.viewport(name) for *_, name in at])
    return np.stack([played.accumulated(name) for *_, name in at]), want, shown


@pytest.mark.parametrize("name", SAMPLES)
def test_a_sample_is_drawn_as_gl_draws_it(played: Job, name: str, packs: Path, measured: Measure) -> None:
    if name not in there():
        write_pack(name, packs)  # skips
    for kind in KINDS:
        if kind.renderer != played.renderer:
            continue
        found, want, shown = pictures(played, packs / f"{name}.avatar", kind.hdr)
        assert (want[..., 3].max(axis=(1, 2)) > 0.5).all()
        worst = float(np.abs(found - want).max())
        measured(f"godot {kind.renderer}, accumulated image", worst, BYTE)
        assert worst <= BYTE, kind
        expected = light.over(want, BACKGROUND)
        if kind == ("mobile", False):
            off = float(light.beyond_rgb10a2(shown, expected, want[..., 3:]).max())
            measured("godot mobile, viewport, beyond what RGB10A2 keeps", off, BYTE)
        else:
            seen = light.display(shown) if kind.hdr else shown
            off = float(light.off(seen, light.display(expected)).max())
            measured(f"godot {kind.renderer}, viewport", off, BYTE)
        assert off <= BYTE, kind


def test_dark_colours_lose_most_in_rgb10a2(measured: Measure) -> None:
    """The bound that the test above asks for, over all colours: 6.4 bytes at black where nothing shines through."""
    colours = light.linear(np.linspace(0, 1, 256))
    low, high = light.bounds_rgb10a2(colours, np.ones_like(colours))
    worst = 255 * np.maximum(high - light.display(colours), light.display(colours) - low)
    measured("godot mobile, bound of RGB10A2 in bytes", float(worst.max()))
    assert 6.4 < worst.max() < 6.5 and worst[0] == pytest.approx(worst.max())
