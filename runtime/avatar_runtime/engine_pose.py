"""What a game engine sets on the bundle's rig.glb or rig.usdc to show a pose.

Engines hold a chain of nodes with translation, rotation and scale, and morph targets that act before skinning.
An avatar has more: rest joints that expressions move, rest transforms with scale, late morphs after skinning.
Joint translations and node rotations take up the first two exactly; shear and late morphs leave a residual,
which the exporter measures and the manifest states.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from avatar_runtime.avatar import F32, F64, I64, Avatar, Clip, Rig
from avatar_runtime.checks import arguments
from avatar_runtime.clips import check_clip_of
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import LARGEST, Pose, resolve
from avatar_runtime.rotation import homogeneous, matrix_from_quat, quat_from_matrix
from avatar_runtime.stages.joints import chain, levels, pose_features, rest_transforms

BOUND = (
    1e-5  # largest entry of a skin matrix at rest, less the identity, that is rounding: metres and parts of 1
)


@dataclass(frozen=True)
class EnginePose:
    """What an engine sets on rig.glb or rig.usdc for one pose; the arrays of a clip have a leading axis [T].

    Node transforms are complete local ones that replace those in the file: parent_from_node = T R S.
    Quaternions are unit, (x, y, z, w); their first component of w, x, y, z that is not 0 is positive, in a clip
    that of the first frame, and the others follow it without a jump.
    """

    root_translation: F64  # [3] metres; the node above the joints, world_from_avatar
    root_rotation_xyzw: F64  # [4]
    translation: F64  # [J, 3] metres; every joint, in the order of rig.joint_names
    rotation_xyzw: F64  # [J, 4]
    scale: F64  # [J, 3]
    weights: F32  # [M] of target_names(avatar)


def target_names(avatar: Avatar) -> tuple[str, ...]:
    """Names of the rig's morph targets as engines see them, [M], all different.

    First the expressions; then the pose correctives as "corrective_JOINT_RC" for entry (R, C), from 0, of a joint's
    rotation minus the identity, in the order of the pose features; then the late morphs. A name that an earlier
    target has gets "_2" at its end, or the next number that is free.
    """
    rig = arguments.instance("avatar", avatar, Avatar).rig
    joints = [rig.joint_names[j] for j in rig.corrective_joints] if rig else []
    features = [f"corrective_{joint}_{entry // 3}{entry % 3}" for joint in joints for entry in range(9)]
    return unique_names([*avatar.expression_names, *features, *avatar.eyelids])


def unique_names(names: Iterable[str]) -> tuple[str, ...]:
    """The names in their order; one that stood before gets "_2" at its end, or the next number that is free."""
    taken: dict[str, int] = {}  # name -> the last number that it was given
    for name in names:
        found, number = name, taken.get(name, 0)
        while found in taken:
            number += 1
            found = f"{name}_{number}"
        taken[name] = max(number, 1)
        taken.setdefault(found, 1)
    return tuple(taken)


def node_names(rig: Rig) -> tuple[str, str]:
    """(node above the joints, node of the mesh) in rig.glb: avatar_root and avatar_mesh, or with _2 beside a joint
    of that name.
    """
    *_, root, mesh = unique_names([*rig.joint_names, "avatar_root", "avatar_mesh"])
    return root, mesh


def bind_nodes(rig: Rig) -> F64:
    """mesh_from_joint of the engine's skeleton in its bind pose, [J, 4, 4]: rigid, so that engines see scales of 1.

    Translation and nearest rotation (polar) of the rest transform, or of the bind transform where the rig does not
    rest in its binding pose. The engine's inverse bind matrix is its inverse. Nothing is lost: the skin matrices
    already hold the scale. Raises AvatarError for a transform beyond float32.
    """
    rest = rest_transforms(rig)
    bind = rest if rests_bound(rig) else np.linalg.inv(rig.inverse_bind_matrix.astype(np.float64))
    fits = (np.maximum(np.abs(rest), np.abs(bind)) <= LARGEST).all(axis=(1, 2))
    if not fits.all():
        message = "its rest transform does not fit float32; scale the rig to metres"
        raise AvatarError(message, field=f"joint {rig.joint_names[int(np.argmin(fits))]}")
    return homogeneous(_nearest_rotation(bind[:, :3, :3]), bind[:, :3, 3])


@np.errstate(over="ignore", invalid="ignore")
def rests_bound(rig: Rig) -> bool:
    """Whether the rig's mesh at rest is its template: rest and bind transforms are equal up to rounding."""
    skin_matrix = rest_transforms(rig) @ rig.inverse_bind_matrix.astype(np.float64)
    off = np.abs(skin_matrix - np.eye(4)).max(initial=0)
    return not off > BOUND  # NaN is refused elsewhere


