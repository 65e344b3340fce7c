"""One frame by three players: backend `gl`, the web player and avatar_play show the same at every pixel."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from pathlib import Path

import numpy as np
import numpy.typing as npt
import PIL.Image
import pytest
from bench.pack_avatars import AVATARS

from avatar_export.measure.framing import framing
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.avatar import Avatar
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, clip_pose
from tests.exporter.packing.cases import COARSE
from tests.measured import Measure
from tests.players.native.gles import play_program, run_gl
from tests.players.native.test_native_play import BYTE, framed
from tests.players.played_cases import HEAD
from tests.players.web import BACKENDS, Job, ask, shot
from tests.runtime.backends import gl_cases

SAMPLES = ("head_blendshapes", "body_splatting")
TINY, LARGE = (120, 90), (512, 512)
YAW, PITCH = 25.0, -10.0
Images = Mapping[str, npt.NDArray[np.float64]]


def frames(source: Avatar, fine: Fineness, size: tuple[int, int], folder: Path) -> Images:
    """Frame 2 of the first clip, or the rest pose, by each player: [H, W, 3] colours over black."""
    file, width, height = folder / HEAD, *size
    facts = {"framing": framing(source)}
    file.write_bytes(pack([source], fine, facts).file)
    avatar = decode_pack(file.read_bytes(), HEAD).avatar
    clip = next(iter(avatar.clips), None)
    pose, words = Pose(), ["--frames", "1"]
    if clip is not None:
        pose = clip_pose(avatar, clip, 2)
        words = ["--clip", clip.name, "--fps", str(clip.fps), "--frames", "3"]
    camera = framed(facts["framing"]["whole"], size, YAW, PITCH)
    words += ["--size", f"{width}x{height}", "--yaw", str(YAW), "--pitch", str(PITCH)]
    done = run_gl(play_program(), [str(file), *words, "-o", str(folder / "frame_%d.png")])
    assert done.returncode == 0, done.stderr
    last = max(folder.glob("frame_*.png"))
    answer = ask(Job(files={"/a": str(file)}, shots=[shot("a", [("/a", avatar, pose)], camera)]), folder)
    image = Player(avatar, "gl", target="rgba32f").frame(pose, camera, (0.0, 0.0, 0.0)).image
    return {
        "gl": np.clip(image.colour, 0, 1).astype(np.float64),
        "avatar_play": np.asarray(PIL.Image.open(last), np.float64)[..., :3] / 255,
        **{backend: np.clip(answer.images[backend, "a"][..., :3], 0, 1) for backend in BACKENDS},
    }


def farthest(images: Images) -> tuple[float, str]:
    """The largest difference of any two players at any pixel, and which two."""
    assert images["gl"].max() > 0.5
    return max((float(np.abs(images[a] - images[b]).max()), f"{a}, {b}") for a, b in combinations(images, 2))


def test_players_show_the_same_frame(tmp_path: Path, measured: Measure) -> None:
    worst, who = farthest(frames(gl_cases.avatars()["full"], COARSE, TINY, tmp_path))
    measured("three players, the same frame", worst, BYTE)
    assert worst <= BYTE, who


@pytest.mark.players
@pytest.mark.parametrize("sample", SAMPLES)
def test_players_show_the_same_frame_of_a_sample(sample: str, tmp_path: Path, measured: Measure) -> None:
    source = with_active_sh(AVATARS[sample].load(tmp_path))
    worst, who = farthest(frames(source, Fineness(), LARGE, tmp_path))
    measured("three players, the same frame of a sample", worst, BYTE)
    assert worst <= BYTE, who
