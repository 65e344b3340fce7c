"""The web player draws every trained sample as backend `gl` does, in the poses and views that packs are measured in."""

from __future__ import annotations

from pathlib import Path

import pytest
from bench.pack_avatars import AVATARS

from avatar_export.measure.poses import poses
from avatar_export.measure.views import views
from avatar_export.ops.active_sh import with_active_sh
from avatar_export.packing.steps import Fineness
from avatar_export.packing.write import pack
from avatar_runtime.packs import decode_pack
from tests.measured import Measure
from tests.players.played_cases import drawn
from tests.players.test_web_played import wrong_images
from tests.players.web import BACKENDS, Job, ask, in_browsers, shot

pytestmark = pytest.mark.players
SAMPLES = ("head_blendshapes", "head_splatting", "body_splatting", "head_points", "asm_face")
SIZE = 512


@in_browsers
@pytest.mark.parametrize("sample", SAMPLES)
def test_a_sample_is_drawn_as_gl_draws_it(
    browser: str, sample: str, tmp_path: Path, measured: Measure
) -> None:
    source = with_active_sh(AVATARS[sample].load(tmp_path))
    file = pack([source], Fineness()).file
    (tmp_path / "a.avatar").write_bytes(file)
    avatar = decode_pack(file, "a").avatar
    shown = poses(source)
    job, expected = Job(BACKENDS[browser], files={"/a.avatar": str(tmp_path / "a.avatar")}), {}
    for index, named in enumerate(shown[:: max(1, len(shown) // 2)][:2]):
        for side, seen in enumerate(views(source, SIZE, shown)[:2]):
            name = f"{index}_{side}"
            job.shots.append(shot(name, [("/a.avatar", avatar, named.pose)], seen.camera))
            expected[name] = drawn(avatar, named.pose, seen.camera)
    answer = ask(job, tmp_path, browser)
    for backend in job.backends:
        assert not wrong_images(answer, backend, expected, measured, browser), backend
