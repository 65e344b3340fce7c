"""Checks an embedding and a clip; part of `check_avatar`."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import Avatar, Clip, Embedding
from avatar_runtime.checks.arrays import check_f32, expect
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rules import NORMAL_POSITIONS

BARYCENTRIC_SUM = 1e-4  # largest difference of a row's sum from 1
BARYCENTRIC_LEAST = -1e-3  # SplattingAvatar's triangle walk leaves weights down to this
RATES = (1e-3, 1e4)  # frames a second of a clip
RIGID = 1e-3  # largest difference of R R^T from the identity


def check_embedding(avatar: Avatar, e: Embedding) -> None:
    """Raise AvatarError unless arrays and indices fit each other and the rig has the same mesh."""
    n, v, f = avatar.gaussians.count, len(e.canonical_vertices), len(e.triangles)
    check_f32("embedding.canonical_vertices", e.canonical_vertices, (v, 3))
    check_f32("embedding.barycentric", e.barycentric, (n, 3))
    check_f32("embedding.local_quat_wxyz", e.local_quat_wxyz, (n, 4))
    by_normal = avatar.rules.position in NORMAL_POSITIONS
    check_f32("embedding.displacement", e.displacement, (n,) if by_normal else (0,))
    check_f32("embedding.local_offset", e.local_offset, (0, 3) if by_normal else (n, 3))
    for name, index, shape, limit, of in (
        ("triangles", e.triangles, (f, 3), v, "vertices"),
        ("triangle", e.triangle, (n,), f, "triangles"),
    ):
        expect(index.dtype == np.uint32 and index.shape == shape, f"embedding.{name}", f"u32{shape}", index)
        if index.size and int(index.max()) >= limit:
            row = int(np.argmax((index >= limit).reshape(len(index), -1).any(axis=1)))
            raise AvatarError(
                f"is {index[row]}, but the mesh has {limit} {of}", field=f"embedding.{name}[{row}]"
            )
    if avatar.rig and not (
        len(avatar.rig.vertices) == v and np.array_equal(avatar.rig.triangles, e.triangles)
    ):
        raise AvatarError("has other vertices or triangles than the embedding's mesh", field="rig.triangles")


def check_places(e: Embedding) -> None:
    """Raise AvatarError unless every Gaussian lies on a triangle with an area, by weights that add up to 1."""
    sums = e.barycentric.sum(axis=1, dtype=np.float64)
    bad = (np.abs(sums - 1) > BARYCENTRIC_SUM) | (e.barycentric < BARYCENTRIC_LEAST).any(axis=1)
    if bad.any():
        row = int(np.argmax(bad))
        raise AvatarError(
            f"is {e.barycentric[row].tolist()}; weights must add up to 1 and not lie below {BARYCENTRIC_LEAST}",
            field=f"embedding.barycentric[{row}]",
        )
    corner = e.canonical_vertices.astype(np.float64)[e.triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.abs(across).max(axis=1, initial=0)
    flat = area[e.triangle] == 0
    if flat.any():
        row = int(np.argmax(flat))
        raise AvatarError(
            f"lies on canonical triangle {int(e.triangle[row])}, which has no area; drop the row or repair the mesh",
            field=f"embedding.triangle[{row}]",
        )


def check_clip(clip: Clip, expressions: int, late: int, joints: int) -> None:
    """Raise AvatarError unless the clip has frames, a rate and finite arrays of the avatar's shapes."""
    where, t = f"clips.{clip.name}", clip.frames
    if t == 0:
        raise AvatarError("has no frame", field=where)
    if not RATES[0] <= clip.fps <= RATES[1]:
        raise AvatarError(f"fps is {clip.fps}; must be {RATES[0]:g} to {RATES[1]:g}", field=where)
    check_f32(f"{where}.expression_weights", clip.expression_weights, (t, expressions))
    check_f32(f"{where}.late_weights", clip.late_weights, (t, late))
    check_f32(f"{where}.joint_delta", clip.joint_delta, (t, joints, 4, 4))
    check_f32(f"{where}.world_from_avatar", clip.world_from_avatar, (t, 4, 4))
    for name, matrix in (("joint_delta", clip.joint_delta), ("world_from_avatar", clip.world_from_avatar)):
        if not (matrix[..., 3, :] == (0, 0, 0, 1)).all():
            raise AvatarError("holds a matrix that is not affine", field=f"{where}.{name}")
    turn = clip.world_from_avatar[:, :3, :3].astype(np.float64)
    with np.errstate(over="ignore", invalid="ignore"):
        off = -np.eye(3) + np.zeros((t, 1, 1))
        for k in range(3):  # one by one, as all readers add
            off += turn[:, :, None, k] * turn[:, None, :, k]
        off = np.abs(off).max(axis=(1, 2))
        rigid = (off <= RIGID) & (np.linalg.det(turn) > 0)
    if not rigid.all():
        message = "is not rigid: a rotation and a translation move the avatar as a whole"
        raise AvatarError(message, field=f"{where}.world_from_avatar[{int(np.argmin(rigid))}]")
