"""The difference between the mesh in an engine and the runtime's, measured over fixed poses, for the manifest."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.writers.engine_mesh import EngineMesh, Influences, engine_mesh
from avatar_export.writers.rig_poses import residual_poses
from avatar_runtime.avatar import F32, F64, Avatar, Rig
from avatar_runtime.engine_pose import (
    EnginePose,
    bind_nodes,
    engine_pose,
    local_transforms,
    node_transforms,
    rests_bound,
)
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import Pose, resolve
from avatar_runtime.rotation import homogeneous
from avatar_runtime.stages.joints import chain, pose_features
from avatar_runtime.stages.morph import morph
from avatar_runtime.stages.skin import skin
from avatar_runtime.stages.sparse import combine, gather

MICROMETRE = 3  # decimals of a millimetre; smaller values are rounding of float32


@np.errstate(over="ignore", invalid="ignore")  # refused below
def engine_residual(avatar: Avatar, influences: int = 4) -> dict[str, float | int]:
    """Largest distances in millimetres between vertices of the runtime's mesh and of rig.glb, over `poses` poses.

    rig.glb is posed by engine_pose, with `influences` (4 or 8) joints per vertex.

    `residual_mm` is the total; `truncation_mm` comes from fewer influences, `late_morph_mm` from late morphs that are
    skinned, `shear_mm` from shear that nodes cannot represent. All are 0 without a triangle or joint. `no_shear_mm`,
    only for a rig that does not rest in its binding pose: the additional error of an engine that composes
    translation, rotation and scale separately and so loses the shear of uneven scales (Unreal). Raises AvatarError
    without a rig and for one too large to pose, ValueError for another number of influences.
    """
    mesh = engine_mesh(avatar)
    assert avatar.rig is not None  # or engine_mesh would have raised
    worst = dict.fromkeys(("residual_mm", "truncation_mm", "late_morph_mm", "shear_mm"), 0.0)
    if not rests_bound(avatar.rig):
        worst["no_shear_mm"] = 0.0
    poses = list(residual_poses(avatar)) if len(mesh.vertices) and avatar.rig.joint_count else []
    part = _rows(avatar.rig, mesh)
    shown = mesh.influences(influences)
    for pose in poses:
        offsets = _offsets(avatar, part, shown, pose)
        for name in worst:
            offset = offsets[name]
            largest = float(np.sqrt(np.max(np.sum(offset * offset, axis=1))))
            if not np.isfinite(largest):
                message = "its posed vertices exceed float32; scale it to metres, or write no engine files"
                raise AvatarError(message, field="rig")
            worst[name] = max(worst[name], 1e3 * largest)
    return {**{name: round(value, MICROMETRE) for name, value in worst.items()}, "poses": len(poses)}


def _rows(rig: Rig, mesh: EngineMesh) -> Rig:
    """The rig with only the vertices of `mesh`."""
    return replace(
        rig,
        vertices=mesh.vertices,
        triangles=mesh.triangles,
        morphs=rig.morphs.take(mesh.vertex_id),
        correctives=rig.correctives.take(mesh.vertex_id),
        late_morphs=rig.late_morphs.take(mesh.vertex_id),
        skin=mesh.skin,
    )


def _offsets(avatar: Avatar, part: Rig, shown: Influences, pose: Pose) -> dict[str, F64]:
    """[v, 3] metres: offsets of the engine's vertices from the runtime's, in total and for each cause separately."""
    arrays = resolve(pose, avatar)
    true, _, _ = chain(part, arrays.expression_weights, arrays.joint_delta)
    nodes, back = engine_pose(avatar, pose), np.linalg.inv(bind_nodes(part))
    engine = node_transforms(part, nodes) @ back
    shape = morph(part, arrays.expression_weights, pose_features(part, arrays.joint_delta))
    late = combine(part.late_morphs, arrays.late_weights)["position"]
    runtime = skin(part, shape, true.astype(np.float32), arrays.late_weights)
    all_of_them = gather(part.skin, true[:, :3].astype(np.float32))
    lost = gather(part.skin, (engine - true)[:, :3].astype(np.float32))
    unsheared = _by_parts(part, nodes) @ back - engine
    return {
        "residual_mm": _apply(_blend(shown, engine), shape + late) - runtime,
        "truncation_mm": _apply(_blend(shown, true) - all_of_them, shape),
        "late_morph_mm": _apply(all_of_them, late) - all_of_them[..., 3] - late,
        "shear_mm": _apply(lost, shape),
        "no_shear_mm": _apply(gather(part.skin, unsheared[:, :3].astype(np.float32)), shape),
    }


def _by_parts(rig: Rig, pose: EnginePose) -> F64:
    """mesh_from_joint [J, 4, 4] with rotations and scales multiplied separately, so without shear."""
    turn = local_transforms(np.zeros_like(pose.translation), pose.rotation_xyzw, np.ones_like(pose.scale))
    scale, place = pose.scale.copy(), pose.translation.copy()
    for joint, parent in enumerate(rig.parents):
        if parent >= 0:
            place[joint] = turn[parent, :3, :3] @ (scale[parent] * place[joint]) + place[parent]
            turn[joint] = turn[parent] @ turn[joint]
            scale[joint] = scale[parent] * scale[joint]
    return homogeneous(turn[:, :3, :3] * scale[:, None, :], place)


def _blend(shown: Influences, matrix: F64) -> F64:
    """[v, 3, 4]: the weighted sum of the influences' matrices [J, 4, 4]."""
    total = np.zeros((len(shown.weights), 3, 4))
    for k in range(shown.weights.shape[1]):
        total += shown.weights[:, k, None, None] * matrix[shown.joints[:, k], :3]
    return total


def _apply(matrix: npt.NDArray[Any], points: F32) -> F64:
    """[v, 3]: matrix [v, 3, 4] of points [v, 3]."""
    result: F64 = (matrix[..., :3] @ points[..., None].astype(np.float64))[..., 0] + matrix[..., 3]
    return result
