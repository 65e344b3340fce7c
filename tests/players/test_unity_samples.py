"""The Unity player's core plays every trained sample as backend `gl` does."""

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
from tests.exporter.packing.cases import COARSE
from tests.measured import Measure
from tests.players.played_cases import HEAD, vectors
from tests.players.test_unity_played import STILL, scene
from tests.players.test_web_played import IMAGE_LIMIT
from tests.players.test_web_samples import SAMPLES, SIZE
from tests.players.unity_play.desk import play, player_program
from tests.players.unity_play.frames import ROUNDING, frame_of
from tests.runtime.backends import gl_cases

pytestmark = pytest.mark.players


@pytest.mark.parametrize("sample", SAMPLES)
def test_a_sample_is_played_as_gl_plays_it(
    sample: str, tmp_path_factory: pytest.TempPathFactory, tmp_path: Path, measured: Measure
) -> None:
    """Two poses from two sides. Rounding may move a splat over the cut-off of alpha, 1/255: a pixel moves no more."""
    source = with_active_sh(AVATARS[sample].load(tmp_path))
    file = tmp_path / "a.avatar"
    file.write_bytes(pack([source], Fineness()).file)
    avatar = decode_pack(file.read_bytes(), "a").avatar
    shown = poses(source)
    chosen = [named.pose for named in shown[:: max(1, len(shown) // 2)][:2]]
    cameras = [seen.camera for seen in views(source, SIZE, shown)][:2]
    wanted = {f"{p}_{c}": (pose, camera) for p, pose in enumerate(chosen) for c, camera in enumerate(cameras)}
    scenes = [scene(name, [(file, avatar, pose, STILL)], camera) for name, (pose, camera) in wanted.items()]
    played = play(player_program(tmp_path_factory), {"scenes": scenes, "references": []}, tmp_path)
    images, apart = 0.0, 0.0
    for name, (pose, camera) in wanted.items():
        image = played[name].image
        assert image is not None
        difference = np.abs(image - frame_of(avatar, pose, camera).image)
        images, apart = max(images, float(difference.max())), max(apart, float(difference.mean()))
    measured("unity core, image of a sample", images, IMAGE_LIMIT)
    measured("unity core, image of a sample, mean", apart, ROUNDING)
    assert images <= IMAGE_LIMIT and apart <= ROUNDING


@pytest.mark.parametrize("name", [*gl_cases.avatars(), *SAMPLES])
def test_every_case_of_a_reference_is_repeated(
    name: str, tmp_path_factory: pytest.TempPathFactory, tmp_path: Path, measured: Measure
) -> None:
    if name in SAMPLES:
        source, fineness = with_active_sh(AVATARS[name].load(tmp_path)), Fineness()
    else:
        source, fineness = gl_cases.avatars()[name], COARSE
    folder = tmp_path / "reference"
    folder.mkdir()
    file = pack([source], fineness).file
    for part, data in {HEAD: file, **vectors(decode_pack(file, name).avatar, None)}.items():
        (folder / part).write_bytes(data)
    job = {"scenes": [], "references": [str(folder)]}
    rows = play(player_program(tmp_path_factory), job, tmp_path)[str(folder)].rows
    assert len({row["case"] for row in rows}) >= 3, name
    assert not [row for row in rows if not row["passed"]], name
    measured("unity core, every case of a reference, share of the tolerance", max(r["used"] for r in rows), 1)
