"""Boxes for culling: at rest, and swept over all poses."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from avatar_runtime.avatar import F32, F64, Avatar, Embedding, Group, Rig, SparseRows
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.rotation import matrix_from_quat
from avatar_runtime.stages.bind import rows_of
from avatar_runtime.stages.joints import rest_transforms
from avatar_runtime.stages.sparse import gather

JOINT_SWEEP = np.radians(30.0)  # largest rotation of one joint, about any axis
# How far JOINT_SWEEP moves a point at unit distance; also bounds the entries of |R - I|.
CHORD = 2 * np.sin(JOINT_SWEEP / 2)
SIGMAS = 3.0
STRETCH = 2.0
CLIP_FRAMES = 24  # sampled from all clips together


def bounds(avatar: Avatar) -> dict[str, Any]:
    """{"rest", "swept"}: {"min", "max"} in mesh space, metres, three standard deviations included.

    `swept` contains every pose with all expressions in their ranges and all eyelids in 0..1, in any combination,
    and one joint with Gaussians rotated by at most 30 degrees. It uses interval arithmetic, then chords of rotations,
    so it is larger than needed. Growth of scales is counted for one expression at a time, since all of them together
    would add up in the exponent. For `anchor` groups the motion of the anchors bounds the fit. It also contains
    `CLIP_FRAMES` frames of the avatar's clips. For Gaussians on a surface without a rig the motion is unknown, so
    `swept` is the box at rest.
    """
    with np.errstate(over="ignore"):  # an overflow becomes infinite, which `box` limits
        return _bounds(avatar)


def bounds_of_levels(levels: Sequence[Avatar]) -> dict[str, Any]:
    """`bounds` of the finest of `levels`, with a `swept` that holds the others too: merged Gaussians reach farther."""
    boxes = [bounds(level) for level in levels]
    low = np.min([one["swept"]["min"] for one in boxes], axis=0)
    high = np.max([one["swept"]["max"] for one in boxes], axis=0)
    return {**boxes[0], "swept": {"min": low.tolist(), "max": high.tolist()}}


def _bounds(avatar: Avatar) -> dict[str, Any]:
    g = avatar.gaussians
    extent = reach(np.exp(g.log_scale), g.quat_wxyz)
    rest = box(g.mean - extent, g.mean + extent)
    low, high = _swept(avatar)
    for mean, around in _clip_frames(avatar):
        low, high = np.fmin(low, mean - around), np.fmax(high, mean + around)  # NaN is not drawn
    # The rig's rest may differ from the canonical mesh, and the sums above round.
    low, high = np.fmin(low, g.mean - extent), np.fmax(high, g.mean + extent)
    return {"rest": rest, "swept": box(low, high)}


def _swept(avatar: Avatar) -> tuple[F64, F64]:
    """[N, 3] corners of each Gaussian's box over all expressions and joint turns."""
    g = avatar.gaussians
    if avatar.embedding is not None:
        return swept_surface(avatar, avatar.embedding)
    low, high = _displacement(avatar)
    half = np.linalg.norm(high - low, axis=1) / 2
    centre = g.mean + (low + high) / 2
    radius = SIGMAS * np.exp(g.log_scale.max(axis=1) + _largest_growth(avatar))
    if avatar.rig is not None:
        turned = np.zeros(g.count)
        for group in avatar.groups:
            rows = slice(group.first, group.first + group.count)
            turned[rows] = _turned(avatar, avatar.rig, group, centre[rows], half[rows])
        half = half + turned
    return centre - (half + radius)[:, None], centre + (half + radius)[:, None]


def swept_surface(avatar: Avatar, embedding: Embedding) -> tuple[F64, F64]:
    """[N, 3] corners for Gaussians on a mesh, from the balls of their triangle's vertices, their height and their size.

    Stretching of triangles is not followed: heights in triangle sizes, and scales, count `STRETCH` times.
    """
    size = SIGMAS * np.exp(avatar.gaussians.log_scale.max(axis=1).astype(np.float64))
    if avatar.rig is None:
        mean = avatar.gaussians.mean.astype(np.float64)
        return mean - size[:, None], mean + size[:, None]
    centre, radius = _vertex_balls(avatar, avatar.rig)
    foot = np.einsum("nc,ncx->nx", embedding.barycentric, centre[embedding.vertex_ids])
    at_rest = np.einsum(
        "nc,ncx->nx", embedding.barycentric, embedding.canonical_vertices[embedding.vertex_ids]
    )
    height = np.linalg.norm(avatar.gaussians.mean - at_rest, axis=1)
    extent = (radius[embedding.vertex_ids].max(axis=1) + STRETCH * (height + size))[:, None]
    return foot - extent, foot + extent


