"""Poses that an avatar is measured in: always the same, within its ranges, and at least eight where it can move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from avatar_export.measure.poses import NamedPose, _rotvec, poses
from avatar_runtime.avatar import Avatar, Rules, SparseRows
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, resolve
from avatar_runtime.rotation import matrix_from_rotvec
from tests.avatars import full_avatar, surface_avatar


def without_expressions(avatar: Avatar) -> Avatar:
    """The avatar with its expressions limited to 0 and without eyelids, so that only joints and clips move it."""
    still = tuple(replace(e, range=(0.0, 0.0)) for e in avatar.expressions)
    shapes = avatar.blendshapes
    none = SparseRows.empty(shapes.late_morphs.rows, 0, {"mean": (3,)})
    rig = avatar.rig
    if rig is not None:
        rig = replace(rig, late_morphs=SparseRows.empty(rig.late_morphs.rows, 0, {"position": (3,)}))
    return replace(
        avatar,
        expressions=still,
        eyelids=(),
        blendshapes=replace(shapes, late_morphs=none),
        rig=rig,
        clips=tuple(replace(clip, late_weights=clip.late_weights[:, :0]) for clip in avatar.clips),
    )


AVATARS = {
    "everything": full_avatar,
    "no clips": lambda: replace(full_avatar(), clips=()),
    "surface": surface_avatar,
    "no expressions": lambda: without_expressions(surface_avatar()),
    "joints alone": lambda: replace(without_expressions(surface_avatar()), clips=()),
}


@pytest.mark.parametrize("name", AVATARS)
def test_there_are_eight_poses_with_different_names(name: str) -> None:
    found = poses(AVATARS[name]())
    assert len(found) == 8 and len({named.name for named in found}) == 8
    again = poses(AVATARS[name]())
    assert [(p.name, repr(p.pose)) for p in again] == [(p.name, repr(p.pose)) for p in found]


@pytest.mark.parametrize("count", [1, 3, 8, 13])
def test_as_many_as_asked_for(count: int) -> None:
    assert len(poses(full_avatar(), count)) == count


def test_half_of_them_are_frames_of_clips() -> None:
    avatar = full_avatar()  # clips of 5 and 3 frames
    names = [named.name for named in poses(avatar)]
    assert names[:4] == [
        "clip nod, frame 1",
        "clip nod, frame 3",
        "clip blink, frame 0",
        "clip blink, frame 2",
    ]
    assert all(name.startswith("expression ") for name in names[4:6])
    assert names[6:] == ["mixture 1", "mixture 2"]


def test_they_differ_and_move_the_avatar() -> None:
    for make in ("everything", "no clips", "joints alone"):
        avatar = AVATARS[make]()
        player = Player(avatar, "reference")
        means = [player.animate(named.pose).mean for named in [NamedPose("rest", Pose()), *poses(avatar)]]
        for k, mean in enumerate(means):
            assert all(np.abs(mean - other).max() > 1e-5 for other in means[:k]), (make, k)


def test_weights_stay_in_their_ranges() -> None:
    avatar = replace(full_avatar(), clips=())
    found = poses(avatar, 12)
    used = set()
    for named in found:
        for e in avatar.expressions:
            weight = named.pose.expressions.get(e.name, 0.0)
            assert e.range[0] <= weight <= e.range[1]
            used |= {e.name} if weight else set()
        assert all(0 <= weight <= 1 for weight in named.pose.eyelids.values())
    assert used == set(avatar.expression_names)


def test_the_avatar_as_a_whole_stays_where_it_is() -> None:
    avatar = full_avatar()
    assert not np.array_equal(avatar.clips[0].world_from_avatar[1], np.eye(4))
    for named in poses(avatar):
        np.testing.assert_array_equal(resolve(named.pose, avatar).world_from_avatar, np.eye(4))


def test_joints_turn_as_far_as_in_the_clips() -> None:
    avatar = without_expressions(surface_avatar())
    vectors = _rotvec(
        np.concatenate([clip.joint_delta for clip in avatar.clips])[..., :3, :3].astype(np.float64)
    )
    turned = [named for named in poses(avatar, 20) if named.name.startswith("joints")]
    assert len(turned) >= 12
    for named in turned:
        delta = resolve(named.pose, avatar).joint_delta[:, :3, :3]
        found = _rotvec(delta)
        assert (found >= vectors.min(axis=0) - 1e-9).all() and (found <= vectors.max(axis=0) + 1e-9).all()


def test_rotation_vectors_are_those_of_the_matrices() -> None:
    vectors = np.random.default_rng(0).normal(0, 1, (50, 3))
    vectors[0] = 0
    np.testing.assert_allclose(_rotvec(matrix_from_rotvec(vectors)), vectors, atol=1e-9)


def test_an_avatar_that_cannot_move_has_one_pose() -> None:
    still = surface_avatar(rules=Rules("vertex_quaternion"), rigged=False)
    names = [named.name for named in poses(without_expressions(still))]
    assert names == ["rest"]


def test_a_count_below_one_is_refused() -> None:
    with pytest.raises(ValueError, match="at least 1"):
        poses(full_avatar(), 0)
