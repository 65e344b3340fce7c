"""Do flat splats lie in the surface under them? They do, unless quaternions were written in another form."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from avatar_export.fit.neighbours import LEAST
from avatar_export.fit.sampled import spread_rows, unit_rows
from avatar_export.fit.surface import Mesh
from avatar_export.notes.note import Note, doubt
from avatar_runtime.avatar import F32, F64, I64, Avatar
from avatar_runtime.rotation import matrix_from_quat, quat_multiply

SAMPLES = 800
VISIBLE = -2.0  # logit of an opacity of 0.12
BETTER, SURE = 0.04, 6.0  # how much less of a splat stands across the surface, and in standard errors
PART = 0.8  # of what the better of the stored and a chance rotation leaves across, the better of the two forms leaves
# Of quaternions whose first or last number is by far the largest:
TURNED, MOST, SOME, FEW = 0.85, 0.7, 0.05, 0.05
FORMS: Mapping[str, Callable[[F64], F64]] = {
    "xyzw": lambda quat: quat[:, [3, 0, 1, 2]],
    "conjugated": lambda quat: quat * np.array([1, -1, -1, -1]),
}


def doubts(avatar: Avatar) -> list[Note]:
    """A doubt about quaternions in the order x, y, z, w, or of the inverse rotations, in all rows or in many."""
    g, embedding = avatar.gaussians, avatar.embedding
    if g.count < LEAST:
        return []
    stored = g.quat_wxyz if embedding is None else embedding.local_quat_wxyz
    share = _last(stored)
    if share is not None:
        return [doubt("quaternions", form="xyzw", whole=share > MOST)]
    mesh = _mesh(avatar)
    rows = np.flatnonzero((g.opacity_logit > VISIBLE) & np.isfinite(g.mean).all(axis=1))
    if mesh is None or not mesh.sound or len(rows) < LEAST:
        return []
    rows = rows[spread_rows(len(rows), SAMPLES)]
    return _across(avatar, stored, rows, mesh)


def _last(quat: F32) -> float | None:
    """The share of quaternions whose last number stands where training starts w from, which is 1; None if few."""
    unit = np.abs(quat) / np.maximum(np.linalg.norm(quat, axis=1, keepdims=True), 1e-30)
    first, second, third, last = (unit > TURNED).mean(axis=0).tolist()
    return last if first + last > MOST and last > SOME and max(second, third) < FEW else None


def _mesh(avatar: Avatar) -> Mesh | None:
    if avatar.embedding is not None:
        return Mesh.of(avatar.embedding.canonical_vertices, avatar.embedding.triangles)
    return None if avatar.rig is None else Mesh.of(avatar.rig.vertices, avatar.rig.triangles)


def _across(avatar: Avatar, stored: F32, rows: I64, mesh: Mesh) -> list[Note]:
    g = avatar.gaussians
    corner = mesh.vertices[mesh.triangles[mesh.nearest(g.mean[rows].astype(np.float64)).triangle]]
    normal = unit_rows(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]))
    square = np.exp(2 * (g.log_scale[rows] - g.log_scale[rows].max(axis=1, keepdims=True)).astype(np.float64))
    unit = unit_rows(stored[rows])
    own = _share_across(g.quat_wxyz[rows], square, normal)
    by_chance = _share_across(np.roll(g.quat_wxyz[rows], len(rows) // 2, axis=0), square, normal)
    tried = {
        f: _share_across(_turned(avatar, other(unit), rows), square, normal) for f, other in FORMS.items()
    }
    form, given = min(tried.items(), key=lambda one: float(np.minimum(own, one[1]).mean()))
    less = own - given
    if less.mean() > max(BETTER, SURE * _error(less)):
        return [doubt("quaternions", form=form, whole=True)]
    better, chance = np.minimum(own, given), np.minimum(own, by_chance)
    if better.mean() < PART * chance.mean() and (chance - better).mean() > SURE * _error(chance - better):
        return [doubt("quaternions", form=form, whole=False)]
    return []


def _turned(avatar: Avatar, given: F64, rows: I64) -> F64:
    """Rotations of `rows` in the binding pose if the units `given` [n, 4] stood in the file."""
    if avatar.embedding is None:
        return given
    local = unit_rows(avatar.embedding.local_quat_wxyz[rows]) * (1, -1, -1, -1)
    turned: F64 = quat_multiply(
        quat_multiply(avatar.gaussians.quat_wxyz[rows].astype(np.float64), local), given
    )
    return turned


def _share_across(quat: F32 | F64, square: F64, normal: F64) -> F64:
    """[n] how much of the squared deviations `square` [n, 3] of splats lies along `normal` [n, 3]."""
    along = np.einsum("ni,nij->nj", normal, matrix_from_quat(unit_rows(quat)))
    share: F64 = (np.square(along) * square).sum(axis=1) / square.sum(axis=1)
    return share


def _error(values: F64) -> float:
    return float(values.std() / max(len(values), 1) ** 0.5)