def _vertex_balls(avatar: Avatar, rig: Rig) -> tuple[F64, F64]:
    """([V, 3] centres, [V] radii) of balls that contain the mesh's vertices in every pose."""
    low, high = interval(rig.morphs, "position", ranges(avatar))
    late = interval(rig.late_morphs, "position", np.tile([0.0, 1.0], (rig.late_morphs.columns, 1)))
    low, high = low + late[0], high + late[1]
    half, centre = np.linalg.norm(high - low, axis=1) / 2, rig.vertices + (low + high) / 2
    pivots = rest_transforms(rig)[:, :3, 3]
    wander = np.einsum("k,kjx->jx", np.abs(ranges(avatar)).max(axis=1, initial=0), np.abs(rig.joint_basis))
    most = np.zeros(len(centre))
    for joint in sorted(set(rig.skin.column.tolist())):
        share = gather(rig.skin, below(rig, joint)[:, None])[:, 0]
        arm = np.linalg.norm(centre - pivots[joint], axis=1) + half + np.linalg.norm(wander[joint])
        most = np.maximum(most, share * CHORD * arm)
    corrected = np.linalg.norm(rig.correctives.values["position"], axis=1)[:, None]
    return centre, half + most + CHORD * row_sums(rig.correctives, corrected)[:, 0]


def _clip_frames(avatar: Avatar) -> Iterator[tuple[F64, F64]]:
    """([N, 3] means, [N, 3] half-sizes) at frames sampled from the avatar's clips, without world_from_avatar."""
    frames = [(clip, frame) for clip in avatar.clips for frame in range(clip.frames)]
    player = Player(avatar, "reference")
    for index in np.unique(np.linspace(0, len(frames) - 1, min(len(frames), CLIP_FRAMES)).astype(int)):
        clip, frame = frames[index]
        splats = player.animate(replace(frame_pose(avatar, clip, frame), world_from_avatar=np.eye(4)))
        yield splats.mean.astype(np.float64), reach(splats.scale, splats.quat_wxyz)


def reach(scale: F32, quat_wxyz: F32) -> F64:
    """Half-size of each Gaussian's axis-aligned box at `SIGMAS` standard deviations, [N, 3]."""
    unit = quat_wxyz / np.maximum(np.linalg.norm(quat_wxyz, axis=1, keepdims=True), 1e-12)
    axes = matrix_from_quat(unit) * scale[:, None, :]
    result: F64 = SIGMAS * np.sqrt(np.sum(axes.astype(np.float64) ** 2, axis=2))
    return result


def _displacement(avatar: Avatar) -> tuple[F64, F64]:
    """[N, 3] smallest and largest displacement by expressions and eyelids."""
    b = avatar.blendshapes
    low, high = interval(b.geometry, "mean", ranges(avatar))
    eyelids = np.tile([0.0, 1.0], (b.late_morphs.columns, 1))
    late_low, late_high = interval(b.late_morphs, "mean", eyelids)
    return low + late_low, high + late_high


def _largest_growth(avatar: Avatar) -> F64:
    """[N] largest increase of the largest log scale by one expression."""
    appearance = avatar.blendshapes.appearance
    delta = appearance.values["log_scale"].astype(np.float64)
    at = ranges(avatar)[appearance.column]
    growth = np.maximum(delta * at[:, :1], delta * at[:, 1:]).max(axis=1, initial=0)
    most = np.zeros(appearance.rows)
    ptr = appearance.row_ptr.astype(np.int64)
    row = np.repeat(np.arange(appearance.rows), ptr[1:] - ptr[:-1])
    np.maximum.at(most, row, growth)
    return most


