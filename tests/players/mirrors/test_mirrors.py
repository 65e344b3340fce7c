"""Every player shows packs of both handednesses as the person is: the left cheek is on the right of the image."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

from avatar_runtime import load
from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.handedness import HANDEDNESS, mirrored_pose
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import matrix_from_rotvec
from tests.avatars import assert_same
from tests.measured import Measure
from tests.players.mirrors.mole import FOLDER, SHIFT, SIZE, mole_camera, mole_files, mole_pose, sides
from tests.players.native.gles import Job as NativeJob
from tests.players.native.gles import desk_program, play_program, run_gl
from tests.players.native.test_native_play import framed
from tests.players.test_unity_played import scene
from tests.players.unity_play.desk import play, player_program
from tests.players.unreal.core import EXPRESSION, JOINT, SCRIPT, Core, stage
from tests.players.unreal.sources import library
from tests.players.unreal.test_unreal_core import component, pinhole, quaternion, seen
from tests.players.web import BACKENDS, CHROMIUM, Job, ask, shot

BYTE = 1 / 255
BLACK = (0.0, 0.0, 0.0)
WHOLE = {"target": SHIFT.tolist(), "size": [0.176, 0.242, 0.198]}
PACKS = {name: FOLDER / f"{name}.avatar" for name in HANDEDNESS}


def by_gl(avatar: Avatar, pose: Pose, camera: Camera) -> F32:
    """[H, W, 3]"""
    image = Player(avatar, "gl", target="rgba32f").frame(pose, camera, BLACK).image
    return np.clip(image.colour, 0, 1)


@pytest.fixture(scope="module")
def wanted() -> F32:
    """What the person looks like: the right-handed avatar, which no mirror has touched, by backend `gl`."""
    return by_gl(decode_pack(PACKS["right"].read_bytes(), "right").avatar, mole_pose(), mole_camera())


def stored(name: str) -> tuple[Avatar, Pose]:
    """The avatar of a pack and its pose, both in the pack's own frame, as arrays of a pose are."""
    avatar = decode_pack(PACKS[name].read_bytes(), name).avatar
    return avatar, mirrored_pose(mole_pose()) if name == "left" else mole_pose()


def check(player: str, images: dict[str, F32], wanted: F32, measured: Measure) -> None:
    """Both images are `wanted`, and the mole and the smile are on the side of the image where the person's left is."""
    worst = 0.0
    for name, image in images.items():
        found = sides(np.clip(image[..., :3], 0, 1))
        assert found["mole"][0] > 0.05 and found["left"][0] > found["right"][0] + 0.05, (player, name)
        assert found["left"][1] < found["right"][1] - 0.05, (player, name)  # the left corner is lifted
        worst = max(worst, float(np.abs(np.clip(image[..., :3], 0, 1) - wanted).max()))
    measured(f"{player}, both handednesses", worst, BYTE)
    assert worst <= BYTE and images.keys() == set(HANDEDNESS)


def test_the_packs_are_those_that_python_writes() -> None:
    for name, data in mole_files().items():
        made, kept = (decode_pack(file, name).avatar for file in (data, PACKS[name].read_bytes()))
        assert_same(replace(made, packed=None), replace(kept, packed=None))


def test_the_picture_has_its_left_on_the_right(wanted: F32) -> None:
    """The oracle of this file, by places of the image alone."""
    found = sides(wanted)
    assert found["mole"][0] > 0.1 and found["left"][0] > found["right"][0]
    assert found["mole"][0] + sides(wanted[:, ::-1])["mole"][0] == pytest.approx(0, abs=1e-6)


def test_python(wanted: F32, measured: Measure) -> None:
    images = {name: by_gl(load(path), mole_pose(), mole_camera()) for name, path in PACKS.items()}
    check("python gl", images, wanted, measured)


