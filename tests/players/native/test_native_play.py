"""avatar_play: a clip, a recording and a window show what Python draws, and what is wrong is said in one line."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import PIL.Image
import pytest

from avatar_export.driving.live_link_csv import read_live_link_csv
from avatar_export.packing.write import prepare, write
from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.driving.driver import Driver
from avatar_runtime.driving.frame import frame_of
from avatar_runtime.light import Light, light_of
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.exporter.packing.cases import COARSE
from tests.measured import Measure
from tests.players.hostile.packs import HOSTILE, SHOWN, changed
from tests.players.native.gles import LIMIT_S, play_program, run_gl, start_gl
from tests.players.native.x11 import screen
from tests.players.played_cases import HEAD
from tests.players.vectors.light_cases import lit_avatar
from tests.runtime.backends import gl_cases

KINDS = ("es", "gl", pytest.param("d3d11", marks=pytest.mark.players))
BYTE = 1 / 255
WHOLE = {"target": [0.02, 0.01, -0.01], "size": [0.3, 0.4, 0.2]}
FRAMING = {"up": [0.0, 1.0, 0.0], "front": [0.0, 0.0, 1.0], "whole": WHOLE}
SIZE = 120, 90
RATE = 60.0  # frames per second of the recording
SIDE_WAYS = ("--size", f"{SIZE[0]}x{SIZE[1]}", "--yaw", "25", "--pitch", "-10")


@pytest.fixture(scope="module")
def head(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A pack that says where to look."""
    file = tmp_path_factory.mktemp("play") / HEAD
    file.write_bytes(write(prepare([gl_cases.avatars()["full"]], COARSE), {"framing": FRAMING}).file)
    return file


@pytest.fixture(scope="module")
def avatar(head: Path) -> Avatar:
    """What the pack holds."""
    return decode_pack(head.read_bytes(), HEAD).avatar


def framed(whole: Mapping[str, Any], size: tuple[int, int], yaw: float, pitch: float) -> Camera:
    """Where avatar_play puts its camera: angles in degrees, 30 degrees of view, the avatar in 10 of 11 parts of it."""
    tangent, (width, height) = math.tan(math.radians(15)), size
    x, y, z = whole["size"]
    distance = 0.55 * max(y, x * height / width) / tangent + 0.5 * z
    turned = math.radians(yaw), math.radians(pitch)
    return Camera.orbit(np.array(whole["target"]), distance, *turned, math.radians(30), width, height)


def farthest(avatar: Avatar, poses: Sequence[Pose], folder: Path, light: Light | None = None) -> float:
    """The largest difference of frame_NNN.png from what Python draws."""
    player, worst = Player(avatar, "gl", target="rgba32f", light=light), 0.0
    for frame, pose in enumerate(poses):
        want = player.frame(pose, framed(WHOLE, SIZE, 25, -10), (0.0, 0.0, 0.0)).image.colour
        assert want.max() > 0.5
        worst = max(worst, float(np.abs(_png(folder / f"frame_{frame:03d}.png") - np.clip(want, 0, 1)).max()))
    return worst


def _png(path: Path) -> F64:
    return np.asarray(PIL.Image.open(path), np.float64)[..., :3] / 255


@pytest.mark.parametrize("kind", KINDS)
def test_a_clip_is_what_python_draws(
    head: Path, avatar: Avatar, tmp_path: Path, kind: str, measured: Measure
) -> None:
    clip, name = avatar.clips[0], avatar.expression_names[0]
    words = [*SIDE_WAYS, "--api", kind, "--clip", clip.name, "--fps", str(clip.fps), "--frames", "2"]
    words += ["--expression", f"{name}=0.5", "-o", str(tmp_path / "frame_%03d.png"), "--timings"]
    done = run_gl(play_program(kind), [str(head), *words])
    assert done.returncode == 0, done.stderr
    stages = {line.split()[0] for line in done.stdout.splitlines()}
    assert {"joints", "blend", "bind", "project", "sort", "raster", "composite"} <= stages
    poses = [frame_pose(avatar, clip, frame) for frame in range(2)]
    poses = [replace(pose, expressions={**pose.expressions, name: 0.5}) for pose in poses]
    worst = farthest(avatar, poses, tmp_path)
    measured(f"avatar_play, {kind}, frames of a clip", worst, BYTE)
    assert worst <= BYTE


def test_a_recording_drives_as_python_drives(
    head: Path, avatar: Avatar, tmp_path: Path, measured: Measure
) -> None:
    """A take of Live Link Face: each of its frames, the one between two of them, and the last one for ever."""
    text = recording()
    (tmp_path / "take.csv").write_bytes(text)
    take = read_live_link_csv(text, "take.csv")
    assert len(take.time) == 4 and take.fps == RATE
    out = str(tmp_path / "frame_%03d.png")
    words = [*SIDE_WAYS, "--recording", str(tmp_path / "take.csv"), "--fps", str(2 * RATE), "--frames", "8"]
    done = run_gl(play_program(), [str(head), *words, "-o", out])
    assert done.returncode == 0, done.stderr
    driver = Driver(avatar, within_range=True)
    poses = []
    for half in range(8):
        at = min(half / 2, 3)
        first, part = int(at), at - int(at)
        second = min(first + 1, 3)
        channels = (1 - part) * take.channels[first] + part * take.channels[second]
        poses.append(driver.pose(frame_of(half / (2 * RATE), channels)))
    worst = farthest(avatar, poses, tmp_path)
    measured("avatar_play, frames of a recording", worst, BYTE)
    assert worst <= BYTE
    still, moved = _png(tmp_path / "frame_000.png"), _png(tmp_path / "frame_006.png")
    assert np.abs(moved - still).max() > 0.1
    np.testing.assert_array_equal(_png(tmp_path / "frame_007.png"), moved)


