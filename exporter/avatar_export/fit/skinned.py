"""Gaussians that were trained on a body model, against the body model given: places, identity, motion, skeleton."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from avatar_export.bodies.body_model import BodyModel
from avatar_export.fit import motion, skeleton
from avatar_export.fit.identity import better_identity
from avatar_export.fit.judge import WARNED, Sides, judged, length, mend, percent
from avatar_export.fit.surface import FEWEST, GroupFit, Mesh, explained, group_fits, opaque_rows, size_of
from avatar_export.notes import DOUBT
from avatar_runtime.avatar import F64, Avatar

FEW_COEFFICIENTS = 10  # trackers of faces and bodies write at least so many


@dataclass(frozen=True)
class Subject:
    """The body model of an avatar and the identities that might be its own."""

    body: BodyModel
    shape: F64 | None  # as given; None: the mean shape
    said: str  # how the identity was given, in words
    others: Mapping[str, F64]  # what to pass instead -> coefficients


def skinned_fit(avatar: Avatar, subject: Subject, sides: Sides) -> list[str]:
    """Notes on how an avatar whose groups are skinned by `avatar.rig` fits it; doubts begin with DOUBT.

    Raises AvatarError if the Gaussians lie far from the mesh and the misfit is not accepted.
    """
    assert avatar.rig is not None
    mesh = Mesh.of(avatar.rig.vertices, avatar.rig.triangles)
    notes = _coefficients(subject)
    if not mesh.sound:
        return notes
    faults = skeleton.not_human(mesh.used, avatar.rig.joint_count, f"if {sides.goal} is in metres")
    faults += skeleton.joint_faults(avatar.rig, mesh)
    fits, size = group_fits(avatar, mesh)
    if fits:
        notes += _places(avatar, mesh, fits, size, subject, sides)
    return [*(f"{DOUBT}{fault}" for fault in faults), *notes]


def _coefficients(subject: Subject) -> list[str]:
    known = subject.body.identity_dirs.shape[2]
    count = 0 if subject.shape is None else len(subject.shape)
    if 0 < count < min(FEW_COEFFICIENTS, known):
        return [
            f"{DOUBT}the identity ({subject.said}) has {count} coefficient{'s' * (count > 1)}, the body model {known} "
            "directions: pass the whole identity"
        ]
    return []


def _places(
    avatar: Avatar, mesh: Mesh, fits: list[GroupFit], size: float, subject: Subject, sides: Sides
) -> list[str]:
    first, group = fits[0], next(group for group in avatar.groups if group.name == fits[0].name)
    share = first.median / max(size, 1e-30)
    points = avatar.gaussians.mean[opaque_rows(avatar, group)].astype(np.float64)
    found = explained(points, mesh, WARNED * size_of(mesh.used), pairs=share > WARNED)
    cause = _other_identity(points, subject) if found is None else mend(*found, sides)
    doubts = judged(_apart(first, share, sides), share, cause, sides)
    if share > WARNED or found is not None:
        return doubts  # what follows would follow from this
    for fit in fits[1:]:
        share = fit.median / max(size, 1e-30)
        text = f"{_apart(fit, share, sides)}; {first.name} lies {length(first.median)} from it"
        doubts += judged(f"{text}: look at the files of {fit.name}", share, None, replace(sides, file=None))
    if not doubts:
        listed = ", ".join(f"{fit.name} {length(fit.median)}" for fit in fits)
        doubts = [f"median distance from the mesh of {sides.goal}: {listed}"]
    return [*doubts, *_moves(avatar, mesh, sides)]


def _apart(fit: GroupFit, share: float, sides: Sides) -> str:
    return (
        f"{sides.own} of {fit.name} lie {length(fit.median)} (median) from the mesh of {sides.goal}, {percent(share)} "
        "its size"
    )


def _other_identity(points: F64, subject: Subject) -> str | None:
    found = better_identity(points, subject.body, subject.shape, subject.others)
    if found is None:
        return None
    name, shape, median = found
    if name is not None:
        return f"it would be {length(median)} with {name} in place of {subject.said}"
    first = ", ".join(f"{value:.2g}" for value in shape[:4])
    return (
        f"it would be {length(median)} with another identity of this body model ({first}, ...) than {subject.said}: "
        "pass the subject's own --shape"
    )


def _moves(avatar: Avatar, mesh: Mesh, sides: Sides) -> list[str]:
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
        doubts.append(f"{_unlike('expressions', together, sides)}{_exchanged(avatar, together, own, theirs)}")
    lids = motion.eyelids(avatar, group, mesh)
    if not lids.alike:
        doubts.append(f"{_unlike('eyelids', lids, sides)}; look at --eyelids")
    turned = motion.features(avatar, under)
    if not turned.alike:
        doubts.append(_unlike("pose correctives", turned, sides))
    shared = motion.joints_shared(avatar, under)
    if shared > motion.WEIGHTS:
        doubts.append(
            f"{shared:.0%} of the skin weights of {sides.own} go to other joints than those of {sides.goal} under them"
        )
    doubts += _anchors(avatar)
    return [f"{DOUBT}{doubt}" for doubt in doubts]


def _unlike(what: str, found: motion.Motion, sides: Sides) -> str:
    far = f", {found.gain:.2g} times as far" if found.gain != 1 else ""
    text = f"{what} do not move {sides.own} as they move {sides.goal} under them"
    return f"{text}: correlation {found.correlation:.2f}{far}"


def _exchanged(avatar: Avatar, together: motion.Motion, own: F64, theirs: F64) -> str:
    if together.correlation >= motion.LIKE:
        return "; look at the unit of its expression directions"
    pair = motion.best_column(own, theirs)
    if pair is None:
        return "; the body model is another one than that of the training"
    names = avatar.expression_names
    return f"; {names[pair[0]]} of the checkpoint moves like {names[pair[1]]} of the body model: their order differs"


def _anchors(avatar: Avatar) -> list[str]:
    """A phrase, if the vertices that carry the upper teeth are moved by the jaw."""
    assert avatar.rig is not None
    names = avatar.rig.joint_names
    anchors = avatar.rig.anchor_vertices
    if "jaw" not in names or not len(anchors):
        return []
    jaw = motion.dense(avatar.rig.skin, anchors.astype(np.int64), "weight")[:, names.index("jaw")]
    share = float(np.median(jaw))
    if share < 0.5:
        return []
    return [
        f"the anchor faces hang on the jaw ({share:.0%}), and the upper teeth on them: look at --anchor-faces"
    ]
