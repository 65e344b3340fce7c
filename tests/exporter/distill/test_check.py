"""What is wrong with frames: found, named, and mended where that is certain."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from samples.dumps import covariances, random_poses, write_dumps

from avatar_export.distill.dumps.check import Checked, check
from avatar_export.distill.dumps.folder import Encoding, open_dumps
from avatar_export.distill.dumps.frames import layout, read_frame, read_rows
from avatar_export.notes.note import fact
from avatar_export.notes.text import text
from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from tests.exporter.distill.conftest import edited


def judged(folder: Path) -> Checked:
    """The dumps in `folder`, checked."""
    return check(open_dumps(folder))


def rewritten(file: Path, change: Callable[[F32, list[str]], F32]) -> None:
    """The rows of a .ply changed by `change(matrix)`, which returns the new rows."""
    data = file.read_bytes()
    head = ply.header(data, len(data))
    names = list(head.dtype.names or ())
    matrix = np.frombuffer(data, "<f4", offset=head.offset).reshape(head.rows, len(names)).copy()
    matrix = change(matrix, names)
    text = data[: head.offset].replace(b"vertex %d" % head.rows, b"vertex %d" % len(matrix))
    file.write_bytes(text + matrix.astype("<f4").tobytes())


def test_sound_dumps_are_left_alone(head_dumps: Path) -> None:
    found = judged(head_dumps)
    assert found.mended == () and found.order is None


def test_another_count_is_refused(few: Path) -> None:
    rewritten(few / "frames" / "00002.ply", lambda rows, _: rows[:-1])
    with pytest.raises(AvatarError, match=r"00002.ply: has \d+ Gaussians, 00000.ply has \d+"):
        judged(few)


@pytest.mark.parametrize("name, value, said", [("opacity", np.nan, "nan"), ("rot_0", 3e38, r"3.*e\+38")])
def test_a_number_that_no_avatar_has_is_named(few: Path, name: str, value: float, said: str) -> None:
    """NaN, and a quaternion whose length overflows; in the first frame and in a later one."""

    def spoil(rows: np.ndarray, names: list[str]) -> np.ndarray:
        rows[5, names.index(name)] = value
        return rows

    for frame in ("00001.ply", "00000.ply"):
        rewritten(few / "frames" / frame, spoil)
        with pytest.raises(
            AvatarError, match=rf"{frame}: {name}\[5\]: is {said}; finite numbers of at most 1e\+12"
        ):
            judged(few)


def test_flipped_quaternions_are_mended(few: Path) -> None:
    def flip(rows: np.ndarray, names: list[str]) -> np.ndarray:
        rows[::3, names.index("rot_0") :] *= -1
        return rows

    rewritten(few / "frames" / "00003.ply", flip)
    assert fact("signs_change", frames="00003.ply and 1 more") in judged(few).mended


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


def test_two_swapped_gaussians_are_mended(few: Path) -> None:
    dumps = open_dumps(few)
    known = layout(dumps.frame(0), dumps.encoding)
    height = read_frame(dumps, known, 0).mean[0, :, 1]
    two = [int(height.argmin()), int(height.argmax())]
    order = np.arange(known.rows)
    order[two] = order[two[::-1]]
    for frame in range(2, 6):
        rewritten(few / "frames" / f"{frame:05d}.ply", lambda rows, _: rows[order])
    found = judged(few)
    assert found.order is not None
    np.testing.assert_array_equal(found.order[5], order)


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
    with pytest.raises(AvatarError, match=r"00004.ply: holds the Gaussians in another order.*distinguished"):
        judged(few)


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
    folder = edited(write_dumps(small_head, [poses], tmp_path / "dumps", stored), **said)
    found = judged(folder)
    assert any(wanted in text(note) for note in found.mended)
    rows = read_rows(found.dumps, found.layout, slice(0, 50))
    splats = Player(small_head, "reference").animate(poses[2])
    np.testing.assert_allclose(np.exp(rows.log_scale[2]), splats.scale[:50], rtol=2e-5)
    np.testing.assert_allclose(1 / (1 + np.exp(-rows.opacity_logit[2])), splats.opacity[:50], atol=2e-6)


def test_squares_in_place_of_scales_are_mended(small_head: Avatar, tmp_path: Path) -> None:
    folder = write_dumps(
        small_head, [random_poses(small_head, 4, 3.0)], tmp_path / "dumps", Encoding(scale="linear")
    )

    def square(rows: np.ndarray, names: list[str]) -> np.ndarray:
        first = names.index("scale_0")
        rows[:, first : first + 3] **= 2
        return rows

    for file in sorted((folder / "frames").iterdir()):
        rewritten(file, square)
    found = judged(folder)
    assert "variance" in [note.values.get("right") for note in found.mended]


def test_covariances_in_place_of_scales_are_mended(small_head: Avatar, tmp_path: Path) -> None:
    poses = random_poses(small_head, 4, 3.0)
    folder = write_dumps(small_head, [poses], tmp_path / "dumps")
    player = Player(small_head, "reference")
    for frame, pose in enumerate(poses):
        file = folder / "frames" / f"{frame:05d}.ply"
        data = file.read_bytes()
        head = ply.header(data, len(data))
        rows = np.frombuffer(data, "<f4", offset=head.offset).reshape(head.rows, -1)
        text = (
            data[: head.offset]
            .replace(b"scale_", b"cov_")
            .replace(b"rot_0", b"cov_3")
            .replace(b"rot_1", b"cov_4")
        )
        text = text.replace(b"rot_2", b"cov_5").replace(b"property float rot_3\n", b"")
        packed = np.concatenate([rows[:, :-7], covariances(player.animate(pose))], axis=1)
        file.write_bytes(text + packed.astype("<f4").tobytes())
    found = judged(folder)
    assert "covariances" in [note.kind for note in found.mended]
    rows = read_rows(found.dumps, found.layout, slice(0, 50))
    splats = player.animate(poses[1])
    wanted = np.sort(splats.scale[:50], axis=1)
    np.testing.assert_allclose(np.sort(np.exp(rows.log_scale[1]), axis=1), wanted, rtol=0.02)