def engine_rest(avatar: Avatar) -> EnginePose:
    """The pose in which rig.glb and rig.usdc stand, engine_pose of no pose. Raises AvatarError without a rig.

    Where the rig rests in its binding pose it is free of the rounding of float32 inverse bind matrices.
    """
    rig = _rig(avatar)
    if not rests_bound(rig):
        return engine_pose(avatar, Pose())
    nodes = _local_nodes(rig, np.eye(4), bind_nodes(rig))
    weights = np.zeros(len(target_names(avatar)), np.float32)
    return EnginePose(np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0]), *nodes, weights)


def engine_pose(avatar: Avatar, pose: Pose) -> EnginePose:
    """The node transforms and weights that an engine sets for `pose`.

    Raises AvatarError without a rig, for a name that the avatar lacks, and for a joint whose node does not fit float32.
    Each node's mesh_from_joint becomes A_j bind_nodes_j with the skin matrix A_j of stage `joints`; relative to the
    parent as the engine holds it, a linear part M is split into the nearest rotation R and the scale diag(R^T M).
    The rest of M is shear. A parent of scale 0 has no inverse; its pseudo-inverse keeps the part that can be shown.
    """
    arrays = resolve(pose, arguments.instance("avatar", avatar, Avatar))
    return _engine_pose(
        avatar,
        arrays.expression_weights,
        arrays.late_weights,
        arrays.joint_delta,
        arrays.world_from_avatar,
    )


def engine_clip(avatar: Avatar, clip: Clip) -> EnginePose:
    """engine_pose of every frame of `clip`: arrays with a first axis [T], quaternions without jumps of sign.

    Raises AvatarError as engine_pose does, TypeError and ValueError as clip_pose.
    """
    check_clip_of(avatar, clip)
    found = _engine_pose(
        avatar,
        clip.expression_weights,
        clip.late_weights,
        clip.joint_delta.astype(np.float64),
        clip.world_from_avatar.astype(np.float64),
    )
    return EnginePose(
        found.root_translation,
        _continuous(found.root_rotation_xyzw),
        found.translation,
        _continuous(found.rotation_xyzw),
        found.scale,
        found.weights,
    )


def node_transforms(rig: Rig, pose: EnginePose) -> F64:
    """mesh_from_joint as an engine that was set to `pose` has it, below the root node, [..., J, 4, 4]."""
    local = local_transforms(pose.translation, pose.rotation_xyzw, pose.scale)
    for level in levels(rig.parents)[1:]:
        local[..., level, :, :] = local[..., rig.parents[level], :, :] @ local[..., level, :, :]
    return local


def _engine_pose(avatar: Avatar, expressions: F32, late: F32, joint_delta: F64, world: F64) -> EnginePose:
    rig = _rig(avatar)
    skin_matrix, _, _ = chain(rig, expressions, joint_delta)
    translation, rotation, scale = _local_nodes(rig, skin_matrix, bind_nodes(rig))
    weights = np.concatenate([expressions, pose_features(rig, joint_delta), late], axis=-1)
    return EnginePose(
        world[..., :3, 3].copy(),
        _quat_xyzw(_nearest_rotation(world[..., :3, :3])),
        translation,
        rotation,
        scale,
        weights.astype(np.float32),
    )