@pytest.mark.parametrize("kind", [KINDS[0], KINDS[2]])
def test_a_light_is_that_of_its_file(tmp_path: Path, kind: str, measured: Measure) -> None:
    said = {"ambient": [0.2, 0.3, 0.5], "lights": [{"direction": [1, 2, 1], "colour": [2, 1.5, 1]}]}
    said["lights"].append({"position": [-0.2, 0, 0.4], "colour": [0.1, 0, 0]})
    pack, light, out = tmp_path / HEAD, tmp_path / "light.json", tmp_path / "frame_000.png"
    pack.write_bytes(write(prepare([lit_avatar()], COARSE), {"framing": FRAMING}).file)
    light.write_text(json.dumps(said))
    words = [*SIDE_WAYS, "--api", kind, "--light", str(light), "-o", str(out)]
    done = run_gl(play_program(kind), [str(pack), *words])
    assert done.returncode == 0, done.stderr
    avatar = decode_pack(pack.read_bytes(), HEAD).avatar
    worst = farthest(avatar, [Pose()], tmp_path, light_of(said))
    measured(f"avatar_play, {kind}, in a light", worst, BYTE)
    assert worst <= BYTE < farthest(avatar, [Pose()], tmp_path)


def recording() -> bytes:
    """Four frames of a face whose channels all move, in the columns of Live Link Face."""
    rng = np.random.default_rng(8)
    titles = [channel[0].upper() + channel[1:] for channel in CHANNELS]
    rows = [",".join(["Timecode", "BlendShapeCount", *titles])]
    for frame in range(4):
        values = np.concatenate([rng.uniform(0, 1, 52), rng.uniform(-0.3, 0.3, 9)]) * (frame / 3)
        rows.append(f"10:20:30:{frame:02}.000,61," + ",".join(f"{value:.9f}" for value in values))
    return "\n".join(rows).encode()


def test_what_is_wrong_is_said(head: Path, tmp_path: Path) -> None:
    pack, broken, take = str(head), tmp_path / "broken.avatar", tmp_path / "take.csv"
    broken.write_bytes(head.read_bytes()[:1000])
    hostile = tmp_path / "hostile.avatar"
    hostile.write_bytes(changed(head.read_bytes(), lambda d: d["avatar"]["clips"][0].update(name=HOSTILE)))
    take.write_text("Timecode,JawOpen\n12.5,0\n")
    lights = {"good": {}, "far": {"lights": [{"position": [1, 2, 1e10], "colour": [1, 1, 1]}]}}
    lights |= {"wrong": {"lights": [{"colour": [1, 1, 1]}]}, "list": [1], "unknown": {"sun": 1}}
    for name, said in lights.items():
        (tmp_path / f"{name}.json").write_text(json.dumps(said))
    for words, said in (
        ([str(broken)], "broken.avatar: "),
        ([str(tmp_path / "none.avatar")], "none.avatar: cannot be read"),
        ([pack, "--expression", "no_such=1"], "no_such"),
        ([pack, "--clip", "no_such"], "has no clip no_such; it has "),
        ([str(hostile), "--clip", "no_such"], f"has no clip no_such; it has {SHOWN}, "),
        ([pack, "--frames", "2", "-o", "same.png"], "would hold every frame"),
        ([pack, "--yaw", "nan", "-o", "still.png"], "not finite"),
        ([pack, "--recording", str(take)], "take.csv: Timecode: line 2: '12.5' is not a timecode"),
        ([pack, "--recording", str(tmp_path / "none.csv")], "none.csv: cannot be read"),
        ([pack, "--light", str(tmp_path / "good.json")], ": light: its colours hold an unknown light"),
        (
            [pack, "--light", str(tmp_path / "far.json")],
            "light: the place of a light is not finite",
        ),
        (
            [pack, "--light", str(tmp_path / "wrong.json")],
            "wrong.json: $.lights[0]: needs a direction or a position",
        ),
        ([pack, "--light", str(tmp_path / "list.json")], "list.json: $: is a list; a JSON object is needed"),
        (
            [pack, "--light", str(tmp_path / "unknown.json")],
            "unknown.json: $.sun: is not known; a light has ambient",
        ),
        ([pack, "--level", "7"], "there is no level 7"),
        ([pack, "--size", "99999x1"], "the camera: width and height must be 1 to 32768 pixels"),
        ([pack, "--size", "20000x1"], "the camera: an image of 20000x1 pixels"),
        ([pack, "--window"], "--window: "),
        ([pack, "--wrong"], "--wrong: is not understood"),
    ):
        done = run_gl(play_program(), words)
        assert done.returncode == 2 and said in done.stderr.splitlines()[0], (words, done.stderr)


def test_a_window_shows_the_frame_until_it_is_closed(head: Path, tmp_path: Path) -> None:
    words = [str(head), *SIDE_WAYS, "--expression", "jawOpen=0.5"]
    with screen(tmp_path) as shown:
        still = run_gl(play_program(), [*words, "-o", str(tmp_path / "still.png")])
        assert still.returncode == 0, still.stderr
        want = np.asarray(PIL.Image.open(tmp_path / "still.png"))[..., :3]
        playing = start_gl(play_program(), [*words, "--window"], DISPLAY=shown.name)
        try:
            while not np.array_equal(shown.pixels(*SIZE), want):
                assert playing.poll() is None, playing.communicate()
                time.sleep(0.05)
            shown.close_windows()
            said = playing.communicate(timeout=LIMIT_S)
        finally:
            playing.kill()
    assert playing.returncode == 0, said
