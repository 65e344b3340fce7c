"""Checks a whole avatar: shapes, types, ranges, finite values. Readers and writers call it; no stage checks again."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from avatar_runtime.avatar import F32, F64, Avatar, Driving, Gaussians, Relight, Rig, Rules
from avatar_runtime.checks.arrays import check_f32, check_names, check_sparse, expect
from avatar_runtime.checks.enhancer import check_enhancer
from avatar_runtime.checks.fields import check_types
from avatar_runtime.checks.surface import check_clip, check_embedding, check_places
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rules import (
    BACKGROUNDS,
    BINDINGS,
    DRIVING_MODES,
    HEAD_POSE_IN,
    JOINT_ROTATIONS,
    LIGHT_FRAMES,
    RIGGED_ROTATIONS,
    SKIN_ROTATIONS,
    SKIN_SCALES,
    SURFACE_FAMILIES,
    SURFACE_RULES,
    names,
)

TINY = 1e-300  # smallest determinant of a transform in float64 that has an inverse
LARGEST = 1e6  # number of a joint's matrix
UNITS = (1e-6, 1e6)  # training units in a metre


def check_avatar(avatar: Avatar, *, packed: bool = False) -> Avatar:
    """`avatar` itself. Raises AvatarError that names the field whose shape, range or value is wrong, TypeError or
    ValueError for a field of another type than the model's.

    `packed`: it is decoded from integers of a pack. What is merely odd there is taken, since players do not see it.
    """
    check_types(avatar)
    _check_gaussians(avatar.gaussians)
    if not 0 <= avatar.sh_degree <= avatar.gaussians.sh_degree:
        raise AvatarError(
            f"is {avatar.sh_degree}; 0..{avatar.gaussians.sh_degree} is stored", field="sh_degree"
        )
    check_groups(avatar, avatar.gaussians.count)
    check_names("expressions", avatar.expression_names)
    check_names("eyelids", avatar.eyelids)
    n, k = avatar.gaussians.count, len(avatar.expressions)
    joints = avatar.rig.joint_count if avatar.rig else 0
    features = 9 * len(avatar.rig.corrective_joints) if avatar.rig else 0
    b, sh = avatar.blendshapes, avatar.gaussians.sh.shape[1:]
    sparse = partial(check_sparse, rising=not packed)
    sparse(b.geometry, "geometry", n, k, {"mean": (3,), "quat_wxyz": (4,)})
    sparse(b.appearance, "appearance", n, k, {"log_scale": (3,), "opacity_logit": (), "sh": sh})
    sparse(b.correctives, "correctives", n, features, {"mean": (3,)})
    sparse(b.late_morphs, "late_morphs", n, len(avatar.eyelids), {"mean": (3,)})
    sparse(avatar.skin, "skin", n, joints, {"weight": ()})
    if avatar.rig:
        _check_rig(avatar.rig, k, len(avatar.eyelids), sparse)
    _check_rules(avatar)
    if not packed:
        check_driving(avatar, avatar.driving)
        check_names("groups", tuple(g.name for g in avatar.groups))
        check_names("clips", tuple(clip.name for clip in avatar.clips))
    if avatar.embedding:
        check_embedding(avatar, avatar.embedding)
        if not packed:
            check_places(avatar.embedding)
    for clip in avatar.clips:
        check_clip(clip, k, len(avatar.eyelids), joints)
    if avatar.relight:
        _check_relight(avatar.relight, n, avatar.rig.joint_names if avatar.rig else ())
    if avatar.enhancer:
        check_enhancer(avatar.enhancer)
    return avatar


def _check_relight(relight: Relight, rows: int, joints: tuple[str, ...]) -> None:
    check_f32("relight.normal", relight.normal, (rows, 3))
    check_f32("relight.ambient", relight.ambient, (9, 3))
    _one_of("relight.frame", relight.frame, LIGHT_FRAMES)
    if relight.joint is not None and relight.joint not in joints:
        raise AvatarError(f"{relight.joint!r} is not a joint of the rig", field="relight.joint")
    if not np.isfinite((*relight.centre, relight.radius)).all() or relight.radius <= 0:
        raise AvatarError(
            f"is {relight.radius:g} about {list(relight.centre)}; a sphere is needed", field="relight.radius"
        )


def _check_gaussians(g: Gaussians) -> None:
    n = len(g.mean)
    if n == 0:
        raise AvatarError("an avatar needs at least one Gaussian", field="gaussians")
    for name, array, shape in (
        ("mean", g.mean, (n, 3)),
        ("log_scale", g.log_scale, (n, 3)),
        ("quat_wxyz", g.quat_wxyz, (n, 4)),
        ("opacity_logit", g.opacity_logit, (n,)),
    ):
        check_f32(f"gaussians.{name}", array, shape)
    if g.sh.ndim != 3 or g.sh.shape[1] not in (1, 4, 9, 16):
        expect(False, "gaussians.sh", "float32[N, 1 | 4 | 9 | 16, 3]", g.sh)
    check_f32("gaussians.sh", g.sh, (n, g.sh.shape[1], 3))


def check_groups(avatar: Avatar, rows: int) -> None:
    """Raise AvatarError unless the groups of `avatar` cover so many rows in order and fit its rig and embedding."""
    at = 0
    for group in avatar.groups:
        where = f"groups.{group.name}"
        if group.first != at or group.count < 1:
            raise AvatarError(f"covers {group.first}+{group.count}, but row {at} comes next", field=where)
        at += group.count
        if group.binding not in BINDINGS:
            raise AvatarError(f"binding {group.binding!r} is not one of {', '.join(BINDINGS)}", field=where)
        if (group.binding == "surface") != (avatar.embedding is not None):
            raise AvatarError("binding 'surface' goes with an embedding, for all groups or none", field=where)
        if group.binding not in ("none", "surface") and avatar.rig is None:
            raise AvatarError(f"binding {group.binding!r} needs a rig", field=where)
        if group.binding == "anchor" and avatar.rig is not None and len(avatar.rig.anchor_vertices) < 3:
            raise AvatarError("binding 'anchor' needs at least three anchor vertices in the rig", field=where)
        if (group.binding == "joint_mix") != bool(group.joint_mix):
            raise AvatarError("joint_mix goes with binding 'joint_mix'", field=where)
        for joint in group.joint_mix:
            if avatar.rig is not None and joint not in avatar.rig.joint_names:
                raise AvatarError(f"joint_mix names {joint!r}, which the rig lacks", field=where)
    if at != rows:
        raise AvatarError(f"cover {at} of {rows} Gaussians", field="groups")


def _check_rig(rig: Rig, expressions: int, late: int, sparse: Callable[..., None]) -> None:
    v, j = len(rig.vertices), rig.joint_count
    check_f32("rig.vertices", rig.vertices, (v, 3))
    t = rig.triangles
    expect(t.dtype == np.uint32 and t.ndim == 2 and t.shape[1:] == (3,), "rig.triangles", "u32[F, 3]", t)
    anchors = rig.anchor_vertices
    expect(anchors.dtype == np.uint32 and anchors.ndim == 1, "rig.anchor_vertices", "u32[A]", anchors)
    for name, index in (("triangles", t), ("anchor_vertices", anchors)):
        if index.size and int(index.max()) >= v:
            raise AvatarError(f"holds {int(index.max())}, but the rig has {v} vertices", field=f"rig.{name}")
    sparse(rig.morphs, "rig.morphs", v, expressions, {"position": (3,)})
    sparse(rig.correctives, "rig.correctives", v, 9 * len(rig.corrective_joints), {"position": (3,)})
    sparse(rig.late_morphs, "rig.late_morphs", v, late, {"position": (3,)})
    sparse(rig.skin, "rig.skin", v, j, {"weight": ()})
    check_names("rig.joint_names", rig.joint_names)
    expect(
        rig.parents.dtype == np.int32 and rig.parents.shape == (j,), "rig.parents", f"i32[{j}]", rig.parents
    )
    if (rig.parents >= np.arange(j)).any() or (rig.parents < -1).any():
        raise AvatarError("a parent must come before its children; a root is -1", field="rig.parents")
    for name, matrix in (("rest_local", rig.rest_local), ("inverse_bind_matrix", rig.inverse_bind_matrix)):
        check_f32(f"rig.{name}", matrix, (j, 4, 4))
        volume = np.abs(volumes(matrix))
        small = (np.abs(matrix) <= LARGEST).all(axis=(1, 2))
        sound = small & (matrix[:, 3] == (0, 0, 0, 1)).all(axis=1) & (volume > 1e-18)
        if not sound.all():
            raise AvatarError(
                "is not an affine matrix with an inverse", field=f"rig.{name}[{int(np.argmin(sound))}]"
            )
    _check_rest(rig)
    check_f32("rig.joint_basis", rig.joint_basis, (expressions, j, 3))
    c = rig.corrective_joints
    expect(c.dtype == np.int32 and c.ndim == 1, "rig.corrective_joints", "i32[C]", c)
    if c.size and (int(c.max()) >= j or int(c.min()) < 0):
        raise AvatarError(f"must lie in 0..{j - 1}", field="rig.corrective_joints")


def volumes(matrix: F32 | F64) -> F64:
    """[...] determinants of the 3x3 part of matrices [..., 4, 4], by the formula of every reader."""
    rows = matrix[..., :3, :3].astype(np.float64)
    a, b, c, d, e, f, g, h, i = (rows[..., k // 3, k % 3] for k in range(9))
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        found: F64 = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    return found


def _check_rest(rig: Rig) -> None:
    """Raise AvatarError for a joint whose rest transform, through all its parents, has no inverse in float64."""
    rest = rig.rest_local.astype(np.float64)
    with np.errstate(over="ignore", invalid="ignore", under="ignore"):
        for joint, parent in enumerate(rig.parents):
            if parent >= 0:
                rest[joint] = rest[parent] @ rest[joint]
        volume = np.abs(volumes(rest))
    sound = np.isfinite(rest).all(axis=(1, 2)) & (volume > TINY)
    if not sound.all():
        name = rig.joint_names[int(np.argmin(sound))]
        raise AvatarError(f"joint {name} and its parents together have no inverse", field="rig.rest_local")


def check_rule_values(rules: Rules) -> None:
    """Raise AvatarError for a rule with an unknown value. Call this before any stage is run."""
    for name in ("rotation", "sh_direction", "anchor", "position", "scale", "quaternion_sign"):
        _one_of(f"rules.{name}", getattr(rules, name), names(name))


def _one_of(name: str, value: str, known: tuple[str, ...]) -> None:
    if value not in known:
        raise AvatarError(f"{value!r} is not one of {', '.join(known)}", field=name)


def _check_rules(avatar: Avatar) -> None:
    rules = avatar.rules
    check_rule_values(rules)
    _one_of("head_pose_in", avatar.head_pose_in, HEAD_POSE_IN)
    _check_surface_rules(avatar)
    _check_numbers(avatar)
    joints = avatar.rig.joint_names if avatar.rig else ()
    if rules.rotation_joint is not None and rules.rotation_joint not in joints:
        raise AvatarError(f"{rules.rotation_joint!r} is not a joint of the rig", field="rules.rotation_joint")
    if rules.rotation in JOINT_ROTATIONS and rules.rotation_joint is None:
        raise AvatarError(f"rule {rules.rotation} needs a rotation_joint", field="rules.rotation_joint")


def check_driving(avatar: Avatar, d: Driving) -> None:
    """Raise AvatarError unless `d` can drive `avatar`: its outputs and joints are the avatar's."""
    joints = avatar.rig.joint_names if avatar.rig else ()
    for name, joint in (
        ("driving.head_joint", d.head_joint),
        ("driving.left_eye_joint", d.left_eye_joint),
        ("driving.right_eye_joint", d.right_eye_joint),
    ):
        if joint is not None and joint not in joints:
            raise AvatarError(f"{joint!r} is not a joint of the rig", field=name)
    _one_of("driving.mode", d.mode, DRIVING_MODES)
    if (d.mode == "matrix") != (d.matrix is not None):
        raise AvatarError("a matrix goes with mode 'matrix'", field="driving.matrix")
    if d.matrix is not None:
        check_f32("driving.matrix", d.matrix, (len(d.outputs), len(d.inputs)))
        _check_outputs(avatar, d.outputs)


