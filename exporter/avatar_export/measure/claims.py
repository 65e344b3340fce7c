"""The poses that a pack's claim comes from, and those that the search before it judges by; no pose is in both."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from avatar_export.measure.poses import NamedPose, expression_ranges, joint_ranges, movable
from avatar_runtime.avatar import Avatar, Clip
from avatar_runtime.clips import frame_pose
from avatar_runtime.pose import IDENTITY, Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec

Number = Mapping[str, int]  # poses of each kind
CLAIM: Number = {"ends": 64, "mixtures": 14, "joints": 4, "clips": 8}  # of ends at most
CLAIM_STILL: Number = {"joints": 36, "clips": 20}  # of an avatar without expressions
SEARCH: Number = {"mixtures": 6, "clips": 1}
SEARCH_STILL: Number = {"joints": 6, "clips": 2}
STRONG = 0.5  # of the range: the least weight in a mixture
SHARE = 4  # a mixture takes one expression of so many
MIXED = 4  # but so many at least, where there are so many


def claim_poses(avatar: Avatar, draw: int = 0) -> list[NamedPose]:
    """What a claim comes from, the same every time; each `draw` (0, 1, ...) has other random poses.

    Kinds: `ends`, every expression at both ends of its range, in pairs (or more, of very many), and every eyelid;
    `mixtures` of a quarter of the expressions, each at half of its range or more, with eyelids, every other one with
    joints; `joints` anywhere in the ranges that they have in the clips (without clips: 12 degrees); `clips`, frames of
    a clip that the search does not see. An avatar that cannot move has one pose, `rest`.
    """
    numbers = CLAIM if _expressive(avatar) else CLAIM_STILL
    return _drawn(avatar, numbers, draw + 1, _frames(avatar, seen=False))


def search_poses(avatar: Avatar) -> list[NamedPose]:
    """Poses as hard as those of a claim, but others."""
    numbers = SEARCH if _expressive(avatar) else SEARCH_STILL
    return _drawn(avatar, numbers, 0, _frames(avatar, seen=True))


@dataclass(frozen=True)
class _Source:
    """What poses are drawn from."""

    avatar: Avatar
    ends: list[tuple[tuple[str, float], ...]]  # of each expression the ends of its range that are not 0
    frames: list[tuple[Clip, int]]
    rng: np.random.Generator

    def eyelids(self) -> dict[str, float]:
        """All eyelids, anywhere."""
        return {name: float(self.rng.random()) for name in self.avatar.eyelids}

    def joints(self) -> dict[str, npt.NDArray[np.float64]]:
        """All joints, anywhere in their ranges."""
        if self.avatar.rig is None:
            return {}
        low, high = joint_ranges(self.avatar)
        delta = homogeneous(matrix_from_rotvec(low + self.rng.random(low.shape) * (high - low)))
        return dict(zip(self.avatar.rig.joint_names, delta, strict=True))

    def shuffled(self) -> list[tuple[tuple[str, float], ...]]:
        """`ends` in another order."""
        return [self.ends[at] for at in self.rng.permutation(len(self.ends))]


def _drawn(avatar: Avatar, numbers: Number, seed: int, frames: list[tuple[Clip, int]]) -> list[NamedPose]:
    ranges = expression_ranges(avatar)
    ends = [
        tuple((avatar.expressions[at].name, float(end)) for end in ranges[at] if end)
        for at in movable(avatar)
    ]
    source = _Source(avatar, ends, frames, np.random.default_rng(seed))
    found = [pose for kind, number in numbers.items() for pose in DRAW[kind](source, number)]
    return found or [NamedPose("rest", Pose(), "rest")]


def _expressive(avatar: Avatar) -> bool:
    return len(movable(avatar)) > 0 or bool(avatar.eyelids)


def _ends(source: _Source, most: int) -> list[NamedPose]:
    ends = [end for expression in source.shuffled() for end in expression]
    count = min(max(-(-len(ends) // 2), 2), len(ends), most)  # two ends of an expression never share a pose
    found = [(ends[at::count], Pose(dict(ends[at::count]))) for at in range(count)]
    found += [([(name, 1.0)], Pose(eyelids={name: 1.0})) for name in source.avatar.eyelids]
    return [
        NamedPose(" and ".join(f"{name} at {weight:.3g}" for name, weight in weights), pose, "ends")
        for weights, pose in found
    ]


def _mixtures(source: _Source, count: int) -> list[NamedPose]:
    number = max(min(MIXED, len(source.ends)), len(source.ends) // SHARE)
    found = []
    for index in range(count):
        chosen = [ends[source.rng.integers(len(ends))] for ends in source.shuffled()[:number]]
        weights = {name: end * (STRONG + (1 - STRONG) * source.rng.random()) for name, end in chosen}
        pose = Pose(weights, source.joints() if index % 2 else {}, source.eyelids())
        found.append(NamedPose(f"mixture {index + 1}", pose, "mixtures"))
    return found


def _joints(source: _Source, count: int) -> list[NamedPose]:
    found = [source.joints() for _ in range(count)]
    return [
        NamedPose(f"joints {index + 1}", Pose(joints=joints), "joints")
        for index, joints in enumerate(found)
        if joints
    ]


def _frames(avatar: Avatar, *, seen: bool) -> list[tuple[Clip, int]]:
    """The frames that the search may see: of the longest clip, or of half of the only one; or all others."""
    if not avatar.clips:
        return []
    longest = max(avatar.clips, key=lambda clip: clip.frames)
    shown = longest.frames if len(avatar.clips) > 1 else longest.frames // 2
    return [
        (clip, frame)
        for clip in avatar.clips
        for frame in range(clip.frames)
        if (clip is longest and frame < shown) == seen
    ]


def _clips(source: _Source, count: int) -> list[NamedPose]:
    chosen = np.sort(source.rng.permutation(len(source.frames))[:count])
    return [
        NamedPose(
            f"clip {clip.name}, frame {frame}",
            replace(frame_pose(source.avatar, clip, frame), world_from_avatar=IDENTITY),
            "clips",
        )
        for clip, frame in (source.frames[at] for at in chosen)
    ]


DRAW: Mapping[str, Callable[[_Source, int], list[NamedPose]]] = {
    "ends": _ends,
    "mixtures": _mixtures,
    "joints": _joints,
    "clips": _clips,
}