def test_web(wanted: F32, tmp_path: Path, measured: Measure) -> None:
    job = Job(BACKENDS[CHROMIUM], files={f"/{name}": str(path) for name, path in PACKS.items()})
    job.shots = [shot(name, [(f"/{name}", *stored(name))], mole_camera()) for name in PACKS]
    answer = ask(job, tmp_path, CHROMIUM)
    for backend in BACKENDS[CHROMIUM]:
        check(f"web {backend}", {name: answer.images[backend, name] for name in PACKS}, wanted, measured)


def test_native_gles(wanted: F32, tmp_path: Path, measured: Measure) -> None:
    job = NativeJob(tmp_path)
    for name, path in PACKS.items():
        job.say("begin", "es")
        job.camera(mole_camera())
        job.add(path, *stored(name))
        job.draw(name)
        job.say("end")
    job.run(desk_program())
    check("native gles", {name: job.image(name) for name in PACKS}, wanted, measured)


def test_avatar_play(tmp_path: Path, measured: Measure) -> None:
    """It aims by the pack's own framing, which lies beside the plane of the mirror."""
    images, yaw, pitch = {}, -8.0, -10.0
    words = ["--size", f"{SIZE[0]}x{SIZE[1]}", "--yaw", str(yaw), "--pitch", str(pitch)]
    for name, path in PACKS.items():
        out = tmp_path / f"{name}.png"
        done = run_gl(play_program(), [str(path), *words, "--expression", "mouthSmileLeft=1", "-o", str(out)])
        assert done.returncode == 0, done.stderr
        images[name] = np.asarray(PIL.Image.open(out), np.float32)[..., :3] / 255
    avatar = decode_pack(PACKS["right"].read_bytes(), "right").avatar
    want = by_gl(avatar, Pose({"mouthSmileLeft": 1.0}), framed(WHOLE, SIZE, yaw, pitch))
    check("avatar_play", images, want, measured)


def test_unity(
    wanted: F32, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory, measured: Measure
) -> None:
    """Unity's world is left-handed: the component writes a mirror into the place of every pack. Here the camera is
    that of a right-handed world, so no mirror stands between them."""
    scenes = [scene(name, [(path, *stored(name), np.eye(4))], mole_camera()) for name, path in PACKS.items()]
    job = {"scenes": scenes, "references": []}
    played = play(player_program(tmp_path_factory), job, tmp_path)
    images = {name: played[name].image for name in PACKS}
    check("unity core", {n: image for n, image in images.items() if image is not None}, wanted, measured)


def test_unreal(measured: Measure) -> None:
    """A component at Unreal's origin, and a camera that stands before its face."""
    images, eye = {}, np.array([60.0, 0.0, 0.0])
    look = matrix_from_rotvec(np.array([0.0, 0.0, np.pi]))  # along -X: the face looks along +X
    turned = quaternion(np.array([0.0, 0.0, -0.3]))
    with stage(Core(library())) as made:
        for name, path in PACKS.items():
            assert made.add(1, path.read_bytes()) is None
            assert made.set(1, SCRIPT, EXPRESSION, "mouthSmileLeft", (1.0,)) is None
            assert made.set(1, SCRIPT, JOINT, "neck", turned) is None
            assert made.mix(1) is None
            made.send(1, component(np.array([0.0, 100 * SHIFT[0], 0.0]), np.eye(3)))
            for frame in (1, 2):  # the first is of the coarsest level
                image = made.draw(seen(look), pinhole(*SIZE), eye, SIZE, frame)
            assert image is not None
            images[name] = image
            made.remove(1)
    # By hand: +Z of Unreal is +Y of the person and a turn about it, seen in its mirror, goes the other way.
    neck = np.eye(4)
    neck[:3, :3] = matrix_from_rotvec(np.array([0.0, 0.3, 0.0]))
    pose = Pose({"mouthSmileLeft": 1.0}, joints={"neck": neck})
    tangent = 0.35 * SIZE[1] / SIZE[0]
    camera = Camera.orbit(SHIFT, 0.6, 0.0, 0.0, 2 * np.arctan(tangent), *SIZE)
    avatar = decode_pack(PACKS["right"].read_bytes(), "right").avatar
    check("unreal core", images, by_gl(avatar, pose, camera), measured)
