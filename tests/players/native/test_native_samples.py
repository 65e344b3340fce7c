"""The native player plays every trained sample as backend `gl` does, and repeats its references."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bench.pack_avatars import AVATARS

from avatar_export.measure.poses import poses
from avatar_export.measure.views import views
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.packs import decode_pack
from avatar_runtime.player import Player
from tests.measured import Measure
from tests.players.native.gles import Job, desk_program
from tests.players.native.test_native_gles import BYTE, KINDS
from tests.players.played_cases import vectors
from tests.players.test_web_samples import SAMPLES, SIZE

pytestmark = pytest.mark.players


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("sample", SAMPLES)
def test_a_sample_is_played_as_gl_plays_it(sample: str, kind: str, tmp_path: Path, measured: Measure) -> None:
    """Two poses from two sides, and all stages."""
    source = with_active_sh(AVATARS[sample].load(tmp_path))
    file = tmp_path / "a.avatar"
    file.write_bytes(pack([source], Fineness()).file)
    avatar = decode_pack(file.read_bytes(), "a").avatar
    for name, data in vectors(avatar).items():
        (tmp_path / name).write_bytes(data)
    shown = poses(source)
    chosen = [named.pose for named in shown[:: max(1, len(shown) // 2)][:2]]
    cameras = [seen.camera for seen in views(source, SIZE, shown)][:2]
    job = Job(tmp_path)
    job.say("begin", kind)
    for p, pose in enumerate(chosen):
        job.add(file, avatar, pose)
        for c, camera in enumerate(cameras):
            job.camera(camera)
            job.draw(f"{p}_{c}")
        job.say("clear")
    job.say("conform", tmp_path, "cases")
    job.say("end")
    said = job.run(desk_program(kind))
    assert ["passed", "1"] in said and ["left", "0"] in said
    player, worst = Player(avatar, "gl", target="rgba32f"), 0.0
    for p, pose in enumerate(chosen):
        for c, camera in enumerate(cameras):
            image = player.frame(pose, camera, (0.0, 0.0, 0.0)).image
            want = np.dstack([image.colour, 1 - image.transmittance])
            assert want[..., 3].max() > 0.5
            worst = max(worst, float(np.abs(job.image(f"{p}_{c}") - want).max()))
    measured(f"native {kind}, image of a sample", worst, BYTE)
    assert worst <= BYTE
