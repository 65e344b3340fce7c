"""Values that are in another form than a checkpoint has them: scales, opacities, colours, rotations, clip weights."""

from __future__ import annotations

import numpy as np

from avatar_export.fit.judge import REFUSED
from avatar_export.fit.known import UNITS
from avatar_export.fit.sampled import FEWEST, Bools, Floats, between, neighbours, spread_rows
from avatar_export.notes.note import Note, doubt, fact
from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.driving.arkit import canonical
from avatar_runtime.stages.surface import triangle_shape
from avatar_schema import constants

SOME = 0.02  # of the Gaussians; fewer may be floaters
WIDE = np.log(1 / 3)  # ln of a standard deviation over the size of the avatar
MOST_UNITS = 20  # of the training in the avatar's size, if logarithms of scales must be negative
WIDE_ON_TRIANGLES = np.log(2)  # where scales are multiples of a triangle's size
EXPONENTS = (0.0, 1.5)  # training units; exp of the logarithm of a scale up to ln 1.5
EDGE = 0.04  # how near a limit of 0..1 values are counted
EDGE_TIMES = 5.0  # more inside than outside
BRIGHT = 8.0  # of a DC; 1.77 is white
BYTES = (16.0, 256.0)  # the largest of colours 0..255
LIKE_RGB = 0.3  # of neighbours, that differ as a colour and its DC do
APART = 0.25  # of two DCs; nearer ones say nothing
INVISIBLE = float(np.log(1 / 254))  # logit of 1/255
PRUNED = (4.0, 5.8)  # logits, negated, below which trainings prune: 0.018 and 0.003
LONGER, FAR_LONGER = 1.5, 3.0  # how much farther the lower tail reaches if the sign is wrong
ROUGHER = 1.2  # the colours of the opaque Gaussians than those of the transparent ones, if the sign is wrong
UNSEEN, SEEN = -5.8, 3.0  # logits of Gaussians that are not drawn, and of opaque ones
SMOOTHER = 0.45  # the colours of those that are not drawn, if they are opaque ones of the wrong sign
NO_ROTATIONS = 0.005
PERCENT = 5.0  # weights of expressions that go to 1
FAR = 0.5  # of the avatar's size, that no expression moves anything


def size_of(avatar: Avatar) -> float:
    """The diagonal of the box of nearly all Gaussians, or of the mesh that carries them, metres."""
    places: Floats = avatar.gaussians.mean
    if avatar.embedding is not None:
        places = avatar.embedding.canonical_vertices
    low, high = np.quantile(places[spread_rows(len(places), 20_000)], (0.005, 0.995), axis=0)
    return float(np.linalg.norm(high - low))


def scales(avatar: Avatar) -> list[Note]:
    """Scales that are no logarithms, or logarithms in another unit."""
    log, embedding, size = avatar.gaussians.log_scale, avatar.embedding, size_of(avatar)
    if len(log) < FEWEST or size <= 0:
        return []
    raw, limit = log + np.float32(np.log(avatar.training_per_bundle)), WIDE  # raw: as written
    if embedding is not None and avatar.rules.scale == "triangle_linear":
        shape = triangle_shape(embedding.canonical_vertices, embedding.triangles, avatar.rules)
        raw = log - np.log(np.maximum(shape.size, 1e-30)).astype(np.float32)[embedding.triangle, None]
        limit = WIDE_ON_TRIANGLES
    elif avatar.training_per_bundle * size > MOST_UNITS:
        raw = np.full_like(raw, -np.inf)  # a unit is as small as a Gaussian: its logarithm may be above 0
    most, positive = raw.max(axis=1), raw.min(axis=1) > 0
    wide = log.max(axis=1) > limit + np.log(size)
    if positive.mean() > 0.99 or _edge(raw.min(axis=1), 0, 1) > EDGE_TIMES:
        wide = positive if np.quantile(most[positive], 0.9) <= EXPONENTS[1] else wide
    share = float(wide.mean())
    if share > SOME:
        return [_judged("scales_wide", share, cause=_cause(most[wide], log[wide].max(axis=1), size))]
    return []


