"""Gaussians that were trained on a body model, against the body model given: places, identity, motion, skeleton."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from avatar_export.bodies.body_model import BodyModel
from avatar_export.fit import motion, skeleton
from avatar_export.fit.identity import better_identity
from avatar_export.fit.judge import WARNED, Sides, judged, mend
from avatar_export.fit.places import regressor_notes
from avatar_export.fit.surface import FEWEST, GroupFit, Mesh, explained, group_fits, opaque_rows, size_of
from avatar_export.notes.note import Note, doubt, fact
from avatar_runtime.avatar import F64, Avatar

FEW_COEFFICIENTS = 10  # trackers of faces and bodies write at least so many


@dataclass(frozen=True)
class Subject:
    """The body model of an avatar and the identities that might be its own."""

    body: BodyModel
    shape: F64 | None  # as given; None: the mean shape
    given: str  # the option that gave the identity
    others: Mapping[str, F64]  # what to pass instead -> coefficients


def skinned_fit(avatar: Avatar, subject: Subject, sides: Sides) -> list[Note]:
    """Notes on how an avatar whose groups are skinned by `avatar.rig` fits it.

    Raises AvatarError if the Gaussians lie far from the mesh and the misfit is not accepted.
    """
    assert avatar.rig is not None
    mesh = Mesh.of(avatar.rig.vertices, avatar.rig.triangles)
    body = subject.body
    notes = _coefficients(subject)
    notes += regressor_notes(body.joint_regressor, body.triangles, body.joint_names, sides.goal)
    if not mesh.sound:
        return notes
    fits, size = group_fits(avatar, mesh)
    if fits:
        notes += _places(avatar, mesh, fits, size, subject, sides)
    return [*skeleton.skeleton_doubts(avatar.rig, mesh, sides.goal), *notes]


def _coefficients(subject: Subject) -> list[Note]:
    known = subject.body.identity_dirs.shape[2]
    count = 0 if subject.shape is None else len(subject.shape)
    if 0 < count < min(FEW_COEFFICIENTS, known):
        return [doubt("few_coefficients", given=subject.given, count=count, known=known)]
    return []


def _places(
    avatar: Avatar, mesh: Mesh, fits: list[GroupFit], size: float, subject: Subject, sides: Sides
) -> list[Note]:
    first, group = fits[0], next(group for group in avatar.groups if group.name == fits[0].name)
    share = first.median / max(size, 1e-30)
    points = avatar.gaussians.mean[opaque_rows(avatar, group)].astype(np.float64)
    found = explained(points, mesh, WARNED * size_of(mesh.used), pairs=share > WARNED)
    cause = _other_identity(points, subject) if found is None else mend(*found, sides)
    near: dict[str, object] = {"others": None, "near": first.median}
    doubts = judged("group_off", share, cause, sides, group=first.name, median=first.median, **near)
    if share > WARNED or found is not None:
        return doubts  # what follows would follow from this
    for fit in fits[1:]:
        share = fit.median / max(size, 1e-30)
        near["others"] = first.name
        values = {"group": fit.name, "median": fit.median, **near}
        doubts += judged("group_off", share, None, replace(sides, file=None), **values)
    if not doubts:
        doubts = [fact("distances", goal=sides.goal, groups={fit.name: fit.median for fit in fits})]
    return [*doubts, *_moves(avatar, mesh, sides)]


def _other_identity(points: F64, subject: Subject) -> Note | None:
    found = better_identity(points, subject.body, subject.shape, subject.others)
    if found is None:
        return None
    name, shape, median = found
    first = ", ".join(f"{value:.2g}" for value in shape[:4])
    return fact("other_identity", median=median, name=name, first=first, given=subject.given)


def _moves(avatar: Avatar, mesh: Mesh, sides: Sides) -> list[Note]:
    """Doubts about motions, for the first group, which the body model skins."""
    assert avatar.rig is not None
    group = avatar.groups[0]
    rows = opaque_rows(avatar, group)
    if len(rows) < FEWEST:
        return []
    under = motion.Under.of(rows, mesh, mesh.nearest(avatar.gaussians.mean[rows].astype(np.float64)))
    doubts = []
    together, own, theirs = motion.expressions(avatar, under)
    if not together.alike:
        doubts.append(_unlike("expressions", together, sides, _exchanged(avatar, together, own, theirs)))
    elif pairs := motion.exchanged_columns(own, theirs):
        names = avatar.expression_names
        order = [fact("other_order", own=names[a], theirs=names[b]) for a, b in pairs[:3]]
        doubts.append(doubt("moves_like_others", goal=sides.goal, order=order))
    lids = motion.eyelids(avatar, group, mesh)
    if not lids.alike:
        doubts.append(_unlike("eyelids", lids, sides, fact("eyelid_files")))
    turned = motion.features(avatar, under)
    if not turned.alike:
        doubts.append(_unlike("pose correctives", turned, sides, None))
    shared = motion.joints_shared(avatar, under)
    if shared > motion.WEIGHTS:
        doubts.append(doubt("weights_elsewhere", share=shared, own=sides.own, goal=sides.goal))
    return [*doubts, *_anchors(avatar)]


def _unlike(what: str, found: motion.Motion, sides: Sides, cause: Note | None) -> Note:
    values = {"correlation": found.correlation, "gain": found.gain, "cause": cause}
    return doubt("moves_otherwise", what=what, own=sides.own, goal=sides.goal, **values)


def _exchanged(avatar: Avatar, together: motion.Motion, own: F64, theirs: F64) -> Note:
    if together.correlation >= motion.LIKE:
        return fact("other_unit")
    pair = motion.best_column(own, theirs)
    if pair is None:
        return fact("other_body")
    names = avatar.expression_names
    return fact("other_order", own=names[pair[0]], theirs=names[pair[1]])


def _anchors(avatar: Avatar) -> list[Note]:
    """A doubt, if the jaw moves the vertices that carry the upper teeth."""
    assert avatar.rig is not None
    names = avatar.rig.joint_names
    anchors = avatar.rig.anchor_vertices
    if "jaw" not in names or not len(anchors):
        return []
    jaw = motion.dense(avatar.rig.skin, anchors.astype(np.int64), "weight")[:, names.index("jaw")]
    share = float(np.median(jaw))
    return [] if share < 0.5 else [doubt("anchors_on_jaw", share=share)]
