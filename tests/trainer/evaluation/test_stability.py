"""The measures of motion that was not trained on, by hand and by plain loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_export.playing.sequences import own_clip
from avatar_runtime import AvatarError
from avatar_runtime.avatar import Avatar, Clip, Rules
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import translation_matrix
from avatar_trainer.evaluation.stability import NEIGHBOURS, stability
from tests.avatars import full_avatar, surface_avatar

FRAMES = 4


@pytest.fixture(scope="module")
def avatar() -> Avatar:
    """Small movements to train on, and the clip `held_out`; expressions move each Gaussian by itself."""
    plain = full_avatar()
    weights = np.linspace(0, 0.2, FRAMES * len(plain.expressions), dtype=np.float32).reshape(FRAMES, -1)
    still = np.tile(
        np.eye(4, dtype=np.float32), (FRAMES, len(plain.rig.joint_names) if plain.rig else 0, 1, 1)
    )
    late = np.zeros((FRAMES, len(plain.eyelids)), np.float32)
    world = np.tile(np.eye(4, dtype=np.float32), (FRAMES, 1, 1))
    clips = (
        Clip(name, 30.0, weights * size, late, still, world)
        for name, size in (("held_out", 1), ("training", 1))
    )
    return replace(plain, clips=tuple(clips))


def poses(avatar: Avatar, size: float) -> list[Pose]:
    """The training clip with weights `size` times as large."""
    return [
        replace(pose, expressions={name: size * weight for name, weight in pose.expressions.items()})
        for pose in own_clip(avatar, "training").poses
    ]


def torn_by_loops(avatar: Avatar, shown: list[Pose]) -> float:
    """The definition, one splat after the other."""
    player = Player(avatar, "reference")
    neutral = player.animate(Pose()).mean.astype(np.float64)
    trained = [player.animate(pose).mean.astype(np.float64) for pose in own_clip(avatar, "training").poses]
    played = [player.animate(pose) for pose in shown]
    torn = whole = 0.0
    for group in avatar.groups:
        rows = range(group.first, group.first + group.count)
        for row in rows:
            apart = sorted((float(np.linalg.norm(neutral[o] - neutral[row])), o) for o in rows if o != row)
            near = apart[:NEIGHBOURS]

            def stretch(mean: np.ndarray, row: int = row, near: list[tuple[float, int]] = near) -> float:
                return max(float(np.linalg.norm(mean[o] - mean[row])) / (d + 0.001) for d, o in near)

            limit = 1.25 * max(stretch(mean) for mean in trained)
            for splats in played:
                whole += float(splats.opacity[row])
                torn += float(splats.opacity[row]) * (stretch(splats.mean.astype(np.float64)) > limit)
    return torn / whole


def test_the_torn_share_is_that_of_the_definition(avatar: Avatar) -> None:
    shown = poses(avatar, 6.0)
    found = stability(avatar, shown)
    assert 0.02 < found.torn_share < 0.5
    assert found.torn_share == pytest.approx(torn_by_loops(avatar, shown), rel=2.4e-7)  # 2 ulp of float32
    assert found.frames == FRAMES and found.splats == avatar.gaussians.count
    weight = {group.name: group.count for group in avatar.groups}
    assert set(found.torn_by_group) == set(weight)


def test_flicker_is_that_of_the_mesh_where_splats_stay_on_it() -> None:
    bound = surface_avatar(rules=Rules(position="interpolated_normal", rotation="vertex_quaternion"))
    assert bound.rig is not None and bound.embedding is not None
    on_mesh = replace(
        bound, embedding=replace(bound.embedding, displacement=0 * bound.embedding.displacement)
    )
    rng = np.random.default_rng(3)
    none = (np.zeros((1, len(bound.expressions)), np.float32), np.zeros((1, len(bound.eyelids)), np.float32))
    still = np.tile(np.eye(4, dtype=np.float32), (1, len(bound.rig.joint_names), 1, 1))
    clip = Clip("training", 30.0, *none, still, still[:, 0])
    shaken = [
        Pose(world_from_avatar=translation_matrix(shift)) for shift in rng.normal(scale=0.01, size=(5, 3))
    ]
    found = stability(replace(on_mesh, clips=(clip,)), shaken)
    assert found.flicker == pytest.approx(1, abs=1e-4) and found.sharpness is None
    assert stability(replace(on_mesh, clips=(clip,)), shaken[:2]).flicker is None


def test_an_avatar_without_a_training_clip_says_what_it_is_for(avatar: Avatar) -> None:
    other = replace(avatar, clips=tuple(clip for clip in avatar.clips if clip.name != "training"))
    with pytest.raises(AvatarError) as refused:
        stability(other, poses(avatar, 1))
    assert (
        "has no clip 'training', by which its splats' stretch is judged: `avatar-train export` adds it"
        in str(refused.value)
    )
    assert "--clip training.csv" in str(refused.value)