def _cause(raw: Floats, log: Floats, size: float) -> Note | None:
    """What would make scales usual: `raw` as written, `log` metres."""
    low, high = np.quantile(raw, (0.1, 0.9))
    if low >= EXPONENTS[0] and high <= EXPONENTS[1]:
        return fact("scales_are_lengths")
    usual = float(np.median(log)) - np.log(
        size * 0.01
    )  # the middle of what is usual, 0.1 % to 5 % of the size
    factor, unit = min(UNITS.items(), key=lambda one: abs(usual - np.log(one[0])))
    return fact("scales_unit", factor=factor, unit=unit) if abs(usual - np.log(factor)) < 2 else None


def _judged(kind: str, share: float, **values: object) -> Note:
    return Note(kind, {"share": share, **values}, "misfit" if share > REFUSED else "doubt")


def opacities(avatar: Avatar) -> list[Note]:
    """Opacities that are no logits, or have the other sign."""
    logit = avatar.gaussians.opacity_logit
    if len(logit) < FEWEST:
        return []
    within = float(between(logit, 0, 1))
    if within > 0.999 and (np.ptp(logit) > 0.3 or logit.min() > 0.9):
        return [_judged("opacities_not_logits", 1.0)]
    edges = max(_edge(logit, 1.0, -1), _edge(logit, 0.0, 1))
    if edges > EDGE_TIMES:
        return [_judged("opacities_not_logits", within)]
    if (logit < INVISIBLE).mean() > 0.9 and -np.median(logit) < 20:
        return [doubt("opacities_negated", share=1.0)]
    share = _negated(avatar)
    return [doubt("opacities_negated", share=share)] if share > 0 else []


def _edge(values: Floats, at: float, inside: int) -> float:
    """How many times more values lie within EDGE on the one side of `at` than on the other; 0 for too few."""
    off = (values - np.float32(at)) * inside
    near = values[(off >= 0) & (off < EDGE)]
    beyond = values[(off < 0) & (off >= -EDGE)]
    if len(near) < max(FEWEST / 2, 0.01 * len(values)):
        return 0.0
    return len(np.unique(near)) / (len(np.unique(beyond)) + 4)  # equal ones are no evidence: many start alike


def _negated(avatar: Avatar) -> float:
    """About which share of the opacities has the other sign; 0 for none.

    Trainings prune Gaussians below some opacity; the other end is free. And an opaque Gaussian has a colour like its
    neighbours', one that is hidden need not.
    """
    logit, largest = avatar.gaussians.opacity_logit, max(avatar.groups, key=lambda group: group.count)
    own = np.zeros(len(logit), bool)  # teeth are trained apart
    own[largest.first : largest.first + largest.count] = True
    low, high, few, many = np.quantile(logit[own], (0.002, 0.998, 0.3, 0.7))
    longer = -low - high
    opaque, clear = own & (logit >= many), own & (logit <= few)
    cut = PRUNED[0] <= high <= PRUNED[1] and longer >= LONGER
    rough = cut and _unlike(avatar, opaque, opaque) > ROUGHER * _unlike(avatar, clear, clear)
    if rough or (cut and longer >= FAR_LONGER):
        return 1.0
    unseen, seen = own & (logit < UNSEEN), own & (logit > SEEN)
    if unseen.sum() < max(FEWEST / 2, 0.004 * len(logit)) or seen.sum() < FEWEST:
        return 0.0
    between = _unlike(avatar, own & (logit > -SEEN) & (logit < 0), seen)
    if between > APART / 2 and _unlike(avatar, unseen, seen) < SMOOTHER * between:
        return float(unseen.sum() / (unseen.sum() + (own & (logit > -UNSEEN)).sum()))
    return 0.0


def _unlike(avatar: Avatar, chosen: Bools, among: Bools) -> float:
    """The median difference between the DC of the `chosen` Gaussians and of their neighbours `among` others."""
    rows, near = neighbours(avatar, np.flatnonzero(chosen), np.flatnonzero(among), 4)
    dc = avatar.gaussians.sh[:, 0].astype(np.float64)
    if not len(rows):
        return 0.0
    return float(np.median(np.abs(np.median(dc[near], axis=1) - dc[rows]).mean(axis=1)))


