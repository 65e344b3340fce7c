"""The format of dumps: what is read, and mistakes in frames, documents and drivers, each named in one line."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from samples.dumps import random_poses, write_dumps

from avatar_export.distill.dumps.folder import DOCUMENT, Encoding, open_dumps
from avatar_export.distill.dumps.frames import (
    decoded,
    layout,
    raw_rows,
    read_frame,
    read_rows,
)
from avatar_export.distill.dumps.order import MOST_CHANGES
from avatar_export.distill.sh_turn import turned_sh
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_runtime.stages.project import sh_colour
from tests.exporter.distill.conftest import edited, rewritten, swapped, with_arrays
from tests.exporter.distill.test_check import judged
from tests.exporter.refusals import refused


def renamed(*names: tuple[bytes, bytes]) -> Callable[[Path], object]:
    """Other names for properties of a .ply."""

    def apply(file: Path) -> None:
        data = file.read_bytes()
        for old, new in names:
            data = data.replace(old, new)
        file.write_bytes(data)

    return apply


def as_doubles(file: Path) -> None:
    """The same rows as float64, as another program writes them."""
    data = file.read_bytes()
    at = data.index(b"end_header\n") + len(b"end_header\n")
    text = data[:at].replace(b"property float ", b"property double ")
    file.write_bytes(text + np.frombuffer(data[at:], "<f4").astype("<f8").tobytes())


def further_rest(file: Path) -> None:
    """One f_rest property, of which there are 9, 24 or 45."""
    rewritten(file, lambda rows, _: np.concatenate([rows, rows[:, :1]], axis=1))
    renamed((b"end_header", b"property float f_rest_0\nend_header"))(file)


OLD = [f"{name}_{k}".encode() for name in ("scale", "rot") for k in range(3)]
COVARIANCES = [(old, b"cov_%d" % k) for k, old in enumerate(OLD)]


@pytest.mark.parametrize(
    "frame, spoil, wanted",
    [
        (2, as_doubles, "has other properties than 00000.ply, or another type"),
        (0, renamed((b"rot_3", b"rot_9")), "property rot_3: is missing"),
        (0, renamed(*COVARIANCES, (b"nx", b"scale_0")), "it holds covariances: set encoding.scale to covariance"),
        (0, further_rest, r"f_rest_\*: 1 properties, expected one of 0, 9, 24, 45"),
        (0, lambda file: file.write_bytes(b"solid cube\n"), ""),
        (1, lambda file: os.truncate(file, file.stat().st_size - 5), ""),
    ],
)  # fmt: skip
def test_bad_frames(few: Path, frame: int, spoil: Callable[[Path], object], wanted: str) -> None:
    spoil(few / "frames" / f"{frame:05d}.ply")
    refused(f"{frame:05d}.ply: .*{wanted}", judged, few)


def test_a_frame_that_goes_or_shrinks_while_it_is_read_is_named(few: Path) -> None:
    dumps = open_dumps(few)
    known, file = layout(dumps.frame(0), dumps.encoding), dumps.frame(3)
    os.truncate(file, file.stat().st_size - 5)
    refused(r"00003.ply: became shorter while it was read", read_frame, dumps, known, 3)
    file.unlink()
    refused(r"00003.ply: cannot be read \(No such file", read_frame, dumps, known, 3)
    refused(r"00003.ply: cannot be read \(No such file", layout, file, dumps.encoding)


SHORT = {"take": np.zeros(3, np.int64), "drivers": np.zeros((3, 53))}
SHORT["world_from_joint"] = np.tile(np.eye(4), (3, 5, 1, 1))


@pytest.mark.parametrize(
    "spoil, wanted",
    [
        (lambda few: (few / DOCUMENT).write_text("{"), "dumps.json: is not valid JSON"),
        (lambda few: with_arrays(few, **SHORT), "take: has 3 frames; 4 to 100000 are read"),
        (lambda few: [(few / "frames" / f"0000{k}.ply").unlink() for k in (1, 4)], "00001.ply: is missing and 1 more"),
        (lambda few: with_arrays(few, drivers=np.ones((6, 53), bool)), "drivers: has type bool, numbers are needed"),
    ],
)  # fmt: skip
def test_mistakes_in_the_folder_are_named(few: Path, spoil: Callable[[Path], object], wanted: str) -> None:
    spoil(few)
    refused(wanted, open_dumps, few)


def test_a_file_is_no_folder_of_dumps(few: Path) -> None:
    refused(r"dumps.json: is not a folder; pass the one with dumps.json", open_dumps, few / DOCUMENT)


def test_an_order_that_changes_all_the_time_is_refused(small_head: Avatar, tmp_path: Path) -> None:
    frames = MOST_CHANGES + 2
    folder = write_dumps(small_head, [random_poses(small_head, frames, 3.0)], tmp_path / "dumps")
    swapped(folder, range(1, frames, 2))
    refused("00009.ply: is the 9th frame with another order of Gaussians", judged, folder)


@pytest.mark.parametrize(
    "encoding",
    [Encoding(), Encoding("linear", "linear", "xyzw", "rgb", "rotated")],
    ids=["trained", "activated"],
)
def test_every_encoding_gives_what_was_posed(small_head: Avatar, tmp_path: Path, encoding: Encoding) -> None:
    poses = random_poses(small_head, 4, 8.0)
    dumps = open_dumps(write_dumps(small_head, [poses], tmp_path / "dumps", encoding))
    rows = read_rows(dumps, layout(dumps.frame(0), encoding), slice(0, small_head.gaussians.count))
    for frame, pose in enumerate(poses):
        splats = Player(small_head, "reference").animate(pose)
        for got, wanted in (
            (rows.mean[frame], splats.mean),
            (np.exp(rows.log_scale[frame]), splats.scale),
            (1 / (1 + np.exp(-rows.opacity_logit[frame])), splats.opacity),
            (np.abs(np.sum(rows.quat_wxyz[frame] * splats.quat_wxyz, axis=1)), 1),
            (rows.sh[frame], splats.sh),
        ):
            np.testing.assert_allclose(got, wanted, rtol=2e-5, atol=2e-6)


def test_sh_turn_with_a_rotation() -> None:
    rng = np.random.default_rng(1)
    sh = rng.normal(size=(7, 16, 3)).astype(np.float32)
    rotation = matrix_from_rotvec(rng.normal(size=(7, 3))).astype(np.float32)
    seen = rng.normal(size=(7, 3))
    seen = (seen / np.linalg.norm(seen, axis=1, keepdims=True)).astype(np.float32)
    back = np.einsum("nij,ni->nj", rotation, seen)
    np.testing.assert_allclose(sh_colour(turned_sh(sh, rotation), seen, 3), sh_colour(sh, back, 3), atol=2e-5)


def test_units_and_axes_are_those_of_the_bundle(few: Path) -> None:
    plain = open_dumps(few)
    known = layout(plain.frame(0), plain.encoding)
    raw = raw_rows(plain.frame(0), known, slice(0, known.rows))[None]
    still = decoded(plain, known, raw)
    large = decoded(open_dumps(edited(few, unit=0.01, up_axis="+z")), known, raw)
    np.testing.assert_allclose(large.mean, 0.01 * still.mean[..., [0, 2, 1]] * [1, 1, -1], atol=1e-8)
    np.testing.assert_allclose(large.log_scale, still.log_scale + np.log(0.01), atol=2e-6)


@pytest.mark.parametrize(
    "changes, wanted",
    [
        ({"encoding__scale": "metres"}, "encoding.scale.*'metres' is unknown"),
        ({"unit": None}, "'unit' is a required property"),
        ({"version": "2.0"}, "version.*update avatar-export"),
        ({"held_out": [9]}, "held_out.*names take 9"),
    ],
)
def test_mistakes_in_the_document_are_named(few: Path, changes: dict[str, Any], wanted: str) -> None:
    refused(wanted, open_dumps, edited(few, **changes))


TRANSPOSED = np.eye(4)
TRANSPOSED[3, :3] = 1, 2, 3


@pytest.mark.parametrize(
    "changes, wanted",
    [
        ({"drivers": np.zeros((5, 53))}, r"drivers: has shape \[5, 53\], expected \[6, 53\]"),
        ({"rest": None}, "rest: is missing"),
        ({"drivers": np.full((6, 53), np.nan)}, r"drivers: \[0, 0\] is not a finite number"),
        ({"rest": np.tile(TRANSPOSED, (5, 1, 1))}, "rest: .* is not an affine matrix"),
        ({"parents": np.array([1, -1, 1, 1, 1])}, "parents: .* parents must come before"),
    ],
)  # fmt: skip
def test_mistakes_in_the_drivers_are_named(few: Path, changes: dict[str, Any], wanted: str) -> None:
    refused(wanted, open_dumps, with_arrays(few, **changes))


def test_a_missing_and_a_further_frame_are_named(few: Path) -> None:
    frame = few / "frames" / "00003.ply"
    data = frame.read_bytes()
    frame.unlink()
    refused(r"00003.ply: is missing; drivers.npz has 6 frames", open_dumps, few)
    frame.write_bytes(data)
    (few / "frames" / "00006.ply").write_bytes(data)
    refused(r"00006.ply: has no row in drivers.npz", open_dumps, few)


def test_features_that_need_a_decoder_are_refused(few: Path) -> None:
    frame = few / "frames" / "00000.ply"
    data = frame.read_bytes()
    frame.write_bytes(data.replace(b"nx", b"feature_0").replace(b"ny", b"feature_1"))
    dumps = open_dumps(few)
    refused(r"has 2 features \(feature_0, ...\) that a network must decode", layout, frame, dumps.encoding)
    frame.write_bytes(data.replace(b"f_dc_", b"feat_"))
    refused("has no colours but features", layout, frame, dumps.encoding)
