"""How an avatar is packed and split for the GPU; no GPU is asked."""

from __future__ import annotations

import numpy as np
import pytest

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.program.bake import bake, pose_layout
from avatar_runtime.program.chunks import Cost, runs
from avatar_runtime.program.gaussians import gaussian_runs
from avatar_runtime.program.mesh import bake_surface
from avatar_runtime.program.model import Buffer, Section
from tests.avatars import full_avatar, surface_avatar

AVATAR, SURFACE = full_avatar(5), surface_avatar(5)


def test_sections_begin_at_words_and_keep_their_bits() -> None:
    buffer = Buffer(
        "x",
        12,
        (
            Section("a", np.array([1, 2, 3], np.uint8)),
            Section("b", np.zeros(0, np.uint16)),
            Section("c", np.array([-0.0], np.float32).view(np.uint32)),
            Section("d", np.array([5, 7], np.uint16)),
        ),
    )
    assert buffer.offsets() == {"a": 0, "b": 1, "c": 1, "d": 2}
    assert buffer.content().tolist() == [0x00030201, 0x80000000, 0x00070005]


def test_a_dispatch_has_no_more_rows_than_groups_allow() -> None:
    found = runs("row", 10_000_000, [Cost(4)], 1 << 40)
    assert [run.count for run in found] == [65535 * 64, 65535 * 64, 10_000_000 - 2 * 65535 * 64]


def test_what_cannot_be_split_is_named() -> None:
    with pytest.raises(
        AvatarError, match=r"Gaussian 1 takes \d+ bytes in one buffer, the limit is 1000; raise"
    ):
        gaussian_runs(AVATAR, {}, 1000)
    with pytest.raises(AvatarError, match="Gaussian 0 takes 260 bytes"):
        gaussian_runs(SURFACE, {}, 100)


def test_a_mesh_and_a_surface_cannot_be_split() -> None:
    with pytest.raises(
        AvatarError, match="the mesh of 20 vertices takes 960 bytes in one buffer, the limit is 900"
    ):
        bake(SURFACE, limit=900)
    pose, _ = pose_layout(SURFACE)
    with pytest.raises(
        AvatarError, match="the surface of 20 triangles takes 960 bytes in one buffer, the limit is 900"
    ):
        bake_surface(SURFACE, {}, pose, 900, {})
