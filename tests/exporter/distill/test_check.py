"""What is wrong with frames: found, named, and mended where that is certain."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from samples.dumps import covariances, random_poses, write_dumps

from avatar_export.distill.dumps.check import Checked, check
from avatar_export.distill.dumps.folder import Encoding, open_dumps
from avatar_export.distill.dumps.frames import read_rows
from avatar_export.notes.text import text
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from tests.exporter.distill.conftest import edited, rewritten
from tests.exporter.refusals import refused


def judged(folder: Path) -> Checked:
    """The dumps in `folder`, checked."""
    return check(open_dumps(folder))


def test_sound_dumps_are_left_alone(head_dumps: Path) -> None:
    found = judged(head_dumps)
    assert found.mended == () and found.order is None


def test_another_count_is_refused(few: Path) -> None:
    rewritten(few / "frames" / "00002.ply", lambda rows, _: rows[:-1])
    refused(r"00002.ply: has \d+ Gaussians, 00000.ply has \d+", judged, few)


@pytest.mark.parametrize("frame", ["00001.ply", "00000.ply"])
@pytest.mark.parametrize("name, value, said", [("opacity", np.nan, "nan"), ("rot_0", 3e38, r"3.*e\+38")])
def test_bad_numbers(few: Path, frame: str, name: str, value: float, said: str) -> None:

    def spoil(rows: np.ndarray, names: list[str]) -> np.ndarray:
        rows[5, names.index(name)] = value
        return rows

    rewritten(few / "frames" / frame, spoil)
    refused(rf"{frame}: {name}\[5\]: is {said}; .*1e\+12", judged, few)


def test_an_order_that_changes_halfway_is_mended(few: Path, small_head: Avatar) -> None:
    before = read_rows(open_dumps(few), judged(few).layout, slice(0, small_head.gaussians.count))
    shuffled = np.random.default_rng(0).permutation(small_head.gaussians.count)
    for frame in range(3, 6):
        rewritten(few / "frames" / f"{frame:05d}.ply", lambda rows, _: rows[shuffled])
    found = judged(few)
    assert found.mended[0].values["frames"].startswith("00003.ply")
    assert found.order is not None
    after = read_rows(found.dumps, found.layout, slice(0, small_head.gaussians.count), found.order)
    np.testing.assert_array_equal(after.mean, before.mean)


def test_an_order_of_gaussians_that_look_alike_is_refused(few: Path) -> None:
    rng = np.random.default_rng(0)

    def alike(rows: np.ndarray, names: list[str]) -> np.ndarray:
        first = names.index("f_dc_0")
        kinds = np.arange(len(rows)) % 2
        rows[:, first : names.index("rot_0")] = rows[kinds, first : names.index("rot_0")]
        return rows

    for frame in range(6):
        rewritten(few / "frames" / f"{frame:05d}.ply", alike)
    rewritten(few / "frames" / "00004.ply", lambda rows, _: rows[rng.permutation(len(rows))])
    refused(r"00004.ply: holds the Gaussians in another order.*distinguished", judged, few)


@pytest.mark.parametrize(
    "stored, said, wanted",
    [
        (Encoding(scale="linear"), {"encoding__scale": "log"}, "of encoding linear, not log"),
        (Encoding(), {"encoding__scale": "linear"}, "of encoding log, not linear"),
        (Encoding(opacity="linear"), {"encoding__opacity": "logit"}, "it is linear, not a logit"),
        (Encoding(), {"encoding__opacity": "linear"}, "it is a logit, not linear"),
    ],
)
def test_encodings_are_mended(
    small_head: Avatar, tmp_path: Path, stored: Encoding, said: dict[str, str], wanted: str
) -> None:
    poses = random_poses(small_head, 4, 3.0)
    found = judged(edited(write_dumps(small_head, [poses], tmp_path / "dumps", stored), **said))
    assert any(wanted in text(note) for note in found.mended)
    rows = read_rows(found.dumps, found.layout, slice(0, 50))
    splats = Player(small_head, "reference").animate(poses[2])
    np.testing.assert_allclose(np.exp(rows.log_scale[2]), splats.scale[:50], rtol=2e-5)
    np.testing.assert_allclose(1 / (1 + np.exp(-rows.opacity_logit[2])), splats.opacity[:50], atol=2e-6)


def test_covariances_in_place_of_scales_are_mended(small_head: Avatar, tmp_path: Path) -> None:
    poses = random_poses(small_head, 4, 3.0)
    folder = write_dumps(small_head, [poses], tmp_path / "dumps")
    player = Player(small_head, "reference")
    names = {b"scale_": b"cov_", b"rot_0": b"cov_3", b"rot_1": b"cov_4", b"rot_2": b"cov_5"}
    for frame, pose in enumerate(poses):
        file = folder / "frames" / f"{frame:05d}.ply"
        flat = covariances(player.animate(pose))
        rewritten(file, lambda rows, _, flat=flat: np.concatenate([rows[:, :-7], flat], axis=1))
        data = file.read_bytes()
        for old, new in {**names, b"property float rot_3\n": b""}.items():
            data = data.replace(old, new)
        file.write_bytes(data)
    found = judged(folder)
    assert "covariances" in [note.kind for note in found.mended]
    rows, splats = read_rows(found.dumps, found.layout, slice(0, 50)), player.animate(poses[1])
    wanted = np.sort(splats.scale[:50], axis=1)
    np.testing.assert_allclose(np.sort(np.exp(rows.log_scale[1]), axis=1), wanted, rtol=0.02)
