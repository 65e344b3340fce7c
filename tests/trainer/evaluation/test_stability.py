"""The measures of motion that was not trained on, by hand and by plain loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_export.playing.sequences import own_clip
from avatar_runtime.avatar import Avatar, Clip, Rules
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import translation_matrix
from avatar_trainer.evaluation.stability import NEIGHBOURS, _trembling, stability
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


def test_an_avatar_without_a_training_clip_says_what_it_is_for(avatar: Avatar) -> None:
    other = replace(avatar, clips=tuple(clip for clip in avatar.clips if clip.name != "training"))
    with pytest.raises(AvatarError) as refused:
        stability(other, poses(avatar, 1))
    assert (
        "has no clip 'training', by which its splats' stretch is judged: `avatar-train export` adds it"
        in str(refused.value)
    )
    assert "--clip training.csv" in str(refused.value)


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


def test_the_training_clip_is_not_torn(avatar: Avatar) -> None:
    found = stability(avatar, poses(avatar, 1.0))
    assert found.torn_share == 0
    assert found.sharpness == pytest.approx(1)


def moving_one(avatar: Avatar, share: float) -> Avatar:
    """`avatar` whose first expression moves one Gaussian, away from its nearest neighbour, and nothing else.

    share: of their distance, for a weight of 1.
    """
    mean = Player(avatar, "reference").animate(Pose()).mean.astype(np.float64)
    apart = np.linalg.norm(mean[:24] - mean[5], axis=1)
    apart[5] = np.inf
    away = mean[5] - mean[int(np.argmin(apart))]
    row_ptr = np.repeat([0, 1], [6, avatar.gaussians.count - 5]).astype(np.uint32)
    values = {"mean": (share * away)[None].astype(np.float32), "quat_wxyz": np.zeros((1, 4), np.float32)}
    one = replace(avatar.blendshapes.geometry, row_ptr=row_ptr, column=np.zeros(1, np.uint16), values=values)
    unbound = tuple(replace(group, binding="none", joint_mix={}) for group in avatar.groups)
    return replace(avatar, groups=unbound, blendshapes=replace(avatar.blendshapes, geometry=one))


def test_a_doubled_difference_is_seen(avatar: Avatar) -> None:
    """Training shows a fifth of an expression; all of it tears a Gaussian that moves twice as far as it should."""
    name = avatar.expressions[0].name
    shown = [Pose({name: weight}) for weight in (0.5, 1.0)]
    assert stability(moving_one(avatar, 0.2), shown).torn_share == 0
    doubled = stability(moving_one(avatar, 0.4), shown)
    assert 0 < doubled.torn_share < 0.1 and doubled.torn_by_group["lower_teeth"] == 0


def test_an_avatar_without_a_training_clip_is_refused(avatar: Avatar) -> None:
    with pytest.raises(AvatarError, match="training"):
        stability(replace(avatar, clips=avatar.clips[:1]), poses(avatar, 1.0))


def test_flicker_is_that_of_the_mesh_where_splats_stay_on_it() -> None:
    bound = surface_avatar(rules=Rules(position="interpolated_normal", rotation="vertex_quaternion"))
    assert bound.rig is not None and bound.embedding is not None
    on_mesh = replace(
        bound, embedding=replace(bound.embedding, displacement=0 * bound.embedding.displacement)
    )
    rng = np.random.default_rng(3)
    none = (
        np.zeros((1, len(bound.expressions)), np.float32),
        np.zeros((1, len(bound.eyelids)), np.float32),
    )
    still = np.tile(np.eye(4, dtype=np.float32), (1, len(bound.rig.joint_names), 1, 1))
    clip = Clip("training", 30.0, *none, still, still[:, 0])
    shaken = [
        Pose(world_from_avatar=translation_matrix(shift)) for shift in rng.normal(scale=0.01, size=(5, 3))
    ]
    found = stability(replace(on_mesh, clips=(clip,)), shaken)
    assert found.flicker == pytest.approx(1, abs=1e-4) and found.sharpness is None
    assert stability(replace(on_mesh, clips=(clip,)), shaken[:2]).flicker is None


def test_places_without_a_second_difference_do_not_tremble() -> None:
    start, speed = np.random.default_rng(0).normal(size=(2, 5, 3))
    steady = [start + k * speed for k in range(4)]
    assert _trembling(steady) == pytest.approx(0, abs=1e-15)
    steady[2] = steady[2] + [0.0, 0.0, 0.5]
    assert _trembling(steady) == pytest.approx((0.5 + 1.0) / 2)  # of the middles 1 and 2