def _rig(avatar: Avatar) -> Rig:
    if avatar.rig is None:
        raise AvatarError("this avatar has no rig, so an engine cannot pose it", field="rig")
    return avatar.rig


@np.errstate(over="ignore", invalid="ignore")  # refused below
def _local_nodes(rig: Rig, skin_matrix: F64, bind: F64) -> tuple[F64, F64, F64]:
    """Translation, rotation and scale of every node, so that each comes as near to skin_matrix @ bind as its
    parent allows: a child corrects the error that its parent leaves.
    """
    target = skin_matrix @ bind
    lead = target.shape[:-2]
    translation, rotation, scale = np.empty((*lead, 3)), np.empty((*lead, 4)), np.empty((*lead, 3))
    shown = np.empty_like(target)
    for level in levels(rig.parents):
        local, parent = target[..., level, :, :], rig.parents[level]
        if parent[0] >= 0:
            above = shown[..., parent, :, :]
            inverse = np.linalg.pinv(above[..., :3, :3])
            offset = local[..., :3, 3] - above[..., :3, 3]
            local = homogeneous(inverse @ local[..., :3, :3], (inverse @ offset[..., None])[..., 0])
        _check_fits(rig, level, local)
        linear = local[..., :3, :3]
        turn = _nearest_rotation(linear)
        translation[..., level, :] = local[..., :3, 3]
        rotation[..., level, :] = _quat_xyzw(turn)
        scale[..., level, :] = np.sum(turn * linear, axis=-2)
        own = local_transforms(translation[..., level, :], rotation[..., level, :], scale[..., level, :])
        shown[..., level, :, :] = own if parent[0] < 0 else shown[..., parent, :, :] @ own
    return translation, rotation, scale


def _check_fits(rig: Rig, level: I64, local: F64) -> None:
    fits = (np.abs(local) <= LARGEST).all(axis=(-1, -2)).reshape(-1, len(level)).all(axis=0)
    if not fits.all():
        field = f"joint {rig.joint_names[level[int(np.argmin(fits))]]}"
        raise AvatarError(
            "its node's transform does not fit float32; use smaller numbers in the pose", field=field
        )


def local_transforms(translation: F64, rotation_xyzw: F64, scale: F64) -> F64:
    """parent_from_node = T R S as matrices [..., 4, 4]."""
    turn = matrix_from_quat(np.roll(rotation_xyzw, 1, axis=-1))
    result: F64 = homogeneous(turn * scale[..., None, :], translation)
    return result


def _nearest_rotation(linear: F64) -> F64:
    """The rotation nearest to [..., 3, 3], by SVD; of a reflection that nearest to its negative, so that the scale
    takes the sign.
    """
    u, _, vt = np.linalg.svd(linear)
    result: F64 = u @ vt
    return result * np.where(np.linalg.det(result) < 0, -1.0, 1.0)[..., None, None]


def _quat_xyzw(rotation: F64) -> F64:
    """Unit (x, y, z, w); the first of w, x, y, z that is not 0 is positive, so that rounding flips no sign."""
    quat = quat_from_matrix(rotation)
    quat /= np.linalg.norm(quat, axis=-1, keepdims=True)
    first = np.argmax(np.abs(quat) > 1e-6, axis=-1)[..., None]
    quat *= np.where(np.take_along_axis(quat, first, axis=-1) < 0, -1.0, 1.0)
    result: F64 = np.roll(quat, -1, axis=-1)
    return result


def _continuous(quat: F64) -> F64:
    """[T, ..., 4] with signs such that neighbours in time have a dot product >= 0."""
    dot = np.sum(quat[1:] * quat[:-1], axis=-1, keepdims=True)
    quat[1:] *= np.cumprod(np.where(dot < 0, -1.0, 1.0), axis=0)
    return quat
