"""A coarser level of an avatar: fewer Gaussians that look like it wherever it is played."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from avatar_export.images import robust_box
from avatar_export.levels.clusters import Features, clusters
from avatar_export.levels.compositing import contribution, error_shares
from avatar_export.levels.fit import fitted
from avatar_export.levels.merge import merged, merging
from avatar_export.levels.mixing import unit
from avatar_export.levels.views import (
    LEVEL_POSES,
    SIZE,
    View,
    expressions_alone,
    fitting_poses,
    flattened,
    views,
)
from avatar_runtime.avatar import F64, I64, Avatar
from avatar_runtime.player import Player
from avatar_runtime.rotation import matrix_from_quat
from avatar_schema import constants

SUMMED_VIEWS, SUMMED_STRIDE = 16, 2
RANKING_VIEWS = 36
RANKING_STRIDE = 3  # pixels
UNSEEN = 0.00125  # pixels that a Gaussian contributes at most to a ranking view, below which it is dropped
FEATURE_POSES = 24
GRAIN_PIXELS = 0.5  # standard deviation at SIZE pixels below which shapes look alike

STEPS = 264  # of the fit
# A trial level shows where Gaussians are lacking (irises, teeth, lids): a pixel there counts by the trial's error.
TRIAL_STEPS = 48
DAMPING = 0.4  # the power of a Gaussian's error against the mean error
NEED = (0.25, 8.0)  # the limits of that factor
BLACK = (0.0, 0.0, 0.0)
# Of the avatar's size: a Gaussian that becomes larger in a pose stays alone, it is seen everywhere.
LARGE = 0.03
MOST_ALONE = 50  # one in so many Gaussians at most
TINY = 1e-12


def coarser(avatar: Avatar, keep: float, steps: int = STEPS) -> Avatar:
    """`avatar` with about `keep` times its Gaussians, 0 < keep <= 1; everything else plays as before.

    Gaussians that contribute nothing are dropped, neighbours alike are merged, and colours, opacities, scales and
    rotations are fitted to images of `avatar` in `steps` steps. That is done twice: a short trial shows where fewer
    Gaussians would be seen, and the second time fewer are merged there, and more elsewhere. Rig, expressions, driving,
    clips, rules and the names and order of groups stay; no group becomes empty. The same avatar gives the same bytes on
    the same machine. Raises ValueError for another `keep`.
    """
    if not 0 < keep <= 1:
        raise ValueError(f"keep is {keep}; must be above 0 and at most 1")
    count = max(len(avatar.groups), round(keep * avatar.gaussians.count))
    if count >= avatar.gaussians.count:
        return avatar
    mass = largest_contribution(avatar)
    kept = _kept(avatar, mass, count)
    weight = np.maximum(mass[kept], UNSEEN)
    size = float(np.ptp(np.stack(robust_box(avatar.gaussians.mean)), axis=0).max())
    features, grain = _features(avatar, kept, weight, size), GRAIN_PIXELS * size / SIZE

    def level_of(features: Features) -> tuple[Avatar, I64]:
        label = clusters(features, count, grain)
        return merged(avatar, merging(label, kept, weight, avatar.gaussians.count)), label

    trial, label = level_of(features)
    wrong = largest_error(avatar, fitted(avatar, trial, min(steps, TRIAL_STEPS)))
    need = np.clip((wrong / max(float(wrong.mean()), TINY)) ** DAMPING, *NEED)
    level, _ = level_of(replace(features, mass=features.mass * need[label]))
    return fitted(avatar, level, steps)


def largest_error(avatar: Avatar, level: Avatar) -> F64:
    """[N of `level`] the squared error against `avatar` under each Gaussian, in the view of many that shows most."""
    truth, player, size = Player(avatar), Player(level), SIZE // RANKING_STRIDE
    most = np.zeros(level.gaussians.count)
    for view in views(avatar, RANKING_VIEWS, poses_count=LEVEL_POSES):
        image = truth.frame(view.pose, view.camera, BLACK).image
        flat = flattened(level, player.animate(view.pose), view.camera, RANKING_STRIDE)
        seen = slice(0, size * RANKING_STRIDE, RANKING_STRIDE)
        found = error_shares(flat, image.colour[seen, seen], image.transmittance[seen, seen])
        most[flat.row] = np.maximum(most[flat.row], found)
    return most


def measured_contribution(avatar: Avatar) -> F64:
    """[N] pixels that each Gaussian contributes over a few views: transmittance times alpha, summed."""
    total = np.zeros(avatar.gaussians.count)
    for row, pixels in _contributions(avatar, views(avatar, SUMMED_VIEWS), SUMMED_STRIDE):
        total[row] += pixels
    return total


def largest_contribution(avatar: Avatar) -> F64:
    """[N] the same in the one view of many that shows most of each Gaussian.

    Levels go by it: teeth and closed eyelids are seen in few views, and look as bad there as anything.
    """
    most = np.zeros(avatar.gaussians.count)
    seen = views(avatar, RANKING_VIEWS, poses_count=LEVEL_POSES)
    for row, pixels in _contributions(avatar, seen, RANKING_STRIDE):
        most[row] = np.maximum(most[row], pixels)
    return most


def _contributions(avatar: Avatar, seen: list[View], stride: int) -> Iterator[tuple[I64, F64]]:
    """Of each view the ids that are drawn, and the pixels that each contributes; every `stride`-th is looked at."""
    player, size = Player(avatar), SIZE // stride
    for view in seen:
        flat = flattened(avatar, player.animate(view.pose), view.camera, stride)
        yield flat.row, contribution(flat, size, size) * stride**2


def _kept(avatar: Avatar, mass: F64, count: int) -> I64:
    """Ids that are seen, the most seen of each group, and as many more as `count` asks for."""
    seen = mass > UNSEEN
    for group in avatar.groups:
        seen[group.first + int(np.argmax(mass[group.first : group.first + group.count]))] = True
    if np.count_nonzero(seen) < count:
        seen[np.argsort(-mass, kind="stable")[:count]] = True
    return np.flatnonzero(seen)


def _features(avatar: Avatar, kept: I64, mass: F64, size: float) -> Features:
    """What `clusters` compares, of the Gaussians `kept` with the contribution `mass` in an avatar of this `size`."""
    g, player = avatar.gaussians, Player(avatar)
    axes = matrix_from_quat(unit(g.quat_wxyz[kept]))
    variance = np.exp(2 * g.log_scale[kept].astype(np.float64))
    poses = fitting_poses(avatar, LEVEL_POSES)
    posed = [player.animate(pose) for pose in poses[:: max(1, len(poses) // FEATURE_POSES)]]
    scales = [s.scale[kept] for s in (*posed, *map(player.animate, expressions_alone(avatar)))]
    before = g.log_scale[kept].mean(axis=1)
    group = np.repeat(np.arange(len(avatar.groups)), [group.count for group in avatar.groups])[kept]
    largest = np.stack([scale.max(axis=1) for scale in scales]).max(axis=0)
    alone = np.flatnonzero(largest > LARGE * size)
    alone = alone[np.argsort(-largest[alone], kind="stable")][: len(kept) // MOST_ALONE]
    group[alone] = len(avatar.groups) + np.arange(len(alone))
    return Features(
        mass,
        g.mean[kept].astype(np.float64),
        np.einsum("nij,nj,nkj->nik", axes, variance, axes),
        np.clip(constants()["sh_c0"][0] * g.sh[kept, 0].astype(np.float64) + 0.5, 0, 1),
        np.stack([splats.mean[kept] for splats in posed]),
        np.stack([np.log(np.maximum(scale, TINY)).mean(axis=1) - before for scale in scales]),
        group,
    )