def _check_surface_rules(avatar: Avatar) -> None:
    rules = avatar.rules
    chosen = (rules.rotation, rules.position, rules.scale)
    if avatar.embedding is not None and chosen not in SURFACE_RULES:
        known = "; ".join(", ".join(" | ".join(names) for names in family) for family in SURFACE_FAMILIES)
        raise AvatarError(
            f"rotation, position, scale are {', '.join(chosen)}; with an embedding they are one of {known}",
            field="rules",
        )
    if rules.rotation in RIGGED_ROTATIONS and avatar.rig is None:
        raise AvatarError(
            f"{rules.rotation} rotates Gaussians by the joints: it needs a rig", field="rules.rotation"
        )
    if avatar.embedding is None and (rules.rotation not in SKIN_ROTATIONS or rules.scale not in SKIN_SCALES):
        raise AvatarError(f"{rules.rotation}, {rules.scale}: such rules need an embedding", field="rules")


def _check_outputs(avatar: Avatar, outputs: tuple[str, ...]) -> None:
    known = {f"expression/{name}" for name in avatar.expression_names}
    known |= {f"eyelid/{name}" for name in avatar.eyelids}
    joints = avatar.rig.joint_names if avatar.rig else ()
    known |= {f"joint/{name}/{axis}" for name in joints for axis in "xyz"}
    for output in outputs:
        if output not in known:
            raise AvatarError(
                f"{output!r} is not an expression/NAME, eyelid/NAME or joint/NAME/x|y|z of this avatar",
                field="driving.outputs",
            )
    check_names("driving.outputs", outputs)


