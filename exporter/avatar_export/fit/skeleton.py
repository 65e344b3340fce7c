"""Is a rig the size of a human, and do its joints lie where they should?"""

from __future__ import annotations

import numpy as np

from avatar_export.fit.surface import Mesh, size_of
from avatar_export.notes.note import Note, doubt
from avatar_runtime.avatar import F64, Rig

HEADS, BODIES, EITHER = (0.15, 0.8), (0.4, 2.5), (0.15, 2.5)  # metres of height, in a pose at rest
HEAD_JOINTS, BODY_JOINTS = 5, 24  # of FLAME and SMPL
OUTSIDE = 0.25  # of the mesh's diagonal
SIDES = (("leftEye", "rightEye"), ("left_hip", "right_hip"), ("left_shoulder", "right_shoulder"))


def heights(joints: int | None) -> tuple[float, float]:
    """The usual heights of a human mesh with so many joints: a head (FLAME), a body (SMPL), or either."""
    return {HEAD_JOINTS: HEADS, BODY_JOINTS: BODIES}.get(joints or 0, EITHER)


def inhuman(vertices: F64, joints: int | None) -> float | None:
    """The height of the mesh [V, 3] with so many joints if no human head or body has it, metres; else None."""
    height = float(np.ptp(vertices[:, 1])) if len(vertices) else 0.0
    low, high = heights(joints)
    return None if low <= height <= high else height


def skeleton_doubts(rig: Rig, mesh: Mesh, file: str) -> list[Note]:
    """Doubts about the size of the `mesh` of a rig, which is in metres if its `file` is, and about its joints."""
    height = inhuman(mesh.used, rig.joint_count)
    return [
        *([] if height is None else [doubt("not_human_if_metres", height=height, file=file)]),
        *joint_faults(rig, mesh),
    ]


def joint_places(rig: Rig) -> F64:
    """[J, 3] the joints in the binding pose, mesh space."""
    places: F64 = np.linalg.inv(rig.inverse_bind_matrix.astype(np.float64))[:, :3, 3]
    return places


def joint_faults(rig: Rig, mesh: Mesh) -> list[Note]:
    """A doubt about a joint far outside the mesh that it moves, or else about a left joint on the right side."""
    places, used = joint_places(rig), mesh.used
    moving = np.unique(rig.skin.column[rig.skin.values["weight"] > 0])
    grown = OUTSIDE * size_of(used)
    off = np.maximum(used.min(axis=0) - grown - places, places - used.max(axis=0) - grown).max(axis=1)
    for joint in moving.tolist():
        if off[joint] > 0:
            return [doubt("joint_outside", joint=rig.joint_names[joint], far=off[joint] + grown)]
    names = list(rig.joint_names)
    for left, right in SIDES:
        if left in names and right in names and places[names.index(left), 0] < places[names.index(right), 0]:
            return [doubt("joints_exchanged", left=left, right=right)]
    return []
