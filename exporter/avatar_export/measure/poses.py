"""The poses that an avatar is measured in; they follow from the avatar alone."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from itertools import cycle, islice

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F64, Avatar, SparseRows
from avatar_runtime.clips import frame_pose
from avatar_runtime.pose import IDENTITY, Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec, quat_from_matrix

COUNT = 8
# How the poses are shared out. What an avatar lacks is passed over.
PATTERN = ("clip", "expression", "clip", "mixture", "clip", "expression", "clip", "mixture")
STILL = ("clip", "joints", "clip", "clip", "joints")  # the same for an avatar without expressions
LARGEST_WEIGHT = 3.0  # ranges of expressions are clamped to +- this
MIXED = 4  # the fewest expressions of a mixture, where there are so many
SHARE = 4  # a mixture takes one expression of so many
TURN = np.radians(12.0)  # range of a joint in an avatar without clips, about each axis
GOLDEN = (np.sqrt(5) - 1) / 2  # its multiples modulo 1 are all different and evenly spaced


@dataclass(frozen=True)
class NamedPose:
    """A pose with a name for people, which is different from the names of the avatar's other poses."""

    name: str
    pose: Pose
    kind: str = ""


def poses(avatar: Avatar, count: int = COUNT) -> list[NamedPose]:
    """`count` poses from the avatar's own clips and ranges; always the same for the same avatar.

    Half of them are frames of its clips, evenly spread over all clips together. The others are strong single
    expressions and mixtures of expressions and eyelids, all within their ranges; for an avatar without them, joints
    within the ranges of its clips (without clips: 12 degrees). The avatar as a whole does not move
    (`world_from_avatar` of clips is left out). An avatar that cannot move has one pose, `rest`; only for an avatar
    whose single motion is a clip of fewer frames are there fewer than `count`. Raises ValueError for a count below 1.
    """
    if count < 1:
        raise ValueError(f"expected a count of at least 1, not {count}")
    frames = sum(clip.frames for clip in avatar.clips)
    expressions = len(movable(avatar))
    mixable = expressions > 0 or _has_eyelids(avatar)
    turnable = avatar.rig is not None and avatar.rig.joint_count > 0
    most = {
        "clip": frames,
        "expression": expressions,
        "mixture": count if mixable else 0,
        "joints": count if turnable and not mixable else 0,
    }
    shares = _shared_out(PATTERN if mixable else STILL, most, count)
    found = [made for kind, number in shares.items() for made in MAKERS[kind](avatar, number)]
    return found or [NamedPose("rest", Pose())]


def _shared_out(pattern: Iterable[str], most: dict[str, int], count: int) -> Counter[str]:
    """How many poses of each kind: as `pattern` repeats, at most `most` of each."""
    shares: Counter[str] = Counter()
    for kind in islice(cycle(pattern), 16 * count):
        if shares.total() < count and shares[kind] < most[kind]:
            shares[kind] += 1
    return shares


def movable(avatar: Avatar) -> npt.NDArray[np.int64]:
    """Columns of the expressions that change something, the one that moves most first."""
    ends = far_ends(avatar)
    strength = np.zeros(len(ends))
    b, rig = avatar.blendshapes, avatar.rig
    parts = [(b.geometry, "mean"), (b.geometry, "quat_wxyz")]
    parts += [(b.appearance, name) for name in ("log_scale", "opacity_logit", "sh")]
    parts += [(rig.morphs, "position")] if rig else []
    energies: list[F64] = [_energy(sparse, attribute) for sparse, attribute in parts]
    energies += [np.sum(rig.joint_basis.astype(np.float64) ** 2, axis=(1, 2))] if rig else []
    for energy in energies:
        moved = energy * ends**2
        strength += moved / max(moved.sum(), np.finfo(np.float64).tiny)
    order = np.argsort(-strength, kind="stable")
    return order[strength[order] > 0]


def _energy(sparse: SparseRows, attribute: str) -> F64:
    """[columns] sums of the squares of one attribute."""
    values = sparse.values[attribute].astype(np.float64)
    squares = np.sum(values**2, axis=tuple(range(1, values.ndim)))
    return np.bincount(sparse.column, squares, sparse.columns).astype(np.float64)


def _has_eyelids(avatar: Avatar) -> bool:
    rig = avatar.rig
    return avatar.blendshapes.late_morphs.entries > 0 or (rig is not None and rig.late_morphs.entries > 0)


def far_ends(avatar: Avatar) -> F64:
    """[K] the end of each expression's range that is farther from 0."""
    ranges = expression_ranges(avatar)
    return np.where(np.abs(ranges[:, 0]) > np.abs(ranges[:, 1]), ranges[:, 0], ranges[:, 1])