def _check_numbers(avatar: Avatar) -> None:
    """Raise AvatarError for a single number that is not finite or has an impossible sign or size."""
    raster, u = avatar.raster, avatar.training_per_bundle
    factors = [f for group in avatar.groups for f in group.joint_mix.values()]
    colour = () if isinstance(raster.background, str) else raster.background
    for name, values in (
        ("groups.joint_mix", factors),
        ("raster.near", (raster.near,)),
        ("raster.low_pass", (raster.low_pass,)),
        ("raster.background", colour),
        ("training_per_bundle", (u,)),
        ("driving.head_pivot", avatar.driving.head_pivot),
        ("expressions.range", [end for e in avatar.expressions for end in e.range]),
    ):
        if not np.isfinite(np.array(values, np.float64)).all():
            raise AvatarError("must be finite", field=name)
    if raster.near <= 0 or raster.low_pass < 0:
        raise AvatarError("near must be positive and low_pass must not be negative", field="raster")
    if not UNITS[0] <= u <= UNITS[1]:
        raise AvatarError(f"is {u}; must be {UNITS[0]:g} to {UNITS[1]:g}", field="training_per_bundle")
    if isinstance(raster.background, str) and raster.background not in BACKGROUNDS:
        raise AvatarError(
            f"{raster.background!r} is not one of {', '.join(BACKGROUNDS)}", field="raster.background"
        )
