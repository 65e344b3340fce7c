"""Stages `shadow` and `light` of backend `cpu`: threads, and numbers that are none."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_runtime.avatar import Relight
from avatar_runtime.light import SHADOW_SIZE, LightArrays, even, light_arrays
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.light import FAR
from avatar_runtime.stages.light import shadow_map as reference_map
from tests.conformance.avatars import AVATARS
from tests.conformance.cases import STUDIO

pytest.importorskip("numba")
from avatar_runtime.backends.cpu.draw.light import Lit, light
from avatar_runtime.backends.cpu.draw.screen import COLUMNS, RED
from avatar_runtime.backends.cpu.draw.shadow import shadow_map


def odd(count: int) -> tuple[Splats, LightArrays]:
    """Every fourth splat as it should be, the others with numbers that are none, or far too large."""
    rng, avatar = np.random.default_rng(3), AVATARS["lit_head"]()
    assert avatar.relight is not None
    mean, scale = rng.normal(0, 0.1, (count, 3)), np.full((count, 3), 0.01)
    mean[1::4], mean[2::4, 0] = np.nan, 1e30
    scale[3::8], scale[7::8] = np.inf, 1e25
    quat = rng.standard_normal((count, 4))
    quat /= np.linalg.norm(quat, axis=1, keepdims=True)
    arrays = (a.astype(np.float32) for a in (mean, scale, quat, np.full(count, 0.9)))
    return Splats(*arrays, np.zeros((count, 0, 3), np.float32)), light_arrays(
        STUDIO, avatar.relight, np.eye(4)
    )


def test_splats_of_no_size_and_no_place_cast_no_shadow() -> None:
    """And however many threads there are, they find the same map."""
    splats, given = odd(4000)
    sound = Splats(*(getattr(splats, name)[::4] for name in ("mean", "scale", "quat_wxyz", "opacity", "sh")))
    with np.errstate(all="ignore"):
        found, want = shadow_map(splats, given, None, 1), reference_map(sound, given)
    assert (found < FAR).sum() > 1000 and np.isfinite(found).all()
    assert ((found == FAR) <= (want == FAR)).all(), "what is sound casts its shadow"
    for workers in (2, 5):
        assert np.array_equal(shadow_map(splats, given, None, workers), found)


def test_a_splat_of_no_place_is_lit_without_reading_beyond_the_map() -> None:
    """And however many threads there are, the colours are the same."""
    splats, given = odd(4000)
    normal = np.tile(np.float32([0, 0, 1]), (4000, 1))
    relight = Relight(normal, even((1.0, 1.0, 1.0)), "world", (0.0, 0.0, 0.0), 1.0)
    lit = Lit.of(relight, given, np.full((SHADOW_SIZE, SHADOW_SIZE), FAR, np.float32))
    found = []
    for workers in (1, 2, 5):
        rows = np.full((4000, COLUMNS), 0.5, np.float32)
        light(splats.mean, splats.quat_wxyz, lit, rows, np.ones(4000, np.int32), workers)
        found.append(rows)
    assert np.isfinite(found[0][::4]).all() and (found[0][:, :RED] == 0.5).all()
    assert (found[0][::4, RED] != 0.5).all()
    assert all(np.array_equal(rows, found[0], equal_nan=True) for rows in found)
