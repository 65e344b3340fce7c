"""The light of a scene tree: what avatars take of it, by white matt balls and by pictures of backend `gl`."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.pack_avatars import AVATARS

from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_export.relight import relightable
from avatar_runtime.avatar import F64
from avatar_runtime.camera import Camera
from avatar_runtime.light import DirectLight, Light, even, sh_bases
from avatar_runtime.player import Player
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.measured import Measure
from tests.players.godot.desk import STILL, Job, eye, numbers
from tests.players.godot.light import linear
from tests.players.godot.pixels import Bools
from tests.players.godot.samples import Sample, sample

pytestmark = pytest.mark.godot
BYTE, NEAR, SHARE = 1 / 255, 2 / 255, 0.995
SIZE = 192
TONE, NO_TONE = (1.0, 0.8, 0.6), (1.0, 1.0, 1.0)  # display-referred
SUN = homogeneous(matrix_from_rotvec(np.array([-0.5, 0.8, 0.0])))  # lights look along -z
HIGH = homogeneous(matrix_from_rotvec(np.array([-1.1, 0.0, 0.0])))
LAMP = np.array([-0.3, 0.1, 0.3])
BLUE, GREY = (0.3, 0.5, 1.0), (0.5, 0.5, 0.4)
COLOUR_ALONE, NONE = 2, 1  # of Environment.AmbientSource
FAR = homogeneous(matrix_from_rotvec(np.array([0.0, 2.0, 0.3])), np.array([700.0, -20.0, 300.0]))
WINDOWLESS = 1e5  # metres: the range of a lamp that its end does not dim
BRIGHT = [[[4.0, 0.5, 0.2], [0.2, 0.3, 0.2], [0.2, 0.2, 3.0], [1.0, 1.0, 0.5]], [[0.1, 0.5, 0.1]] * 4]
SKY_OFF = 0.06  # of the brightest: nine terms of what the engine filters in a way of its own
BALL = 0.02  # metres
WEAK = {"omni_range": 3.0, "omni_attenuation": 1.0, "light_energy": 2.0}
BALLS = ("sun", "lamp", "colour", "weak lamp", "spot", "sky", "sky turned", "dim sky")


def sun(energy: float = 1.5, **more: Any) -> dict[str, Any]:
    """Properties of a light that casts no shadow, unless it shall."""
    return {"light_color": TONE, "light_energy": energy, "shadow_enabled": False, **more}


LIGHTS = {
    "sun": Light(even((0, 0, 0)), (DirectLight(tuple(SUN[:3, 2]), tuple(1.5 * linear(TONE))),)),
    "lamp": Light(
        even(tuple(0.3 * linear(GREY))),
        (
            DirectLight(tuple(SUN[:3, 2]), tuple(0.5 * linear(TONE))),
            DirectLight(tuple(LAMP), tuple(0.15 * linear(BLUE)), point=True),
        ),
    ),
}
LIGHTS["shadow"] = Light(
    LIGHTS["lamp"].ambient, (replace(LIGHTS["sun"].lights[0], place=tuple(HIGH[:3, 2])),), shadow=True
)


@dataclass(frozen=True)
class Played:
    """A head that was shown in many lights."""

    job: Job
    head: Sample

    def off(self, name: str, light: Light | None, place: F64 = STILL) -> F64:
        """[H, W] how far the picture is from that of `gl`. `light`: relative to where the avatar was placed."""
        pose, turn = self.head.poses[1], homogeneous(place[:3, :3])
        pose = replace(pose, world_from_avatar=turn @ np.asarray(pose.world_from_avatar))
        player = Player(self.head.avatar, "gl", target="rgba32f", light=light)
        image = player.frame(pose, self.job.seen(name, place), (0.0, 0.0, 0.0)).image
        want = np.dstack([image.colour, 1 - image.transmittance])
        found: F64 = np.abs(self.job.accumulated(name) - want).max(axis=2)
        return found


@pytest.fixture(scope="module", params=("forward_plus", "mobile"))
def played(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Played:
    """All by one start of the engine."""
    folder = tmp_path_factory.mktemp(f"godot_light_{request.param}")
    head = relit_head(folder)
    job = Job(folder, request.param)
    camera = head.cameras[1]
    job.avatar("head", head.file)
    job.pose("head", head.avatar, head.poses[1])
    job.camera(camera)
    say_pictures(job, camera)
    say_balls(job, head)
    say_choice(job)
    job.say("statistics", "end")
    return Played(job.play(), head)


def relit_head(folder: Path) -> Sample:
    """As `pack --relight` makes it."""
    source = relightable(with_active_sh(AVATARS["head_blendshapes"].load(folder)))
    file = folder / "head.avatar"
    file.write_bytes(pack([source], Fineness()).file)
    return sample(file, 4, SIZE)


def say_pictures(job: Job, camera: Camera) -> None:
    job.say("shot", "dark")
    job.say("light", "sun", numbers(SUN), "DirectionalLight3D", sun())
    job.say("shot", "sun")
    job.say("change", "head", {"lit": False})
    job.say("shot", "captured")
    job.say("change", "head", {"lit": True})
    job.say("change", "sun", {"light_energy": 0.5})
    say_lamp(job)
    job.say(
        "ambient",
        {"ambient_light_source": COLOUR_ALONE, "ambient_light_color": GREY, "ambient_light_energy": 0.3},
    )
    job.say("shot", "lamp")
    job.say("place", "head", numbers(FAR))
    job.say("place", "lamp", numbers(homogeneous(np.eye(3), (FAR @ [*LAMP, 1])[:3])))
    job.camera(camera, place=FAR)
    job.say("shot", "far")
    job.say("place", "head", numbers(STILL))
    job.camera(camera)
    job.say("remove", "lamp")
    job.say("change", "sun", sun(shadow_enabled=True))
    job.say("place", "sun", numbers(HIGH))
    job.say("shot", "shadow")
    job.say("remove", "sun")


def say_lamp(job: Job, at: F64 = LAMP, **more: float) -> None:
    given = {
        "light_color": BLUE,
        "light_energy": 0.15,
        "omni_range": WINDOWLESS,
        "omni_attenuation": 2,
        **more,
    }
    job.say("light", "lamp", numbers(homogeneous(np.eye(3), at)), "OmniLight3D", given)


def say_balls(job: Job, head: Sample) -> None:
    """Where the head is, each lit by one kind of light alone."""
    job.say("show", "head", False)
    job.say("viewport", "use_hdr_2d", True)
    job.say("centre", "head")
    job.say("ambient", {"ambient_light_source": NONE})
    turn = eye(head.cameras[1])[:3, :3]
    towards = turn[:, 2]
    job.say("ball", "ball", numbers(STILL), BALL)
    close = homogeneous(turn, 0.15 * towards)
    job.say("look", numbers(close), 20, SIZE, SIZE)
    job.say("light", "sun", numbers(SUN), "DirectionalLight3D", sun(0.7))
    say_ball(job, "sun")
    job.say("remove", "sun")
    for name, metres, more in (("lamp", 0.4, {}), ("weak lamp", 2.0, WEAK)):
        say_lamp(job, metres * towards, **more)
        say_ball(job, name)
        job.say("remove", "lamp")
    turned: F64 = turn @ matrix_from_rotvec(np.array([0.1, 0.05, 0.0]))  # beside its middle
    spot = {
        "light_energy": 3,
        "spot_range": 5,
        "spot_angle": 20,
        "spot_attenuation": 1.5,
        "shadow_enabled": False,
    }
    job.say("light", "spot", numbers(homogeneous(turned, 2 * towards)), "SpotLight3D", spot)
    say_ball(job, "spot")
    job.say("remove", "spot")
    job.say("ambient", {"ambient_light_source": COLOUR_ALONE, "ambient_light_energy": 0.8})
    say_ball(job, "colour")
    for name, angles in {"sky": [0, 0, 0], "sky turned": [0.4, 1.0, -0.3]}.items():
        job.say("sky", BRIGHT, angles)
        job.say("shot", "waits", 40)
        say_ball(job, name)
    job.say("ambient", {"background_energy_multiplier": 0.5, "ambient_light_sky_contribution": 0.7})
    job.say("shot", "waits", 40)
    say_ball(job, "dim sky")
    job.say("ambient", {"ambient_light_source": NONE})
    job.say("remove", "ball")
    job.say("show", "head", True)
    job.say("place", "head", numbers(STILL))
    job.camera(head.cameras[1])


def say_ball(job: Job, name: str) -> None:
    job.say("shot", f"ball {name}", 2)
    job.say("shone", f"ball {name}", "head")


def say_choice(job: Job) -> None:
    """Six lights, of which some do not shine here, then none, and nothing at all."""
    for index in range(6):
        job.say(
            "light", str(index), numbers(SUN), "DirectionalLight3D", sun(1 + index, shadow_enabled=index == 2)
        )
    for name, properties in NOT_HERE.items():
        job.say("light", name, numbers(SUN), "DirectionalLight3D", sun(9, **properties))
    job.say("shot", "six")
    job.say("shone", "six", "head")
    for name in (*map(str, range(6)), *NOT_HERE):
        job.say("remove", name)
    job.say("bare")
    job.say("shot", "bare")


NOT_HERE: dict[str, dict[str, Any]] = {
    "negative": {"light_negative": True},
    "hidden": {"visible": False},
    "editor": {"editor_only": True},
    "others": {"light_cull_mask": 2},
    "sky alone": {"sky_mode": 2},
}


@pytest.mark.parametrize("name", ["sun", "lamp", "far"])
def test_a_head_in_lights_of_the_tree_is_as_by_gl(played: Played, name: str, measured: Measure) -> None:
    light, place = LIGHTS["lamp" if name == "far" else name], STILL
    if name == "far":
        lamp = replace(light.lights[1], place=tuple(FAR[:3, :3] @ LAMP))
        light, place = replace(light, lights=(light.lights[0], lamp)), FAR
    off = float(played.off(name, light, place).max())
    measured(f"godot, lit head, {name}", off, BYTE)
    assert off <= BYTE
    assert played.off(name, None, place).max() > 0.2  # the light changes it


def test_the_first_light_casts_a_shadow_on_the_head_itself(played: Played, measured: Measure) -> None:
    share = float((played.off("shadow", LIGHTS["shadow"]) <= NEAR).mean())
    measured("godot, lit with a shadow, pixels that differ", 1 - share, 1 - SHARE)
    assert share >= SHARE
    cast = played.off("shadow", replace(LIGHTS["shadow"], shadow=False)) > 0.1
    measured("godot, pixels in shadow", float(cast.mean()))
    assert cast.mean() > 0.005


def test_what_is_not_lit_is_as_it_was_captured(played: Played) -> None:
    """A switch, and a world that nobody has lit; a world whose lights are all out is dark."""
    for name in ("captured", "bare"):
        assert played.off(name, None).max() <= BYTE, name
    assert played.job.accumulated("dark")[..., :3].max() == 0 < played.job.accumulated("dark")[..., 3].max()


@pytest.mark.parametrize("name", BALLS)
def test_a_white_ball_reflects_what_the_avatar_is_told(played: Played, name: str, measured: Measure) -> None:
    told = np.array(played.job.answers[f"light ball {name}"])
    shown = played.job.viewport(f"ball {name}")
    at, normal, inside = ball(played, f"ball {name}")
    want = reflected(told, at, normal)
    assert (inside.sum() > 2000 and np.ptp(shown[inside]) > 0.1) or name == "colour"
    off = float(np.abs(shown - want)[inside].max() / want[inside].max())
    most = SKY_OFF if "sky" in name else 0.03 if name in ("weak lamp", "spot") else 0.004
    measured(f"godot, ball under {name}", off, most)
    assert off <= most


def ball(played: Played, name: str) -> tuple[F64, F64, Bools]:
    """([H, W, 3] where each pixel shows the ball, its normal there, [H, W] whether it does, away from the edge)."""
    seen = played.job.seen(name)
    y, x = np.mgrid[: seen.height, : seen.width]
    across = ((x + 0.5) / seen.width * 2 - 1) * seen.tan_half_fov_x
    down = ((y + 0.5) / seen.height * 2 - 1) * seen.tan_half_fov_y
    world_from_camera = np.linalg.inv(seen.camera_from_world.astype(np.float64))
    ray = np.stack([across, down, np.ones_like(across)], axis=-1) @ world_from_camera[:3, :3].T
    ray /= np.linalg.norm(ray, axis=-1, keepdims=True)
    start = world_from_camera[:3, 3]
    along = -ray @ start
    left = along**2 - start @ start + BALL**2
    at = start + (along - np.sqrt(np.maximum(left, 0)))[..., None] * ray
    return at, at / BALL, left > (0.3 * BALL) ** 2


def reflected(told: F64, at: F64, normal: F64) -> F64:
    """[H, W, 3] linear light of a white matt surface, of the numbers that the extension gets."""
    total = sh_bases(normal) @ told[1:28].reshape(9, 3)
    for row in told[28:].reshape(-1, 7):
        towards = row[:3] - at if row[6] else np.broadcast_to(row[:3], at.shape)
        distance = np.linalg.norm(towards, axis=-1)
        facing = np.maximum(np.sum(normal * towards, axis=-1) / distance, 0)
        total += (facing / (distance**2 if row[6] else 1))[..., None] * row[3:6]
    found: F64 = np.maximum(total, 0)
    return found


def test_the_four_strongest_shine_and_one_of_them_casts(played: Played) -> None:
    told = np.array(played.job.answers["light six"])
    energies = told[28:].reshape(-1, 7)[:, 3] / linear(TONE)[0]
    assert told[0] == 1 and sorted(energies.round(4)) == [3, 4, 5, 6] and energies[0] == pytest.approx(3)
    assert played.job.answers["error end"] == ""
