"""The format of dumps: what is read, and how each mistake is named."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from samples.dumps import random_poses, write_dumps

from avatar_export.distill.dumps.folder import Encoding, open_dumps
from avatar_export.distill.dumps.frames import decoded, from_covariance, layout, raw_rows, read_rows
from avatar_export.distill.sh_turn import turned_sh
from avatar_runtime.avatar import Avatar
from avatar_runtime.codec import ply
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.rotation import matrix_from_quat, matrix_from_rotvec
from avatar_runtime.stages.project import sh_colour
from tests.exporter.distill.conftest import edited, with_arrays


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


def test_covariances_give_scales_and_axes() -> None:
    rng = np.random.default_rng(0)
    axes = matrix_from_rotvec(rng.normal(size=(5, 3)))
    scale = np.exp(rng.normal(-4, 1, (5, 3)))
    turns = matrix_from_rotvec(np.linspace(0, 1, 6)[:, None] * [0.2, 1.0, 0.3])
    moved = turns[:, None] @ axes  # [F, n, 3, 3]
    full = np.einsum("fnij,nj,fnkj->fnik", moved, scale**2, moved)
    log_scale, quat = from_covariance(full.reshape(6, 5, 9)[..., [0, 1, 2, 4, 5, 8]].astype(np.float32))
    made = matrix_from_quat(quat.astype(np.float64))
    again = np.einsum("fnij,fnj,fnkj->fnik", made, np.exp(2 * log_scale.astype(np.float64)), made)
    np.testing.assert_allclose(again, full, atol=2e-6 * float(full.max()))
    assert np.ptp(log_scale, axis=0).max() < 1e-2, "each axis keeps its place from frame to frame"


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


MISTAKES: dict[str, tuple[dict[str, Any], str]] = {
    "encoding": ({"encoding__scale": "metres"}, "encoding.scale.*'metres' is unknown"),
    "missing": ({"unit": None}, "'unit' is a required property"),
    "newer": ({"version": "2.0"}, "version.*update avatar-export"),
    "no such take": ({"held_out": [9]}, "held_out.*names take 9"),
}


@pytest.mark.parametrize("changes, wanted", MISTAKES.values(), ids=MISTAKES)
def test_mistakes_in_the_document_are_named(few: Path, changes: dict[str, Any], wanted: str) -> None:
    with pytest.raises(AvatarError, match=wanted):
        open_dumps(edited(few, **changes))


ARRAYS: dict[str, tuple[dict[str, Any], str]] = {
    "another length": ({"drivers": np.zeros((5, 53))}, r"drivers: has shape \[5, 53\], expected \[6, 53\]"),
    "missing": ({"rest": None}, "rest: is missing"),
    "not finite": ({"drivers": np.full((6, 53), np.nan)}, r"drivers: \[0, 0\] is not a finite number"),
    "whose determinant overflows": (
        {"rest": np.tile(np.diag([1e200, 1e200, 1, 1]), (5, 1, 1))},
        r"rest: \[0, 0, 0\] is not a finite number of at most 1e\+12",
    ),
    "transposed": (
        {"rest": np.tile(np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [1, 2, 3, 1.0]]), (5, 1, 1))},
        "rest: .* is not an affine matrix",
    ),
    "children first": ({"parents": np.array([1, -1, 1, 1, 1])}, "parents: .* parents must come before"),
}


@pytest.mark.parametrize("changes, wanted", ARRAYS.values(), ids=ARRAYS)
def test_mistakes_in_the_drivers_are_named(few: Path, changes: dict[str, Any], wanted: str) -> None:
    with pytest.raises(AvatarError, match=wanted):
        open_dumps(with_arrays(few, **changes))


def test_a_missing_and_a_further_frame_are_named(few: Path) -> None:
    frame = few / "frames" / "00003.ply"
    data = frame.read_bytes()
    frame.unlink()
    with pytest.raises(AvatarError, match=r"00003.ply: is missing; drivers.npz has 6 frames"):
        open_dumps(few)
    frame.write_bytes(data)
    (few / "frames" / "00006.ply").write_bytes(data)
    with pytest.raises(AvatarError, match=r"00006.ply: has no row in drivers.npz"):
        open_dumps(few)


def test_features_that_need_a_decoder_are_refused(few: Path) -> None:
    frame = few / "frames" / "00000.ply"
    data = frame.read_bytes()
    frame.write_bytes(data.replace(b"nx", b"feature_0").replace(b"ny", b"feature_1"))
    dumps = open_dumps(few)
    with pytest.raises(AvatarError, match=r"has 2 features \(feature_0, ...\) that a network must decode"):
        layout(frame, dumps.encoding)
    frame.write_bytes(data.replace(b"f_dc_", b"feat_"))
    with pytest.raises(AvatarError, match="has no colours but features"):
        layout(frame, dumps.encoding)


def test_header_of_a_frame_is_that_of_the_ply(few: Path) -> None:
    data = (few / "frames" / "00000.ply").read_bytes()
    whole = ply.decode(data)
    head = ply.header(data[:4096], len(data))
    assert (head.rows, list(head.dtype.names or ())) == (whole.count, list(whole.properties))
