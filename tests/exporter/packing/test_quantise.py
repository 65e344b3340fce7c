"""Small integers stand for floats within half a step, and keep what must stay exact: sums, unit lengths, images."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_export.packing.quantise import linear, quantised, shares, signed, table, unit_quats, weights
from avatar_export.packing.steps import UNSEEN_MESH, Fineness
from avatar_runtime.avatar import SparseRows
from avatar_runtime.player import Player
from avatar_runtime.program.codes import decode
from tests.avatars import full_avatar, surface_avatar
from tests.runtime.backends.gl_cases import pose_of

RNG = np.random.default_rng(3)


@pytest.mark.parametrize(("step", "width"), [(0.05, 8), (1e-4, 16)])
def test_linear_is_within_half_a_step(step: float, width: int) -> None:
    values = RNG.uniform(-1, 2, (200, 3)).astype(np.float32)
    codes = linear(values, step)
    assert codes.width == width
    assert np.abs(decode(codes, 200, 3) - values).max() <= 0.501 * step


def test_linear_of_equal_values_stores_nothing() -> None:
    codes = linear(np.full((5, 2), 0.7, np.float32), 0.1)
    assert codes.codes is None and (decode(codes, 5, 2) == np.float32(0.7)).all()


def test_barycentric_weights_add_up() -> None:
    values = RNG.dirichlet([1, 1, 1], 300).astype(np.float32)
    codes = shares(values, 1 / 255)
    assert (codes.codes.astype(int).sum(axis=1) == 255).all()
    assert np.abs(decode(codes, 300, 3) - values).max() <= 1.01 / 255


def test_opacities_are_within_a_step_after_the_sigmoid() -> None:
    logit = RNG.normal(0, 3, 500).astype(np.float32)
    found = decode(table(logit, 1 / 255), 500, 1)[:, 0]
    error = np.abs(1 / (1 + np.exp(-found)) - 1 / (1 + np.exp(-logit)))
    assert error.max() <= 1 / 255  # half a step to the code, half a step to the mean of its members


def test_deltas_are_within_half_a_step_and_small_ones_are_none() -> None:
    column = np.sort(RNG.integers(0, 4, 400)).astype(np.uint16)
    values = RNG.normal(0, 1, (400, 3))
    values[0] = 0.5 * 0.02
    step = np.full((4, 3), 0.04)
    found = decode(signed(values, column, 4, step), 400, 3, column)
    assert (found[0] == 0).all()
    moved = np.abs(values) > 0.6 * step[column]
    assert np.abs(found - values)[moved].max() <= 0.501 * 0.04
    assert np.abs(values[found == 0]).max() <= 0.6 * 0.04


def test_deltas_without_room_in_a_byte_take_two() -> None:
    values = np.concatenate([RNG.normal(0, 1, (99, 1)), [[100.0]]])
    assert signed(values, np.zeros(100, np.uint16), 1, np.full((1, 1), 0.01)).width == 16


def test_one_column_of_large_deltas_takes_two_bytes_for_all() -> None:
    column = np.repeat(np.arange(40, dtype=np.uint16), 20)
    values = RNG.uniform(-1, 1, (800, 3))
    values[column == 7] *= 6
    codes = signed(values, column, 40, np.full((40, 3), 1 / 127))
    assert codes.width == 16, "a pose may show this column alone"
    assert np.abs(decode(codes, 800, 3, column) - values).max() <= 0.61 / 127


def test_rows_of_skin_weights_keep_their_sum() -> None:
    ptr = np.arange(0, 401, 4, dtype=np.uint32)
    values = RNG.dirichlet([1, 1, 1, 1], 100).astype(np.float32).reshape(-1)
    rows = SparseRows(ptr, np.tile(np.arange(4, dtype=np.uint16), 100), {"weight": values}, 4)
    codes: dict = {}
    found = weights(rows, "skin", Fineness(), codes)
    stored = codes["skin.weight"].codes[:, 0].astype(int)
    kept = np.repeat(np.arange(100), np.diff(found.row_ptr))
    assert (np.bincount(kept, stored) == 4095).all()
    assert found.entries <= 400 and stored.min() > 0


def test_unit_quaternions_change_no_splat() -> None:
    for avatar in (full_avatar(3), surface_avatar(3)):
        unit = unit_quats(avatar)
        for quat in (
            unit.gaussians.quat_wxyz,
            *([] if unit.embedding is None else [unit.embedding.local_quat_wxyz]),
        ):
            np.testing.assert_allclose(np.linalg.norm(quat, axis=1), 1, rtol=1e-6)
        assert not np.array_equal(unit.gaussians.quat_wxyz, avatar.gaussians.quat_wxyz)
        pose = pose_of(avatar)
        got, want = (Player(a, "reference").animate(pose) for a in (unit, avatar))
        np.testing.assert_allclose(got.quat_wxyz, want.quat_wxyz, atol=2e-6)


def test_an_expression_with_a_larger_range_gets_finer_steps() -> None:
    avatar = full_avatar(3)
    wide = (replace(avatar.expressions[0], range=(-2.0, 4.0)), *avatar.expressions[1:])
    _, plain = quantised(avatar, Fineness(0.2))
    _, ranged = quantised(replace(avatar, expressions=wide), Fineness(0.2))
    path = "blendshapes.geometry.mean"
    assert (ranged[path].scale[0] < plain[path].scale[0]).any() or ranged[path].width > plain[path].width
    np.testing.assert_array_equal(ranged["gaussians.mean"].scale, plain["gaussians.mean"].scale)


def test_a_mesh_that_no_gaussian_is_bound_to_is_coarser() -> None:
    codes = quantised(full_avatar(3), Fineness(0.5))[1]["rig.vertices"]
    bound = quantised(surface_avatar(3), Fineness(0.5))[1]["rig.vertices"]
    spans = [np.ptp(avatar.rig.vertices, axis=0) for avatar in (full_avatar(3), surface_avatar(3))]
    floors = [span / 65535 for span in spans]
    assert np.allclose(codes.scale[:, 1], np.maximum(UNSEEN_MESH * 2e-6, floors[0]), rtol=1e-4)
    assert np.allclose(bound.scale[:, 1], np.maximum(2e-6, floors[1]), rtol=1e-4)


def test_deltas_of_an_avatar_without_columns() -> None:
    none = signed(np.zeros((0, 3)), np.zeros(0, np.uint16), 0, np.zeros((0, 3)))
    assert none.codes is None and none.scale.shape == (0, 3)
