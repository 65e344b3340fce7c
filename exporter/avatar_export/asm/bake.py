"""An ASM face as a rig and clips without mixtures: weights are evaluated once, bones become joints."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.asm import maths
from avatar_export.asm.model import AsmFace, Take
from avatar_export.sparse import SparseRowsBuilder, no_shifts
from avatar_runtime.avatar import F32, F64, Clip, Rig, SparseRows

Array = npt.NDArray[Any]

# Smaller weights are dropped: a bone that moves by 100 mm moves their vertex by 0.1 micrometres.
LEAST_WEIGHT = 1e-6


def bake_rig(face: AsmFace) -> Rig:
    """The rig of a face: it rests in the person's neutral, its inverse bind matrices are those of the template.

    Weights below LEAST_WEIGHT are dropped and the others divided by their sum. Skin matrices at rest are not the
    identity: rest_local = M^l2p M(tau of the neutral), inverse_bind_matrix = B^-1.
    """
    template = face.template
    bind = maths.bind_matrices(template, face.binding)
    neutral = maths.pose_matrices(face.takes[0])[0]
    v, j = len(template.vertices), len(template.bone_names)
    return Rig(
        vertices=template.vertices,
        triangles=template.triangles,
        morphs=no_shifts(v),
        correctives=no_shifts(v),
        late_morphs=no_shifts(v),
        skin=_skin(face),
        joint_names=template.bone_names,
        parents=template.parents,
        rest_local=_affine32(maths.parent_from_bone(template, bind) @ neutral),
        inverse_bind_matrix=_affine32(np.linalg.inv(bind)),
        joint_basis=np.zeros((0, j, 3), np.float32),
        corrective_joints=np.zeros(0, np.int32),
        anchor_vertices=np.zeros(0, np.uint32),
    )


def bake_clips(face: AsmFace) -> tuple[Clip, ...]:
    """One clip for each take, the neutral last: joint_delta = M(tau of the neutral)^-1 M(tau).

    Scales, except those of the neutral, are rounded to half floats, the precision of a clip in UsdSkel. So every
    engine, every other reader and the runtime show the same.
    """
    neutral = face.takes[0]
    back = np.linalg.inv(maths.pose_matrices(neutral)[0])
    still = np.tile(np.eye(4), (1, len(back), 1, 1))
    others = (_clip(take, back @ maths.pose_matrices(with_half_scales(take))) for take in face.takes[1:])
    return (*others, _clip(neutral, still))


def with_half_scales(take: Take) -> Take:
    """The take with its scales rounded to half floats; scales outside of their range are not changed."""
    with np.errstate(over="ignore"):
        half = take.scale.astype(np.float16).astype(np.float64)
    return replace(take, scale=np.where(np.isfinite(half) & (half != 0), half, take.scale))


def _clip(take: Take, delta: F64) -> Clip:
    frames = len(delta)
    return Clip(
        take.name,
        float(take.fps),
        np.zeros((frames, 0), np.float32),
        np.zeros((frames, 0), np.float32),
        _affine32(delta),
        np.tile(np.eye(4, dtype=np.float32), (frames, 1, 1)),
    )


def _skin(face: AsmFace) -> SparseRows:
    builder = SparseRowsBuilder(
        len(face.template.vertices), len(face.template.bone_names), {"weight": ()}, {"weight": 0.0}
    )
    for rows in maths.row_blocks(face.template):
        weights = maths.mixture_weight_rows(face.template, face.binding, rows)
        weights[weights < LEAST_WEIGHT] = 0
        builder.append({"weight": weights / weights.sum(axis=1, keepdims=True)})
    return builder.finish()


def _affine32(matrix: Array) -> F32:
    with np.errstate(over="ignore"):  # an overflow becomes infinite, which the check of the avatar refuses
        single = matrix.astype(np.float32)
    single[..., 3, :] = (0, 0, 0, 1)
    return single