def _turned(avatar: Avatar, rig: Rig, group: Group, centre: F64, half: F64) -> F64:
    """[count] largest distance by which the rotation of one joint moves each Gaussian of a group."""
    correctives = rows_of(avatar.blendshapes.correctives, group.first, group.count)
    most = np.zeros(group.count)
    corrected: F64 = (
        CHORD * row_sums(correctives, np.linalg.norm(correctives.values["mean"], axis=1)[:, None])[:, 0]
    )
    if group.binding == "none":
        return corrected
    pivots = rest_transforms(rig)[:, :3, 3]
    wander = np.einsum("k,kjx->jx", np.abs(ranges(avatar)).max(axis=1), np.abs(rig.joint_basis))
    for joint in _moving_joints(avatar, rig):
        part = share(avatar, rig, group, below(rig, joint))
        arm = np.linalg.norm(centre - pivots[joint], axis=1) + half + np.linalg.norm(wander[joint])
        most = np.maximum(most, part * CHORD * arm)
    if group.binding == "anchor":
        most += _anchor_slack(avatar, rig, centre)
    most += corrected
    return most


def _anchor_slack(avatar: Avatar, rig: Rig, centre: F64) -> F64:
    """[count] largest distance by which the fit moves a Gaussian when the anchors deform."""
    morphs = rig.morphs
    low, high = interval(morphs, "position", ranges(avatar))
    correctives = np.linalg.norm(rig.correctives.values["position"], axis=1)[:, None]
    moved = (
        np.linalg.norm(np.maximum(-low, high), axis=1) + CHORD * row_sums(rig.correctives, correctives)[:, 0]
    )
    anchors = rig.vertices[rig.anchor_vertices].astype(np.float64)
    middle = anchors.mean(axis=0)
    spread = np.sqrt(((anchors - middle) ** 2).sum(axis=1).mean())
    lever = np.linalg.norm(centre - middle, axis=1) / max(spread, 1e-9)
    result: F64 = moved[rig.anchor_vertices].max(initial=0) * (1 + 2 * lever)
    return result


def _moving_joints(avatar: Avatar, rig: Rig) -> list[int]:
    """Joints that move Gaussians: by skin weights, by a mix, or through the anchors."""
    used = set(avatar.skin.column.tolist())
    for group in avatar.groups:
        used |= {rig.joint_names.index(name) for name in group.joint_mix}
        if group.binding == "anchor":
            used |= set(rig.skin.column.tolist())
    return sorted(used)


def share(avatar: Avatar, rig: Rig, group: Group, mask: F32) -> F64:
    """[count] or [1]: the fraction of each Gaussian's weight on joints of the [J] mask; not for binding `none`."""
    if group.binding == "skin":
        weights = gather(rows_of(avatar.skin, group.first, group.count), mask[:, None])
        return weights[:, 0].astype(np.float64)
    if group.binding == "joint_mix":
        return np.array([sum(f * mask[rig.joint_names.index(name)] for name, f in group.joint_mix.items())])
    most: F64 = gather(rig.skin, mask[:, None])[rig.anchor_vertices].max(axis=0).astype(np.float64)
    return most


def below(rig: Rig, joint: int) -> F32:
    """[J] 1 for a joint and its descendants."""
    mask = np.zeros(rig.joint_count, np.float32)
    mask[joint] = 1
    for child, parent in enumerate(rig.parents):
        if parent >= 0 and mask[parent]:
            mask[child] = 1
    return mask


def ranges(avatar: Avatar) -> F64:
    """[K, 2] the range of every expression."""
    return np.array([e.range for e in avatar.expressions], np.float64).reshape(-1, 2)


def interval(sparse: SparseRows, attribute: str, ranges: F64) -> tuple[F64, F64]:
    """[R, ...] smallest and largest weighted sum with every column's weight in its range, which includes 0."""
    at = np.concatenate([np.minimum(ranges[:, :1], 0), np.maximum(ranges[:, 1:], 0)], axis=1)[sparse.column]
    a, b = sparse.values[attribute] * at[:, :1], sparse.values[attribute] * at[:, 1:]
    return row_sums(sparse, np.minimum(a, b)), row_sums(sparse, np.maximum(a, b))


def row_sums(sparse: SparseRows, values: F32 | F64) -> F64:
    """[R, ...] sums of `values` [entries, ...] over the entries of each row."""
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0, dtype=np.float64)])
    result: F64 = sums[sparse.row_ptr[1:]] - sums[sparse.row_ptr[:-1]]
    return result


def box(low: F64, high: F64) -> dict[str, list[float]]:
    """{"min", "max"} as float32 numbers; a larger box ends at the limits of float32, since JSON has no infinity."""
    limit = np.finfo(np.float32).max
    corners = np.clip([low.min(axis=0), high.max(axis=0)], -limit, limit).astype(np.float32)
    return {"min": corners[0].tolist(), "max": corners[1].tolist()}
