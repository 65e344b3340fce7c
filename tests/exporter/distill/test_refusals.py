"""Mistakes in frames, documents and drivers that no other test makes: each is named in one line, or doubted in one."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from samples.dumps import random_poses, write_dumps

from avatar_export.distill import drivers
from avatar_export.distill.dumps.check import check
from avatar_export.distill.dumps.folder import DOCUMENT, open_dumps
from avatar_export.distill.dumps.frames import layout, read_frame
from avatar_export.distill.dumps.order import MOST_CHANGES
from avatar_export.distill.make import distill
from avatar_export.notes.text import stored, text
from avatar_runtime.avatar import Avatar
from avatar_runtime.io.errors import AvatarError
from tests.exporter.distill.conftest import edited, with_arrays
from tests.exporter.distill.test_check import judged, rewritten


def renamed(file: Path, old: bytes, new: bytes) -> None:
    """Another name for properties of a .ply."""
    file.write_bytes(file.read_bytes().replace(old, new))


def as_doubles(file: Path) -> None:
    """The same rows as float64, as another program writes them."""
    data = file.read_bytes()
    at = data.index(b"end_header\n") + len(b"end_header\n")
    text = data[:at].replace(b"property float ", b"property double ")
    file.write_bytes(text + np.frombuffer(data[at:], "<f4").astype("<f8").tobytes())


def further_rest(file: Path) -> None:
    """One f_rest property, of which there are 9, 24 or 45."""

    def widened(rows: np.ndarray, names: list[str]) -> np.ndarray:
        return np.concatenate([rows, rows[:, :1]], axis=1)

    rewritten(file, widened)
    renamed(file, b"end_header", b"property float f_rest_0\nend_header")


FRAMES: dict[str, tuple[int, Callable[[Path], object], str]] = {
    "type": (2, as_doubles, r"00002.ply: has other properties than 00000.ply, or another type"),
    "name": (3, lambda file: renamed(file, b"nx", b"mx"), r"00003.ply: has other properties than 00000.ply"),
    "missing": (0, lambda file: renamed(file, b"rot_3", b"rot_9"), r"00000.ply: property rot_3: is missing"),
    "covariances": (
        0,
        lambda file: [
            renamed(file, old, new)
            for old, new in (
                *((b"scale_%d" % k, b"cov_%d" % k) for k in range(3)),
                *((b"rot_%d" % k, b"cov_%d" % (k + 3)) for k in range(3)),
                (b"nx", b"scale_0"),
            )
        ],
        r"it holds covariances: set encoding.scale to covariance",
    ),
    "rest": (0, further_rest, r"00000.ply: f_rest_\*: 1 properties, expected one of 0, 9, 24, 45"),
    "no .ply": (0, lambda file: file.write_bytes(b"solid cube\n"), r"00000.ply: "),
    "cut": (1, lambda file: os.truncate(file, file.stat().st_size - 5), r"00001.ply: "),
}


@pytest.mark.parametrize("frame, spoil, wanted", FRAMES.values(), ids=FRAMES)
def test_mistakes_in_frames_are_named(
    few: Path, frame: int, spoil: Callable[[Path], object], wanted: str
) -> None:
    spoil(few / "frames" / f"{frame:05d}.ply")
    with pytest.raises(AvatarError, match=wanted):
        judged(few)


def test_a_frame_that_goes_or_shrinks_while_it_is_read_is_named(few: Path) -> None:
    dumps = open_dumps(few)
    known, file = layout(dumps.frame(0), dumps.encoding), dumps.frame(3)
    os.truncate(file, file.stat().st_size - 5)
    with pytest.raises(AvatarError, match=r"00003.ply: became shorter while it was read"):
        read_frame(dumps, known, 3)
    file.unlink()
    with pytest.raises(AvatarError, match=r"00003.ply: cannot be read \(No such file"):
        read_frame(dumps, known, 3)
    with pytest.raises(AvatarError, match=r"00003.ply: cannot be read \(No such file"):
        layout(file, dumps.encoding)


FOLDERS: dict[str, tuple[Callable[[Path], object], str]] = {
    "JSON": (lambda few: (few / DOCUMENT).write_text("{"), r"dumps.json: is not valid JSON"),
    "few": (
        lambda few: with_arrays(
            few,
            take=np.zeros(3, np.int64),
            drivers=np.zeros((3, 53)),
            world_from_joint=np.tile(np.eye(4), (3, 5, 1, 1)),
        ),
        r"take: has 3 frames; 4 to 100000 are read",
    ),
    "missing": (
        lambda few: [(few / "frames" / f"0000{k}.ply").unlink() for k in (1, 4)],
        r"00001.ply: is missing and 1 more; drivers.npz has 6 frames",
    ),
    "bool": (
        lambda few: with_arrays(few, drivers=np.ones((6, 53), bool)),
        r"drivers: has type bool, numbers are needed",
    ),
}


@pytest.mark.parametrize("spoil, wanted", FOLDERS.values(), ids=FOLDERS)
def test_mistakes_in_the_folder_are_named(few: Path, spoil: Callable[[Path], object], wanted: str) -> None:
    spoil(few)
    with pytest.raises(AvatarError, match=wanted):
        open_dumps(few)


def test_a_file_is_no_folder_of_dumps(few: Path) -> None:
    with pytest.raises(AvatarError, match=r"dumps.json: is not a folder; pass the one with dumps.json"):
        open_dumps(few / DOCUMENT)


def test_an_order_that_changes_all_the_time_is_refused(small_head: Avatar, tmp_path: Path) -> None:
    """Two Gaussians change their places in every frame: as often as is mended, and once more."""
    frames = MOST_CHANGES + 2
    folder = write_dumps(small_head, [random_poses(small_head, frames, 3.0)], tmp_path / "dumps")
    dumps = open_dumps(folder)
    height = read_frame(dumps, layout(dumps.frame(0), dumps.encoding), 0).mean[0, :, 1]
    two = [int(height.argmin()), int(height.argmax())]
    order = np.arange(small_head.gaussians.count)
    order[two] = order[two[::-1]]
    for frame in range(1, frames, 2):
        rewritten(folder / "frames" / f"{frame:05d}.ply", lambda rows, _: rows[order])
    with pytest.raises(AvatarError, match=r"00009.ply: is the 9th frame with another order of Gaussians"):
        judged(folder)


def test_a_joint_that_the_rig_lacks_is_named(few: Path, small_head: Avatar) -> None:
    rig = small_head.rig
    assert rig is not None
    shorter: dict[str, Any] = {
        name: getattr(rig, name)[:4] for name in ("joint_names", "parents", "rest_local")
    }
    with pytest.raises(AvatarError, match=rf"has joint '{rig.joint_names[4]}', which the rig lacks"):
        distill(few, rig=replace(rig, **shorter, inverse_bind_matrix=rig.inverse_bind_matrix[:4]))


def test_still_drivers_one_camera_and_few_frames_are_doubted(few: Path) -> None:
    """Six frames of a head: what is doubted goes into the provenance."""
    values = drivers.read(few / drivers.FILE).drivers.copy()
    values[:, [3, 5]] = 0.5
    with_arrays(few, drivers=values)
    edited(few, camera={"K": np.eye(3).tolist(), "camera_from_world": np.eye(4).tolist()})
    result = distill(few, accept_error=True)
    said = " | ".join(map(text, result.doubts))
    names = result.checked.dumps.drivers.driver_names
    still = [name for name, column in zip(names, values[:4].T, strict=True) if column.std() < 0.01]
    assert f"driver {still[0]} hardly varies, {len(still)} in all: nothing was learnt of it" in said
    assert "colours were dumped for one camera: from elsewhere they are approximate" in said
    assert "fewer than twice the 53 drivers" in said
    notes = result.avatar.provenance["notes"]
    assert set(stored(result.doubts)) <= set(notes)
    assert check(open_dumps(few)).mended == ()
