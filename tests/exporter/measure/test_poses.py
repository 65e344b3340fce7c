"""Poses that an avatar is measured in: always the same, within its ranges, and at least eight where it can move."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avatar_export.measure.claims import claim_poses, search_poses
from avatar_export.measure.poses import NamedPose, poses
from avatar_export.measure.views import views
from avatar_export.packing import make as packing
from avatar_runtime.avatar import Avatar, SparseRows
from avatar_runtime.bundle import load
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous
from tests.avatars import full_avatar, surface_avatar
from tests.oracles.pack_claims import judged


def without_expressions(avatar: Avatar) -> Avatar:
    """The avatar with its expressions limited to 0 and without eyelids, so that only joints and clips move it."""
    shapes, rig = avatar.blendshapes, avatar.rig
    none = SparseRows.empty(shapes.late_morphs.rows, 0, {"mean": (3,)})
    if rig is not None:
        rig = replace(rig, late_morphs=SparseRows.empty(rig.late_morphs.rows, 0, {"position": (3,)}))
    return replace(
        avatar,
        expressions=tuple(replace(e, range=(0.0, 0.0)) for e in avatar.expressions),
        eyelids=(),
        blendshapes=replace(shapes, late_morphs=none),
        rig=rig,
        clips=tuple(replace(clip, late_weights=clip.late_weights[:, :0]) for clip in avatar.clips),
    )


def test_every_pose_lies_in_the_image() -> None:
    avatar = full_avatar()
    far = NamedPose("far", Pose(world_from_avatar=homogeneous(np.eye(3), np.array([0.5, 0.0, 0.0]))))
    shown = [*poses(avatar), far]
    player = Player(avatar, "reference")
    for view in views(avatar, 64, shown):
        for named in shown:
            mean = player.animate(named.pose).mean
            clip = np.c_[mean, np.ones(len(mean))] @ view.camera.clip_from_world.T
            assert np.abs(clip[:, :2] / clip[:, 3:]).max() < 1, named.name


SIZE = 96


def two_sided() -> Avatar:
    avatar = full_avatar()
    ranges = tuple(replace(e, range=(-0.5, e.range[1])) for e in avatar.expressions)
    return replace(avatar, expressions=ranges)


def test_every_expression_is_seen_at_both_ends_of_its_range() -> None:
    avatar = two_sided()
    wanted = {(e.name, end) for e in avatar.expressions for end in e.range if end}
    for draw in (0, 1):
        ends = [named.pose.expressions for named in claim_poses(avatar, draw) if named.kind == "ends"]
        assert {pair for one in ends for pair in one.items()} == wanted


@pytest.mark.parametrize("make_avatar", [full_avatar, lambda: without_expressions(surface_avatar())])
def test_the_search_sees_no_pose_of_the_claim(make_avatar: Callable[[], Avatar]) -> None:
    avatar = make_avatar()
    seen, claimed = search_poses(avatar), claim_poses(avatar)
    assert repr([named.pose for named in claim_poses(avatar)]) == repr([named.pose for named in claimed])
    assert not {repr(named.pose) for named in seen} & {repr(named.pose) for named in claimed}
    clips = [
        {named.name.split(",")[0] for named in found if named.kind == "clips"} for found in (seen, claimed)
    ]
    assert clips[0] and clips[1] and not clips[0] & clips[1], "an unseen clip"
    drawn = [[repr(n.pose) for n in claim_poses(avatar, draw) if n.kind == "joints"] for draw in (0, 1)]
    assert drawn[0] and not set(drawn[0]) & set(drawn[1])


def test_half_of_an_only_clip_is_unseen() -> None:
    avatar = replace(full_avatar(), clips=full_avatar().clips[:1])
    made = search_poses(avatar), claim_poses(avatar)
    found = [{n.name for n in poses if n.kind == "clips"} for poses in made]
    assert found[0] and found[1] and not found[0] & found[1]


@pytest.mark.parametrize("mild", [False, True])
def test_a_judge_finds_what_is_claimed(mild: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And would not, if claims came from mild poses and from no allowance: the judge is as strict as it has to be."""
    monkeypatch.setattr(packing, "SIZE", SIZE)
    avatar = full_avatar()
    made = packing.make_pack(avatar, tmp_path / "x.avatar", packing.Choices(min_psnr=45.0, preview=False))
    claim = made.measured[0]
    if mild:
        claim = replace(claim, inside=claim.inside[[kind == "joints" for kind in claim.kinds]], allowance=0.0)
        claim = replace(claim, kinds=("joints",) * len(claim.inside))
    found = judged(avatar, load(tmp_path / "x.avatar"), count=40, size=SIZE)
    assert found.keeps(claim.mean, claim.worst) != mild, (found, claim.mean, claim.worst)
