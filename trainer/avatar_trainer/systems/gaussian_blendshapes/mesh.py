"""How the triangles of a body mesh move from its neutral shape to each expression: init terms and masks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_runtime import F64, I64, Rig
from avatar_runtime import rotation as runtime_rotation
from avatar_runtime.stages import groups

# Mask of the released code, metres: f(tau) = 0, f(full) = 1, no upper limit (train.py:28-42).
FIXED_NONE, FIXED_FULL = 0.1 * 0.000237277025008, 0.005703532602638
PAPER_NONE = 1e-5  # metres, epsilon of Eq. 2
NORMAL_FLOOR = 1e-20


@dataclass(frozen=True)
class Expressions:
    """The first K expressions of a rig, by triangle."""

    vertices: F64  # [V, 3] neutral, metres
    triangles: I64  # [F, 3]
    offsets: F64  # [K, V, 3] as the rig has them

    @staticmethod
    def of(rig: Rig, count: int) -> Expressions:
        """The expressions of a rig that get Gaussian blendshapes."""
        morphs, ptr = rig.morphs, rig.morphs.row_ptr.astype(np.int64)
        offsets = np.zeros((count, len(rig.vertices), 3))
        row = np.repeat(np.arange(morphs.rows), np.diff(ptr))
        used = morphs.column < count
        offsets[morphs.column[used], row[used]] = morphs.values["position"][used]
        return Expressions(rig.vertices.astype(np.float64), rig.triangles.astype(np.int64), offsets)

    @property
    def count(self) -> int:
        """K."""
        return len(self.offsets)

    def moves(self, expression: int) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Whether an expression moves a corner of each triangle, [F]."""
        moved = (self.offsets[expression] != 0).any(axis=1)
        result: np.ndarray[tuple[int], np.dtype[np.bool_]] = moved[self.triangles].any(axis=1)
        return result

    def displacement(self, expression: int, anchors: I64, ignored: I64) -> F64:
        """How far each triangle moves [F], metres: the length of its corners' mean offset.

        The whole head's own motion is taken out first, by the rigid fit of the `anchors` (vertices at the back
        of the head; none: no fit), and the `ignored` vertices of the neck count as still (train.py:28-42).
        """
        moved = self.vertices + self.offsets[expression]
        if len(anchors):
            fit = groups.anchor_transform(
                moved.astype(np.float32),
                anchors.astype(np.uint32),
                self.vertices[anchors].astype(np.float32),
                "unique",
            ).astype(np.float64)
            moved = moved @ fit[:3, :3].T + fit[:3, 3]
        offset = moved - self.vertices
        offset[ignored] = 0
        result: F64 = np.linalg.norm(offset[self.triangles].mean(axis=1), axis=1)
        return result


def mask_of(displacement: F64, rule: str) -> F64:
    """max(f(d), 0) of Eq. 2 for one expression's triangles [F].

    `fixed`: the released code's two constants for every expression. `per_blendshape`: the paper's epsilon and
    the largest displacement of this expression; an expression that moves nothing has no mask.
    """
    if rule == "fixed":
        none, full = FIXED_NONE, FIXED_FULL
    else:
        none, full = PAPER_NONE, float(displacement.max(initial=0))
        if full <= none:
            return np.zeros_like(displacement)
    return np.maximum((displacement - none) / (full - none), 0)


def triangle_frames(corner: F64) -> F64:
    """[N, 3, 3]: columns two edges and the normal divided by the root of its length; corner [N, 3, 3]."""
    e1, e2 = corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]
    normal = np.cross(e1, e2)
    normal /= np.sqrt(np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), NORMAL_FLOOR))
    return np.stack([e1, e2, normal], axis=-1)


def triangle_motion(before: F64, after: F64, position: F64, rule: str) -> tuple[F64, F64]:
    """The motion of a point on a triangle (corners [N, 3, 3]): shift [N, 3], rotation [N, 3, 3].

    `affine`: (Q - I) x + t with the affine deformation gradient Q (Sumner and Popovic 2004, section 3), which
    the released code takes (face_gs_model.py:670). `rotation`: the paper's "rotation component ... applied to the
    position": R turns the point about the triangle's centroid, which moves as the triangle does. The rotation is the
    released code's in both cases: three steps towards the polar factor, inexact for a strongly sheared triangle.
    """
    gradient = triangle_frames(after) @ np.linalg.inv(triangle_frames(before))
    with np.errstate(divide="ignore", invalid="ignore"):
        rotation = runtime_rotation.polar(gradient)
    rotation[~np.isfinite(rotation).all(axis=(1, 2))] = np.eye(3)  # the triangle collapses
    if rule == "affine":
        linear, old, new = gradient, before[:, 0], after[:, 0]
    else:
        linear, old, new = rotation, before.mean(axis=1), after.mean(axis=1)
    moved = np.einsum("nij,nj->ni", linear, position - old) + new
    return moved - position, rotation


def quaternion_shift(rotation: F64) -> F64:
    """The rotation's quaternion minus (1, 0, 0, 0), [N, 4] (face_gs_model.py:670)."""
    result: F64 = runtime_rotation.quat_from_matrix(rotation) - (1.0, 0.0, 0.0, 0.0)
    return result
