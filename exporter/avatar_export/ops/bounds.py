"""Boxes that a renderer may cull by: at rest, and swept over what a pose may do."""

from __future__ import annotations

from typing import Any

import numpy as np

from avatar_runtime.avatar import F32, F64, Avatar, Group, Rig, SparseRows
from avatar_runtime.rotation import matrix_from_quat
from avatar_runtime.stages.bind import rows_of
from avatar_runtime.stages.joints import rest_transforms
from avatar_runtime.stages.sparse import gather

JOINT_SWEEP = np.radians(30.0)  # the most that one joint turns, about any axis
CHORD = 2 * np.sin(
    JOINT_SWEEP / 2
)  # how far that moves a point at unit distance; bounds |R - I| entrywise too
SIGMAS = 3.0


def bounds(avatar: Avatar) -> dict[str, Any]:
    """{"rest", "swept"}: {"min", "max"} in mesh space, metres, three standard deviations included.

    Swept holds every pose with all expressions in their ranges and all eyelids in 0..1, in any combination,
    and one joint that carries Gaussians turned by at most 30 degrees: interval arithmetic, then chords of
    rotations, so it is generous. Only growth is counted for one expression at a time: all of them at once
    would add up in the exponent. For `anchor` groups the fit is bounded by the anchors' own motion.
    """
    with np.errstate(over="ignore"):  # absurd scales become infinite, which `_box` limits
        return _bounds(avatar)


def _bounds(avatar: Avatar) -> dict[str, Any]:
    g = avatar.gaussians
    reach = _reach(g.log_scale, g.quat_wxyz)
    rest = _box(g.mean - reach, g.mean + reach)
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
    swept = _box(centre - (half + radius)[:, None], centre + (half + radius)[:, None])
    return {"rest": rest, "swept": swept}


def _reach(log_scale: F32, quat_wxyz: F32) -> F64:
    """Half-size of each Gaussian's axis-aligned box at `SIGMAS` standard deviations, [N, 3]."""
    unit = quat_wxyz / np.maximum(np.linalg.norm(quat_wxyz, axis=1, keepdims=True), 1e-12)
    axes = matrix_from_quat(unit) * np.exp(log_scale)[:, None, :]
    result: F64 = SIGMAS * np.sqrt(np.sum(axes.astype(np.float64) ** 2, axis=2))
    return result


def _displacement(avatar: Avatar) -> tuple[F64, F64]:
    """[N, 3] least and largest displacement that expressions and eyelids give."""
    b = avatar.blendshapes
    low, high = _interval(b.geometry, "mean", _ranges(avatar))
    eyelids = np.tile([0.0, 1.0], (b.late_morphs.columns, 1))
    late_low, late_high = _interval(b.late_morphs, "mean", eyelids)
    return low + late_low, high + late_high


def _largest_growth(avatar: Avatar) -> F64:
    """[N] most that one expression can add to the largest log scale."""
    appearance = avatar.blendshapes.appearance
    delta = appearance.values["log_scale"].astype(np.float64)
    at = _ranges(avatar)[appearance.column]
    growth = np.maximum(delta * at[:, :1], delta * at[:, 1:]).max(axis=1, initial=0)
    most = np.zeros(appearance.rows)
    ptr = appearance.row_ptr.astype(np.int64)
    row = np.repeat(np.arange(appearance.rows), ptr[1:] - ptr[:-1])
    np.maximum.at(most, row, growth)
    return most


def _turned(avatar: Avatar, rig: Rig, group: Group, centre: F64, half: F64) -> F64:
    """[count] how far one joint's turn can carry each Gaussian of a group from where it is."""
    correctives = rows_of(avatar.blendshapes.correctives, group.first, group.count)
    most = np.zeros(group.count)
    corrected: F64 = (
        CHORD * _row_sums(correctives, np.linalg.norm(correctives.values["mean"], axis=1)[:, None])[:, 0]
    )
    if group.binding == "none":
        return corrected
    pivots = rest_transforms(rig)[:, :3, 3]
    wander = np.einsum("k,kjx->jx", np.abs(_ranges(avatar)).max(axis=1), np.abs(rig.joint_basis))
    for joint in _carriers(avatar, rig):
        share = _share(avatar, rig, group, _below(rig, joint))
        arm = np.linalg.norm(centre - pivots[joint], axis=1) + half + np.linalg.norm(wander[joint])
        most = np.maximum(most, share * CHORD * arm)
    if group.binding == "anchor":
        most += _anchor_slack(avatar, rig, centre)
    most += corrected
    return most


