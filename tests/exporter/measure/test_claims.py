"""What a pack claims holds in other poses, and covers all that can be asked of an avatar."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avatar_export.measure.claims import claim_poses, search_poses
from avatar_export.measure.poses import NamedPose
from avatar_export.packing import make
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from tests.avatars import full_avatar, surface_avatar
from tests.exporter.measure.test_poses import without_expressions
from tests.oracles.pack_claims import judged

SIZE = 96


def two_sided() -> Avatar:
    """The small avatar with ranges below 0 as well."""
    avatar = full_avatar()
    ranges = tuple(replace(e, range=(-0.5, e.range[1])) for e in avatar.expressions)
    return replace(avatar, expressions=ranges)


def weights(found: list[NamedPose]) -> set[tuple[str, float]]:
    """Expressions and their weights in the poses of kind `ends`."""
    ends = [named.pose.expressions for named in found if named.kind == "ends"]
    return {(name, weight) for one in ends for name, weight in one.items()}


def test_every_expression_is_seen_at_both_ends_of_its_range() -> None:
    avatar = two_sided()
    wanted = {(e.name, end) for e in avatar.expressions for end in e.range if end}
    for draw in (0, 1):
        assert weights(claim_poses(avatar, draw)) == wanted


def test_kinds_and_ranges() -> None:
    avatar = two_sided()
    found = claim_poses(avatar)
    assert list(dict.fromkeys(named.kind for named in found)) == ["ends", "mixtures", "joints", "clips"]
    for named in found:
        for e in avatar.expressions if named.kind != "clips" else ():
            assert e.range[0] <= named.pose.expressions.get(e.name, 0.0) <= e.range[1]
        assert np.array_equal(named.pose.world_from_avatar, np.eye(4))
    mixtures = [named.pose for named in found if named.kind == "mixtures"]
    assert all(len(pose.expressions) >= min(4, len(avatar.expressions)) for pose in mixtures)
    assert any(pose.joints for pose in mixtures) and all(pose.eyelids for pose in mixtures)


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
    avatar = full_avatar()
    avatar = replace(avatar, clips=avatar.clips[:1])
    found = [
        {n.name for n in made if n.kind == "clips"} for made in (search_poses(avatar), claim_poses(avatar))
    ]
    assert found[0] and found[1] and not found[0] & found[1]


def test_an_avatar_that_cannot_move_has_one_pose() -> None:
    still = replace(without_expressions(surface_avatar()), clips=(), rig=None)
    assert [named.name for named in claim_poses(still)] == ["rest"]


@pytest.mark.parametrize("mild", [False, True])
def test_a_judge_finds_what_is_claimed(mild: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """And would not, if claims came from mild poses and from no allowance: the judge is as strict as it has to be."""
    monkeypatch.setattr(make, "SIZE", SIZE)
    avatar = full_avatar()
    made = make.make_pack(avatar, tmp_path / "x.avatar", make.Choices(min_psnr=45.0, preview=False))
    claim = made.measured[0]
    if mild:
        claim = replace(claim, inside=claim.inside[[kind == "joints" for kind in claim.kinds]], allowance=0.0)
        claim = replace(claim, kinds=("joints",) * len(claim.inside))
    found = judged(avatar, load(tmp_path / "x.avatar"), count=40, size=SIZE)
    assert found.keeps(claim.mean, claim.worst) != mild, (found, claim.mean, claim.worst)
