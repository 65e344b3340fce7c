"""Variants of the small avatar for tests of engine files, and the oracle's pose of what is written."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.writers.rig_glb import rig_glb
from avatar_runtime.avatar import Avatar, Rig, SparseRows
from avatar_runtime.engine_pose import EnginePose, target_names
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from tests.avatars import JOINTS, full_avatar
from tests.oracles.gltf_pose import File, State

Array = npt.NDArray[Any]
# The avatars are 0.2 m in size: float32 rounds to 1e-8 there, and sums of a dozen terms lose a few times that.
EXACT = 2e-7


def written(avatar: Avatar, influences: int = 4) -> bytes:
    pieces = rig_glb(avatar, influences)
    assert pieces is not None
    return b"".join(pieces)


def rig_of(avatar: Avatar) -> Rig:
    assert avatar.rig is not None
    return avatar.rig


def with_rig(avatar: Avatar, **fields: Any) -> Avatar:
    return replace(avatar, rig=replace(rig_of(avatar), **fields))


def dense(rows: SparseRows, name: str) -> Array:
    """[rows, columns, ...] of an attribute."""
    values = rows.values[name]
    found = np.zeros((rows.rows, rows.columns, *values.shape[1:]), values.dtype)
    found[np.repeat(np.arange(rows.rows), np.diff(rows.row_ptr.astype(int))), rows.column] = values
    return found


def dense_weights(rig: Rig) -> Array:
    return dense(rig.skin, "weight").astype(np.float64)


def sparse(dense: Array, name: str) -> SparseRows:
    """SparseRows of [R, C] weights."""
    row, column = np.nonzero(dense)
    ptr = np.searchsorted(row, np.arange(len(dense) + 1)).astype(np.uint32)
    return SparseRows(
        ptr, column.astype(np.uint16), {name: dense[row, column].astype(np.float32)}, dense.shape[1]
    )


def strongest(avatar: Avatar, most: int) -> Avatar:
    """The avatar whose vertices keep their `most` strongest joints."""
    dense = dense_weights(rig_of(avatar))
    dense[np.arange(len(dense))[:, None], np.argsort(-dense, axis=1)[:, most:]] = 0
    return with_rig(avatar, skin=sparse(dense / dense.sum(axis=1, keepdims=True), "weight"))


def without_late(pose: Pose) -> Pose:
    return replace(pose, eyelids={})


def state_of(avatar: Avatar, pose: EnginePose) -> State:
    """The nodes by name; the weights by target_names."""
    return State(
        {
            "avatar_root": pose.root_translation.tolist(),
            **dict(zip(JOINTS, pose.translation.tolist(), strict=True)),
        },
        {
            "avatar_root": pose.root_rotation_xyzw.tolist(),
            **dict(zip(JOINTS, pose.rotation_xyzw.tolist(), strict=True)),
        },
        dict(zip(JOINTS, pose.scale.tolist(), strict=True)),
        dict(zip(target_names(avatar), pose.weights.tolist(), strict=True)),
    )


def runtime_mesh(avatar: Avatar, file: File, pose: Pose) -> Array:
    """The runtime's vertices in the order of the file, in world space, float64."""
    rows = file.attribute("_VERTEX_ID")[:, 0].astype(np.int64)
    mesh = Player(avatar).mesh(pose).astype(np.float64)[rows]
    world: Array = mesh @ pose.world_from_avatar[:3, :3].T + pose.world_from_avatar[:3, 3]
    return world


def distance(a: Array, b: Array) -> float:
    return float(np.linalg.norm(a - b, axis=1).max())


def scaled_at_rest(avatar: Avatar, scale: tuple[float, float, float]) -> Avatar:
    """The avatar whose neck has this scale at rest."""
    rig = rig_of(avatar)
    local = rig.rest_local.astype(np.float64)
    local[1] = local[1] @ np.diag([*scale, 1.0])
    world = local.copy()
    for j, parent in enumerate(rig.parents):
        if parent >= 0:
            world[j] = world[parent] @ local[j]
    inverse = np.linalg.inv(world).astype(np.float32)
    return with_rig(avatar, rest_local=local.astype(np.float32), inverse_bind_matrix=inverse)


def grid_avatar(vertices: int, joints: int) -> Avatar:
    """`full_avatar` on a strip of `vertices` vertices and `joints` root joints, without morphs and clips."""
    avatar = replace(full_avatar(), clips=())
    rig = rig_of(avatar)
    at = np.arange(vertices)
    empty = {
        name: SparseRows.empty(vertices, getattr(rig, name).columns, {"position": (3,)})
        for name in ("morphs", "correctives", "late_morphs")
    }
    eye = np.tile(np.eye(4, dtype=np.float32), (joints, 1, 1))
    return with_rig(
        avatar,
        vertices=np.stack([at, at % 2, at % 3], axis=1).astype(np.float32),
        triangles=np.stack([at[:-2], at[1:-1], at[2:]], axis=1).astype(np.uint32),
        skin=SparseRows(
            np.arange(vertices + 1, dtype=np.uint32),
            (at % joints).astype(np.uint16),
            {"weight": np.ones(vertices, np.float32)},
            joints,
        ),
        joint_names=tuple(f"j{k}" for k in range(joints)),
        parents=np.full(joints, -1, np.int32),
        rest_local=eye,
        inverse_bind_matrix=eye,
        joint_basis=np.zeros((4, joints, 3), np.float32),
        **empty,
    )