def expression_ranges(avatar: Avatar) -> F64:
    """[K, 2] the range of each expression, clamped to +-LARGEST_WEIGHT."""
    ranges = np.array([e.range for e in avatar.expressions], np.float64).reshape(-1, 2)
    return np.clip(ranges, -LARGEST_WEIGHT, LARGEST_WEIGHT)


def _frames(avatar: Avatar, count: int) -> list[NamedPose]:
    """Frames in the middle of `count` equal parts of all clips together."""
    frames = [(clip, frame) for clip in avatar.clips for frame in range(clip.frames)]
    chosen = ((np.arange(count) + 0.5) / max(count, 1) * len(frames)).astype(int)
    return [
        NamedPose(
            f"clip {clip.name}, frame {frame}",
            replace(frame_pose(avatar, clip, frame), world_from_avatar=IDENTITY),
        )
        for clip, frame in (frames[index] for index in chosen)
    ]


def _singles(avatar: Avatar, count: int) -> list[NamedPose]:
    """Single expressions at the far end of their range, evenly spread over the stronger half."""
    order, ends = movable(avatar), far_ends(avatar)
    half = max(count, -(-len(order) // 2))
    found = []
    for column in order[(np.arange(count) * half) // max(count, 1)]:
        name, weight = avatar.expressions[column].name, float(ends[column])
        found.append(NamedPose(f"expression {name} at {weight:g}", Pose({name: weight})))
    return found


def _mixtures(avatar: Avatar, count: int) -> list[NamedPose]:
    """Each a quarter of all expressions, and all eyelids, at different places of their ranges."""
    columns, ranges = np.sort(movable(avatar)), expression_ranges(avatar)
    taken = max(min(MIXED, len(columns)), len(columns) // SHARE)
    found = []
    for number in range(count):
        chosen = columns[np.argsort(spread(len(columns), number), kind="stable")[:taken]]
        at = spread(taken, 2 * number + 1)
        weights = ranges[chosen, 0] + at * (ranges[chosen, 1] - ranges[chosen, 0])
        names = [avatar.expressions[column].name for column in chosen]
        eyelids = dict(
            zip(
                avatar.eyelids,
                spread(len(avatar.eyelids), 2 * number).tolist(),
                strict=True,
            )
        )
        pose = Pose(dict(zip(names, weights.tolist(), strict=True)), eyelids=eyelids)
        found.append(NamedPose(f"mixture {number + 1}", pose))
    return found


def _turned(avatar: Avatar, count: int) -> list[NamedPose]:
    """All joints rotated within the ranges that they have in the clips."""
    rig = avatar.rig
    assert rig is not None
    low, high = joint_ranges(avatar)
    found = []
    for number in range(count):
        at = np.stack([spread(rig.joint_count, 3 * number + axis) for axis in range(3)], axis=1)
        delta = homogeneous(matrix_from_rotvec(low + at * (high - low)))
        found.append(
            NamedPose(f"joints {number + 1}", Pose(joints=dict(zip(rig.joint_names, delta, strict=True))))
        )
    return found


def joint_ranges(avatar: Avatar) -> tuple[F64, F64]:
    """([J, 3], [J, 3]) least and largest rotation vectors of the joints, radians."""
    assert avatar.rig is not None
    if not avatar.clips:
        end = np.full((avatar.rig.joint_count, 3), TURN)
        return -end, end
    delta = np.concatenate([clip.joint_delta for clip in avatar.clips]).astype(np.float64)
    vectors = _rotvec(delta[..., :3, :3])
    return vectors.min(axis=0), vectors.max(axis=0)


def _rotvec(matrix: F64) -> F64:
    """Rotation vectors [..., 3] of rotation matrices [..., 3, 3]: `matrix_from_rotvec` undone."""
    quat = quat_from_matrix(matrix)
    quat = quat * np.where(quat[..., :1] < 0, -1.0, 1.0)
    sine = np.linalg.norm(quat[..., 1:], axis=-1, keepdims=True)
    angle = 2 * np.arctan2(sine, quat[..., :1])
    result: F64 = quat[..., 1:] * np.where(sine > 1e-9, angle / np.maximum(sine, 1e-9), 2.0)
    return result


def spread(count: int, offset: int) -> F64:
    """`count` different numbers in 0..1, others for each `offset`."""
    result: F64 = ((np.arange(count) + 1) * GOLDEN + (offset + 1) * np.sqrt(2)) % 1
    return result


MAKERS: dict[str, Callable[[Avatar, int], list[NamedPose]]] = {
    "clip": _frames,
    "expression": _singles,
    "mixture": _mixtures,
    "joints": _turned,
}
