"""The web player draws every trained sample as backend `gl` does, in the poses and views that packs are measured in."""

from __future__ import annotations

from collections.abc import Iterator

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
from tests.players.test_web_played import IMAGE_LIMIT
from tests.players.web import BACKENDS, Job, ask, shot

pytestmark = pytest.mark.players
SAMPLES = ("head_blendshapes", "head_splatting", "body_splatting", "head_points", "asm_face")
SIZE = 512
BLACK = (0.0, 0.0, 0.0)


@pytest.fixture(scope="module", params=SAMPLES)
def drawn(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[dict[str, float]]:
    """The largest difference of an image from that of `gl`, by backend."""
    folder = tmp_path_factory.mktemp("web")
    source = with_active_sh(AVATARS[request.param].load(folder))
    file = pack([source], Fineness()).file
    (folder / "a.avatar").write_bytes(file)
    avatar = decode_pack(file, "a").avatar
    shown = poses(source)
    chosen = [named.pose for named in shown[:: max(1, len(shown) // 2)][:2]]
    job, expected, player = (
        Job(files={"/a.avatar": str(folder / "a.avatar")}),
        {},
        Player(avatar, "gl", target="rgba32f"),
    )
    for index, pose in enumerate(chosen):
        for side, camera in enumerate([seen.camera for seen in views(source, SIZE, shown)][:2]):
            name = f"{index}_{side}"
            job.shots.append(shot(name, [("/a.avatar", avatar, pose)], camera))
            image = player.frame(pose, camera, BLACK).image
            expected[name] = np.dstack([image.colour, 1 - image.transmittance])
    images = ask(job, folder).images
    yield {
        backend: max(float(np.abs(images[backend, name] - want).max()) for name, want in expected.items())
        for backend in BACKENDS
    }


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_sample_is_drawn_as_gl_draws_it(backend: str, drawn: dict[str, float], measured: Measure) -> None:
    measured(f"web {backend}, image of a sample", drawn[backend], IMAGE_LIMIT)
    assert drawn[backend] <= IMAGE_LIMIT