def _anchor_slack(avatar: Avatar, rig: Rig, centre: F64) -> F64:
    """[count] how far the fit carries a Gaussian when the anchors themselves deform."""
    morphs = rig.morphs
    low, high = _interval(morphs, "position", _ranges(avatar))
    correctives = np.linalg.norm(rig.correctives.values["position"], axis=1)[:, None]
    moved = (
        np.linalg.norm(np.maximum(-low, high), axis=1) + CHORD * _row_sums(rig.correctives, correctives)[:, 0]
    )
    anchors = rig.vertices[rig.anchor_vertices].astype(np.float64)
    middle = anchors.mean(axis=0)
    spread = np.sqrt(((anchors - middle) ** 2).sum(axis=1).mean())
    lever = np.linalg.norm(centre - middle, axis=1) / max(spread, 1e-9)
    result: F64 = moved[rig.anchor_vertices].max(initial=0) * (1 + 2 * lever)
    return result


def _carriers(avatar: Avatar, rig: Rig) -> list[int]:
    """Joints that carry Gaussians: by skin weights, by a mix, or through the anchors."""
    used = set(avatar.skin.column.tolist())
    for group in avatar.groups:
        used |= {rig.joint_names.index(name) for name in group.joint_mix}
        if group.binding == "anchor":
            used |= set(rig.skin.column.tolist())
    return sorted(used)


def _share(avatar: Avatar, rig: Rig, group: Group, below: F32) -> F64:
    """[count] or [1]: the part of each Gaussian's weight that lies on joints of the [J] mask."""
    if group.binding == "skin":
        weights = gather(rows_of(avatar.skin, group.first, group.count), below[:, None])
        return weights[:, 0].astype(np.float64)
    if group.binding == "joint_mix":
        return np.array([sum(f * below[rig.joint_names.index(name)] for name, f in group.joint_mix.items())])
    most: F64 = gather(rig.skin, below[:, None])[rig.anchor_vertices].max(axis=0).astype(np.float64)
    return most


def _below(rig: Rig, joint: int) -> F32:
    """[J] 1 for a joint and its descendants."""
    mask = np.zeros(rig.joint_count, np.float32)
    mask[joint] = 1
    for child, parent in enumerate(rig.parents):
        if parent >= 0 and mask[parent]:
            mask[child] = 1
    return mask


def _ranges(avatar: Avatar) -> F64:
    return np.array([e.range for e in avatar.expressions], np.float64).reshape(-1, 2)


def _interval(sparse: SparseRows, attribute: str, ranges: F64) -> tuple[F64, F64]:
    """[R, ...] least and largest weighted sum with every column's weight in its range, 0 included."""
    at = np.concatenate([np.minimum(ranges[:, :1], 0), np.maximum(ranges[:, 1:], 0)], axis=1)[sparse.column]
    a, b = sparse.values[attribute] * at[:, :1], sparse.values[attribute] * at[:, 1:]
    return _row_sums(sparse, np.minimum(a, b)), _row_sums(sparse, np.maximum(a, b))


def _row_sums(sparse: SparseRows, values: F64) -> F64:
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0, dtype=np.float64)])
    result: F64 = sums[sparse.row_ptr[1:]] - sums[sparse.row_ptr[:-1]]
    return result


def _box(low: F64, high: F64) -> dict[str, list[float]]:
    """Corners as float32 numbers; a box beyond float32 ends at its limits, since JSON knows no infinity."""
    limit = np.finfo(np.float32).max
    corners = np.clip([low.min(axis=0), high.max(axis=0)], -limit, limit).astype(np.float32)
    return {"min": corners[0].tolist(), "max": corners[1].tolist()}
