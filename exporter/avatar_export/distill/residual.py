"""What is not linear in the drivers: a few bases with a weight in every frame, which only clips can play."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from avatar_export.distill.build import SEEN
from avatar_export.distill.learn import ATTRIBUTES, Still, Task, sample_rows, still
from avatar_export.distill.worth import WORTH, Ranked, avatar_bytes, flat, kept, row_of
from avatar_export.rigs.rig_arrays import by_row
from avatar_export.sparse import SparseRowsBuilder
from avatar_runtime.avatar import F32, F64, I64, Avatar, Expression, SparseRows

BASES = 20  # at most, where there is a skeleton
BASES_ALONE = 48  # at most, without a skeleton: they must carry all motion
KEPT = 0.9999  # of the variance of the sample
LARGER = 1.1  # times its bytes without bases: so large may an avatar with bases be
NAME = "residual_"
Priors = Callable[[slice | I64], F64 | None]


def with_bases(task: Task, avatar: Avatar, share: F64, priors: Priors) -> Avatar:
    """`avatar` with bases of what it leaves in all frames: its clips play them, its drivers move it as before.

    Those entries of the bases are kept that show most by byte, until the avatar has LARGER times its bytes. `share` [N]
    of each Gaussian in the picture. Its clips become those of the takes with the weights of the bases.
    """
    rows = sample_rows(task.layout.rows)
    sample = _left(task, avatar, rows, still(task, task.rows(rows), priors(rows)))
    parts = [value.reshape(len(value), -1) * np.float32(WORTH[name]) for name, value in sample.items()]
    weights = _modes(np.concatenate(parts, axis=1).astype(np.float64), BASES)
    geometry, appearance = _fitted(task, avatar, weights, priors)
    ranked = Ranked.of(geometry, appearance, np.square(weights).mean(axis=0), share)
    spare = (LARGER - 1) * avatar_bytes(avatar)
    first = int((np.cumsum(ranked.size[::-1])[::-1] > spare).sum())
    stay = ranked.without(first)
    return _joined(task, avatar, weights, kept(geometry, stay[0]), kept(appearance, stay[1]))


def _left(task: Task, avatar: Avatar, rows: slice | I64, unposed: Still) -> dict[str, F32]:
    """attribute -> [F, n, c]: what `avatar` leaves of some Gaussians that are not posed, in all frames."""
    index = np.arange(task.layout.rows)[rows]
    shapes, frames = avatar.blendshapes, task.dumps.drivers.frames
    drivers = task.dumps.drivers.drivers.astype(np.float32)
    made: dict[str, F32] = {}
    for part in (shapes.geometry, shapes.appearance):
        made |= _moved(part.take(index), drivers)
    if task.columns.turns.shape[1] and avatar.rig is not None:
        turns = np.zeros((frames, len(avatar.rig.corrective_joints), 9), np.float32)
        assert task.skeleton is not None
        turns[:, np.searchsorted(avatar.rig.corrective_joints, task.skeleton.turning)] = task.columns.turns
        made["mean"] += _moved(shapes.correctives.take(index), turns.reshape(frames, -1))["mean"]
    result = {}
    for name in ATTRIBUTES:
        base = getattr(avatar.gaussians, name)[index].reshape(len(index), -1)
        result[name] = unposed.values[name] - base - made[name]
    return result


def _moved(rows: SparseRows, weights: F32) -> dict[str, F32]:
    """attribute -> [F, n, c]: the weighted sums of every row; `weights` [F, K]."""
    found = {}
    for name, values in rows.values.items():
        entries = flat(values)
        dense = np.zeros((rows.columns, rows.rows, entries.shape[1]), np.float32)
        dense[rows.column.astype(np.int64), row_of(rows)] = entries
        product = weights @ dense.reshape(rows.columns, rows.rows * entries.shape[1])
        found[name] = product.reshape(len(weights), rows.rows, -1)
    return found


def _fitted(task: Task, avatar: Avatar, weights: F64, priors: Priors) -> tuple[SparseRows, SparseRows]:
    """(geometry, appearance) of the bases with `weights` [F, K]: all entries that can be seen."""
    solver, reach = np.linalg.pinv(weights).astype(np.float32), np.ptp(weights, axis=0)
    shapes = (avatar.blendshapes.geometry, avatar.blendshapes.appearance)
    builders = []
    for rows in shapes:
        sizes = {name: value.shape[1:] for name, value in rows.values.items()}
        builders.append(SparseRowsBuilder(rows.rows, len(reach), sizes, dict.fromkeys(sizes, 0.0)))
    for block in task.blocks():
        left = _left(task, avatar, block, still(task, task.rows(block), priors(block)))
        count = block.stop - block.start
        for builder in builders:
            found, visible = {}, np.zeros((count, len(reach)), bool)
            for name in builder.shapes:
                change = (solver @ left[name].reshape(len(weights), -1)).reshape(len(reach), count, -1)
                found[name] = change.swapaxes(0, 1)
                visible |= np.abs(found[name]).max(axis=2, initial=0) * reach > SEEN[name]
            builder.append(
                {
                    name: (change * visible[..., None]).reshape(count, len(reach), *builder.shapes[name])
                    for name, change in found.items()
                }
            )
    return builders[0].finish(), builders[1].finish()


def _joined(task: Task, avatar: Avatar, weights: F64, geometry: SparseRows, appearance: SparseRows) -> Avatar:
    """`avatar` with the bases as further expressions."""
    count, take, shapes = weights.shape[1], task.dumps.drivers.take, avatar.blendshapes
    low, high = np.minimum(weights.min(axis=0), 0), np.maximum(weights.max(axis=0), 0)
    names = _names(count)
    clips = [
        replace(
            clip,
            expression_weights=np.concatenate(
                [clip.expression_weights, weights[take == kind].astype(np.float32)], axis=1
            ),
        )
        for clip, kind in zip(avatar.clips, np.unique(take), strict=True)
    ]
    rig = avatar.rig
    assert rig is not None
    still_joints = np.zeros((count, *rig.joint_basis.shape[1:]), np.float32)
    return replace(
        avatar,
        expressions=(
            *avatar.expressions,
            *(Expression(names[k], range=(float(low[k]), float(high[k]))) for k in range(count)),
        ),
        blendshapes=replace(
            shapes,
            geometry=_beside(shapes.geometry, geometry),
            appearance=_beside(shapes.appearance, appearance),
        ),
        rig=replace(
            rig,
            morphs=replace(rig.morphs, columns=rig.morphs.columns + count),
            joint_basis=np.concatenate([rig.joint_basis, still_joints]),
        ),
        clips=tuple(clips),
    )


def _beside(a: SparseRows, b: SparseRows) -> SparseRows:
    """The columns of `a`, then those of `b`."""
    row = np.concatenate([row_of(a), row_of(b)])
    column = np.concatenate([a.column.astype(np.int64), b.column.astype(np.int64) + a.columns])
    values = {name: np.concatenate([value, b.values[name]]) for name, value in a.values.items()}
    return by_row(row, column, values, a.rows, a.columns + b.columns)


def _names(count: int) -> tuple[str, ...]:
    return tuple(f"{NAME}{index:02d}" for index in range(count))


def bases_alone(task: Task) -> Task:
    """`task` with nothing but bases of the motion itself, learnt from all frames, for dumps without a skeleton."""
    rows = sample_rows(task.layout.rows)
    sample = still(task, task.rows(rows))
    parts = [
        (values - values.mean(axis=0)).reshape(len(values), -1) * np.float32(WORTH[name])
        for name, values in sample.values.items()
    ]
    weights = _modes(np.concatenate(parts, axis=1).astype(np.float64), BASES_ALONE)
    drivers = replace(task.dumps.drivers, driver_names=_names(weights.shape[1]), drivers=weights)
    every: I64 = np.arange(drivers.frames)
    dumps = replace(task.dumps, drivers=drivers)
    return Task.of(dumps, task.layout, every, None, task.order, task.turns)


def _modes(left: F64, most: int) -> F64:
    """[F, K] weights of the strongest bases of `left` [F, M], each of size 1."""
    strength, modes = np.linalg.eigh(left @ left.T)
    strength, modes = strength[::-1], modes[:, ::-1]
    share = np.cumsum(strength) / max(float(strength.sum()), 1e-30)
    count = min(most, int(np.searchsorted(share, KEPT)) + 1, len(left) - 1)
    chosen = modes[:, :count]
    result: F64 = chosen / np.maximum(np.abs(chosen).max(axis=0), 1e-12)
    return result
