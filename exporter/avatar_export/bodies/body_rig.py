"""A body model with the shape of one subject, baked to a Rig that plays without the body model."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.bodies.body_model import BodyModel
from avatar_export.bodies.subject_files import read_static_offset
from avatar_export.formats.casts import as_float32
from avatar_export.sparse import no_shifts, sparse_rows
from avatar_runtime.avatar import F32, F64, Rig, SparseRows
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rotation import translation_matrix

Array = npt.NDArray[Any]


def bake_rig(
    body: BodyModel,
    shape: Array | None = None,
    late_morphs: Mapping[str, F32] | None = None,
    anchor_faces: Array | None = None,
) -> Rig:
    """The Rig of `body` with the identity `shape` (coefficients; missing ones are 0).

    template = v_template + identity_dirs shape; rest joints = J_regressor template; joint_basis = J_regressor
    expression_dirs: FLAME's joints move with identity and expression, before pose correctives.
    `late_morphs`: name -> [V, 3], in this order. `anchor_faces`: triangles whose vertices carry anchored groups,
    repeats included. Raises AvatarError if a morph, face or coefficient does not fit the body model.
    """
    vertices = shaped_template(body, shape)
    joints = body.joint_regressor.astype(np.float64) @ vertices  # [J, 3]
    basis = np.tensordot(body.joint_regressor, body.expression_dirs, (1, 0))  # [J, 3, K]
    offsets = joints - np.where(body.parents[:, None] < 0, 0, joints[body.parents])
    return Rig(
        vertices=as_float32(vertices),
        triangles=body.triangles,
        morphs=_by_vertex(np.moveaxis(body.expression_dirs, 2, 1)),
        correctives=_by_vertex(np.moveaxis(body.posedirs, 2, 1)),
        late_morphs=_late(body, late_morphs or {}),
        skin=sparse_rows({"weight": body.skin_weights}, {"weight": 0.0}),
        joint_names=body.joint_names,
        parents=body.parents,
        rest_local=as_float32(translation_matrix(offsets)),
        inverse_bind_matrix=as_float32(translation_matrix(-joints)),
        joint_basis=np.ascontiguousarray(np.moveaxis(basis, 2, 0), np.float32),
        corrective_joints=np.arange(1, len(body.parents), dtype=np.int32),
        anchor_vertices=_anchors(body, anchor_faces),
    )


def with_static_offset(body: BodyModel, identity: Path | None) -> BodyModel:
    """`body` with the static offset of an identity file in its template; `body` itself without file or offset.

    Joints follow the template, as in VHAP and GaussianAvatars. Raises AvatarError as `read_static_offset` does.
    """
    offset = None
    if identity is not None and identity.is_file():
        offset = read_static_offset(identity, body.vertex_count)
    return body if offset is None else replace(body, v_template=body.v_template + offset)


def shaped_template(body: BodyModel, shape: Array | None) -> F64:
    """Template vertices [V, 3] of a subject, before any expression or pose.

    Raises AvatarError for a non-zero coefficient without a direction in the body model.
    """
    coefficients = np.zeros(0) if shape is None else np.asarray(shape, np.float64).reshape(-1)
    known = body.identity_dirs.shape[2]
    if coefficients[known:].any():
        raise AvatarError(
            f"has {len(coefficients)} coefficients, but the body model has {known} identity directions: "
            "the shape was fitted with another body model",
            field="shape",
        )
    coefficients = coefficients[:known]
    result: F64 = body.v_template + body.identity_dirs[:, :, : len(coefficients)] @ coefficients
    return result


def _by_vertex(dirs: Array) -> SparseRows:
    return sparse_rows({"position": dirs}, {"position": 0.0})


def _late(body: BodyModel, morphs: Mapping[str, F32]) -> SparseRows:
    for name, offsets in morphs.items():
        if offsets.shape != (body.vertex_count, 3):
            raise AvatarError(
                f"has shape {list(offsets.shape)}, the body model has {body.vertex_count} vertices",
                field=name,
            )
    if not morphs:
        return no_shifts(body.vertex_count)
    return _by_vertex(np.stack(list(morphs.values()), axis=1))


def _anchors(body: BodyModel, faces: Array | None) -> npt.NDArray[np.uint32]:
    if faces is None:
        return np.zeros(0, np.uint32)
    faces = np.asarray(faces)
    outside = (faces < 0) | (faces >= len(body.triangles))
    if outside.any():
        row = int(np.argmax(outside))
        raise AvatarError(
            f"[{row}] = {int(faces[row])}, but the body model has {len(body.triangles)} triangles",
            field="anchor faces",
        )
    return body.triangles[faces].reshape(-1)
