"""One frame by three players: backend `gl`, the web player and avatar_play show the same at every pixel."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import PIL.Image

from avatar_export.measure.framing import framing
from avatar_export.packing.write import pack
from avatar_runtime.clips import frame_pose
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from tests.exporter.packing.cases import COARSE
from tests.measured import Measure
from tests.players.native.gles import play_program, run_gl
from tests.players.native.test_native_play import BYTE, framed
from tests.players.played_cases import HEAD
from tests.players.web import BACKENDS, Job, ask, shot
from tests.runtime.backends import gl_cases

SIZE = (120, 90)
YAW, PITCH = 25.0, -10.0


def test_players_show_the_same_frame(tmp_path: Path, measured: Measure) -> None:
    """Frame 2 of the first clip, colours over black: no two players differ by more at any pixel."""
    source, file = gl_cases.avatars()["full"], tmp_path / HEAD
    facts = {"framing": framing(source)}
    file.write_bytes(pack([source], COARSE, facts).file)
    avatar = decode_pack(file.read_bytes(), HEAD).avatar
    clip = avatar.clips[0]
    pose, camera = frame_pose(avatar, clip, 2), framed(facts["framing"]["whole"], SIZE, YAW, PITCH)
    words = ["--clip", clip.name, "--fps", str(clip.fps), "--frames", "3", "--yaw", str(YAW)]
    words += ["--pitch", str(PITCH), "--size", "x".join(map(str, SIZE)), "-o", str(tmp_path / "frame_%d.png")]
    done = run_gl(play_program(), [str(file), *words])
    assert done.returncode == 0, done.stderr
    answer = ask(Job(files={"/a": str(file)}, shots=[shot("a", [("/a", avatar, pose)], camera)]), tmp_path)
    image = Player(avatar, "gl", target="rgba32f").frame(pose, camera, (0.0, 0.0, 0.0)).image
    images = {
        "gl": np.clip(image.colour, 0, 1).astype(np.float64),
        "avatar_play": np.asarray(PIL.Image.open(tmp_path / "frame_2.png"), np.float64)[..., :3] / 255,
        **{backend: np.clip(answer.images[backend, "a"][..., :3], 0, 1) for backend in BACKENDS},
    }
    assert images["gl"].max() > 0.5
    apart = {(a, b): float(np.abs(images[a] - images[b]).max()) for a, b in combinations(images, 2)}
    measured("three players, the same frame", max(apart.values()), BYTE)
    assert max(apart.values()) <= BYTE, apart