def colours(avatar: Avatar) -> list[Note]:
    """DC that are colours 0..255 or 0..1."""
    dc = avatar.gaussians.sh[:, 0]
    if len(dc) < FEWEST:
        return []
    bright = float((np.abs(dc) > BRIGHT).any(axis=1).mean())
    if bright > SOME:
        low, high = np.quantile(dc, (0.02, 0.98))
        are_bytes = low >= -3 and BYTES[0] < high < BYTES[1]
        return [_judged("colours_bright", bright, cause=fact("colours_are_bytes") if are_bytes else None)]
    if np.ptp(dc) <= 0.2:
        return []
    columns = [c for c in dc.T if between(c, 0, 1) > 0.999 and np.ptp(np.quantile(c, (0.01, 0.99))) > 0.2]
    share = 1.0 if between(dc, 0, 1) > 0.999 else max(_in_runs(dc), len(columns) / 3)
    if share > 0:
        return [_judged("colours_are_rgb", share)]
    share = _like_rgb(avatar)
    return [doubt("colours_are_rgb", share=share)] if share > 0 else []


def _in_runs(dc: Floats) -> float:
    """The share of the rows that lie in runs whose DC are all within 0..1."""
    runs = [run for run in np.array_split(dc, 16) if len(run) >= FEWEST]
    within = [len(run) for run in runs if between(run, 0, 1) > 0.999 and np.ptp(run) > 0.3]
    return sum(within) / max(len(dc), 1) if len(within) > 1 else 0.0


def _like_rgb(avatar: Avatar) -> float:
    """The share of neighbours of which one has the other's colour as its DC; 0 if it is small.

    Only opaque Gaussians are compared: their colours are smooth.
    """
    logit = avatar.gaussians.opacity_logit
    half = np.flatnonzero(logit >= np.median(logit))
    rows, near = neighbours(avatar, half, half, 4)
    if len(rows) < FEWEST:
        return 0.0
    dc = avatar.gaussians.sh[:, 0].astype(np.float64)
    one, other = np.repeat(dc[rows], near.shape[1], axis=0), dc[near.ravel()]
    same = np.linalg.norm(one - other, axis=1)
    turned = np.minimum(
        np.linalg.norm(one - _as_rgb(other), axis=1), np.linalg.norm(other - _as_rgb(one), axis=1)
    )
    told = (same > APART) & ((one >= 0).all(axis=1) | (other >= 0).all(axis=1))
    found = float((told & (turned < 0.3 * same)).mean())
    return found if found > LIKE_RGB else 0.0


def _as_rgb(dc: F64) -> F64:
    rgb: F64 = 0.5 + float(constants()["sh_c0"][0]) * dc
    return rgb


def rotations(avatar: Avatar) -> list[Note]:
    """Rotations that are zero."""
    quat = avatar.gaussians.quat_wxyz if avatar.embedding is None else avatar.embedding.local_quat_wxyz
    if len(quat) < FEWEST:
        return []
    share = float(1 - quat.any(axis=1).mean())
    return [_judged("rotations_zero", share)] if share > NO_ROTATIONS else []


def clips(avatar: Avatar) -> list[Note]:
    """Weights of clips that seem to be percent: far above the range of a named expression, or moving it too far."""
    bounded = np.array([canonical(one.name) is not None for one in avatar.expressions], bool)
    limits = np.where(bounded, PERCENT, _farthest(avatar))
    found = []
    for clip in avatar.clips:
        lids = np.abs(clip.late_weights).max(axis=0, initial=0) / PERCENT
        most = np.abs(clip.expression_weights).max(axis=0, initial=0)
        over = most / np.maximum(limits, 1e-30) if len(most) == len(limits) else np.zeros(1)
        names = (*avatar.expression_names, *avatar.eyelids)
        both = np.concatenate([over, lids])
        if len(both) == len(names) and both.max(initial=0) > 1:
            worst = int(both.argmax())
            value = float(np.concatenate([most, PERCENT * lids])[worst])
            found.append(
                Note("clip_percent", {"clip": clip.name, "name": names[worst], "most": value}, "doubt")
            )
    return found[:3]


def _farthest(avatar: Avatar) -> F64:
    """[K] the weight of each expression that moves a vertex or Gaussian by FAR of the size; infinite if none does."""
    moved: F64 = np.zeros(len(avatar.expressions))
    tables = [(avatar.blendshapes.geometry, "mean")]
    if avatar.rig is not None:
        tables.append((avatar.rig.morphs, "position"))
    for table, name in tables:
        far = np.abs(table.values[name]).max(axis=1, initial=0)
        np.maximum.at(moved, table.column.astype(np.int64), far)
    with np.errstate(divide="ignore"):
        limit: F64 = FAR * size_of(avatar) / moved
    return limit
