"""Merges clusters of Gaussians by moments, with everything that moves or colours them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from avatar_export.levels.clusters import merged_covariance, summed
from avatar_export.levels.embed import embedded
from avatar_export.levels.mixing import mixed_blendshapes, mixed_rows, unit
from avatar_export.ops.normals import bound_normals, with_normals
from avatar_runtime.avatar import F64, I64, Avatar, Embedding, Gaussians, Group
from avatar_runtime.rotation import matrix_from_quat, quat_from_matrix
from avatar_runtime.stages.surface import binding_pose

LEAST_SCALE = 1e-6  # of the largest axis: a merged Gaussian has a thickness
LARGEST_OPACITY = 0.99


@dataclass(frozen=True)
class Merging:
    """Which Gaussian goes where, and with what weight."""

    into: I64  # [N] cluster, -1: dropped
    share: F64  # [N] weight in the cluster; they add up to 1
    count: int


def merging(label: I64, kept: I64, mass: F64, total: int) -> Merging:
    """Of `kept` [n] ids with the clusters `label` [n], of `total` Gaussians; `mass` [n] is their weight."""
    count = int(label.max()) + 1
    into, share = np.full(total, -1), np.zeros(total)
    into[kept] = label
    share[kept] = mass / np.bincount(label, mass, count)[label]
    return Merging(into, share, count)


def merged(avatar: Avatar, by: Merging) -> Avatar:
    """The avatar of the clusters: mean, covariance, colour and deltas are weighted means, opacity times area a sum."""
    kept = by.into >= 0
    into, share, count, g = by.into[kept], by.share[kept], by.count, avatar.gaussians
    quat = unit(g.quat_wxyz[kept])
    axes = matrix_from_quat(quat)
    variance = np.exp(2 * g.log_scale[kept].astype(np.float64))
    source = np.einsum("nij,nj,nkj->nik", axes, variance, axes)
    mean = summed(share[:, None] * g.mean[kept], into, count)
    covariance = merged_covariance(share, g.mean[kept].astype(np.float64), source, mean, into)
    values, vectors = np.linalg.eigh(covariance)
    values = np.maximum(values, LEAST_SCALE**2 * values[:, -1:])
    vectors[:, :, 0] *= np.sign(np.linalg.det(vectors))[:, None]
    new_quat = quat_from_matrix(vectors)
    opacity = 1 / (1 + np.exp(-g.opacity_logit[kept].astype(np.float64)))
    covered = np.bincount(into, opacity * mean_area(variance), count) / mean_area(values)
    covered = np.clip(covered, 1e-3, LARGEST_OPACITY)
    sh = summed(share[:, None] * g.sh[kept].reshape(len(into), -1), into, count).reshape(-1, *g.sh.shape[1:])
    result = replace(
        avatar,
        gaussians=Gaussians(
            mean.astype(np.float32),
            (0.5 * np.log(values)).astype(np.float32),
            new_quat.astype(np.float32),
            np.log(covered / (1 - covered)).astype(np.float32),
            sh.astype(np.float32),
        ),
        groups=_groups(avatar, by),
        blendshapes=mixed_blendshapes(avatar.blendshapes, by.share, by.into, g.quat_wxyz, new_quat),
        skin=mixed_rows(avatar.skin, by.share, by.into, count),
    )
    if avatar.embedding is not None:
        start = _rows(avatar.embedding, _heaviest(by))
        result = placed(replace(result, embedding=start), mean, new_quat)
    if avatar.relight is None:
        return result
    facing = summed(share[:, None] * bound_normals(avatar)[kept], into, count)
    return with_normals(result, facing)


def placed(avatar: Avatar, mean: F64, quat_wxyz: F64) -> Avatar:
    """`avatar` with its Gaussians where `mean` and `quat_wxyz` say in the binding pose; embedded, where it is."""
    if avatar.embedding is not None:
        embedding = embedded(avatar.embedding, avatar.rules, avatar.training_per_bundle, mean, quat_wxyz)
        avatar = replace(avatar, embedding=embedding)
        bound = binding_pose(embedding, avatar.rules, avatar.training_per_bundle)
        mean, quat_wxyz = (values.astype(np.float64) for values in bound)
    moved = replace(avatar.gaussians, mean=mean.astype(np.float32), quat_wxyz=quat_wxyz.astype(np.float32))
    return replace(avatar, gaussians=moved)


def mean_area(variance: F64) -> F64:
    """[n] what a Gaussian with `variance` [n, 3] covers on average over all directions, up to a factor."""
    a, b, c = variance.T
    result: F64 = np.sqrt(a * b + b * c + c * a)
    return result


def _rows(embedding: Embedding, rows: I64) -> Embedding:
    """The embedding of the Gaussians `rows` alone."""
    by_row = ("triangle", "barycentric", "displacement", "local_offset", "local_quat_wxyz")
    taken = {name: getattr(embedding, name) for name in by_row}
    return replace(embedding, **{name: value[rows] if len(value) else value for name, value in taken.items()})


def _heaviest(by: Merging) -> I64:
    """[count] the id of each cluster's heaviest member; the first of equals."""
    order = np.lexsort((np.arange(len(by.into)), -by.share))
    order = order[by.into[order] >= 0]
    _, first = np.unique(by.into[order], return_index=True)
    result: I64 = order[first]
    return result


def _groups(avatar: Avatar, by: Merging) -> tuple[Group, ...]:
    groups, first = [], 0
    for group in avatar.groups:
        into = by.into[group.first : group.first + group.count]
        count = len(np.unique(into[into >= 0]))
        groups.append(replace(group, first=first, count=count))
        first += count
    return tuple(groups)
