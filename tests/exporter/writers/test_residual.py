"""The residual of engines in the manifest is what an oracle measures on rig.glb."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_export.writers.residual import engine_residual, residual_poses
from avatar_runtime.avatar import Avatar, SparseRows
from avatar_runtime.engine_pose import engine_pose
from avatar_runtime.errors import AvatarError
from tests.avatars import VERTICES, full_avatar
from tests.exporter.writers.rigs import (
    distance,
    rig_of,
    runtime_mesh,
    scaled_at_rest,
    state_of,
    strongest,
    with_rig,
    without_late,
    written,
)
from tests.oracles.gltf_pose import File


@pytest.mark.parametrize("influences", [4, 8])
@pytest.mark.parametrize("scale", [(1.0, 1.0, 1.0), (1.3, 0.8, 1.0)])
def test_the_residual_is_what_the_oracle_measures(influences: int, scale: tuple[float, float, float]) -> None:
    """And each part of it is what is left when the others are taken away."""
    avatar = scaled_at_rest(full_avatar(), scale)
    said = engine_residual(avatar, influences)
    poses = list(residual_poses(avatar))
    assert said["poses"] == len(poses) == 12 + 5 + 3

    def measure(a: Avatar, sets: int, late: bool) -> float:
        file = File(written(a, 4 * sets))
        shown = [p if late else without_late(p) for p in poses]
        states = [state_of(a, engine_pose(a, p)) for p in shown]
        pairs = zip(states, shown, strict=True)
        return 1e3 * max(distance(file.posed(s, sets), runtime_mesh(a, file, p)) for s, p in pairs)

    rounding = 6e-4  # of three decimals, and of float32
    assert abs(said["residual_mm"] - measure(avatar, influences // 4, True)) <= rounding
    assert abs(said["shear_mm"] - measure(avatar, 2, False)) <= rounding
    unsheared = full_avatar()
    plain = engine_residual(unsheared, influences)
    assert abs(plain["truncation_mm"] - measure(unsheared, influences // 4, False)) <= rounding
    assert abs(plain["late_morph_mm"] - measure(unsheared, 2, True)) <= rounding
    assert (said["shear_mm"] > 1) == (scale[0] != 1) and plain["shear_mm"] == 0
    assert (said["truncation_mm"] > 1) == (influences == 4) and said["late_morph_mm"] > 1


def test_a_rig_that_gltf_can_say_has_no_residual() -> None:
    avatar = strongest(replace(full_avatar(), clips=()), 4)
    empty = SparseRows.empty(VERTICES, 2, {"position": (3,)})
    said = engine_residual(with_rig(avatar, late_morphs=empty))
    assert said == {
        "residual_mm": 0.0,
        "truncation_mm": 0.0,
        "late_morph_mm": 0.0,
        "shear_mm": 0.0,
        "poses": 12,
    }


def test_the_residual_of_a_rig_beyond_float32_is_refused() -> None:
    avatar = full_avatar()
    with pytest.raises(AvatarError, match="float32"):
        engine_residual(with_rig(avatar, vertices=np.sign(rig_of(avatar).vertices) * np.float32(3e38)))
