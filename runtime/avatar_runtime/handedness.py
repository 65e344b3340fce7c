"""The same avatar in a left-handed frame: x negated, +Y up, the face along +Z.

In memory an avatar is right-handed; the files of a bundle for left-handed engines hold `mirrored(avatar)`.
S = diag(-1, 1, 1) takes either frame to the other. Only signs change, and for rotation rule triangle_frame the
order of a local quaternion's components, so mirroring twice gives back every bit. Names, weights and indices stay.

Triangles keep the order of their corners, since their frames depend on it. A cross product of mirrored vectors is -S
times the cross product: normals by formula point the other way, hence displacement changes its sign; the frame of rule
triangle_frame becomes F' = S F D with D = diag(1, -1, 1), hence offsets and rotations in it are mirrored by D.
SPEC.md section 15 has the table.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import (
    Avatar,
    Blendshapes,
    Clip,
    Driving,
    Embedding,
    Gaussians,
    Relight,
    Rig,
    Rules,
    SparseRows,
)
from avatar_runtime.light import Light
from avatar_runtime.pose import Pose
from avatar_runtime.rules import MIRRORED_SIGNS

HANDEDNESS = ("right", "left")
Signs = npt.NDArray[np.int8]  # a factor of int8 keeps the type of any float array
Array = npt.NDArray[Any]

POINT: Signs = np.array([-1, 1, 1], np.int8)  # S
QUAT: Signs = np.array([1, 1, -1, -1], np.int8)  # S R S turns by the same angle about -S axis
MATRIX3: Signs = np.outer(POINT, POINT)  # S M S
MATRIX4: Signs = np.outer([-1, 1, 1, 1], [-1, 1, 1, 1]).astype(np.int8)
TRIANGLE: Signs = np.array([1, -1, 1], np.int8)  # D
FEATURE: Signs = MATRIX3.reshape(9)  # pose feature 9 c + 3 r + s is entry (r, s) of R - I
ORDER = np.array([0, -1, 0, 1, -2, -1, 0, 1, 2, -3, -2, -1, 0, 1, 2, 3])  # m of SH coefficient l^2 + l + m
SH_IN_X: Signs = np.where(ORDER < 0, -1, 1).astype(np.int8) * np.where(ORDER % 2, -1, 1).astype(np.int8)
SH_IN_Y: Signs = np.where(ORDER < 0, -1, 1).astype(np.int8)
QUATERNION_SIGN = MIRRORED_SIGNS | {plain: other for other, plain in MIRRORED_SIGNS.items()}


def mirrored(avatar: Avatar) -> Avatar:
    """`avatar` in the other frame: with the mirrored pose it draws the mirror image of what `avatar` draws.

    Mirroring twice gives back every bit. Only `rules.quaternion_sign` largest_positive changes its name: which sign
    the largest component has depends on the frame.
    """
    b, rules = avatar.blendshapes, avatar.rules
    sh = sh_signs(rules, avatar.gaussians.sh.shape[1])
    sign = QUATERNION_SIGN.get(rules.quaternion_sign, rules.quaternion_sign)
    return replace(
        avatar,
        gaussians=_gaussians(avatar.gaussians, sh),
        rules=replace(rules, quaternion_sign=sign),
        blendshapes=Blendshapes(
            _sparse(b.geometry, {"mean": POINT, "quat_wxyz": QUAT}),
            _sparse(b.appearance, {"sh": sh[:, None]}),
            _correctives(b.correctives, "mean"),
            _sparse(b.late_morphs, {"mean": POINT}),
        ),
        rig=None if avatar.rig is None else _rig(avatar.rig),
        driving=_driving(avatar.driving),
        embedding=None if avatar.embedding is None else _embedding(avatar.embedding, rules),
        clips=tuple(_clip(clip) for clip in avatar.clips),
        relight=None if avatar.relight is None else _relight(avatar.relight),
    )


def mirrored_pose(pose: Pose) -> Pose:
    """`pose` for the mirrored avatar: every matrix M becomes S M S."""
    joints = {name: mirrored_matrices(np.asarray(delta)) for name, delta in pose.joints.items()}
    return replace(
        pose, joints=joints, world_from_avatar=mirrored_matrices(np.asarray(pose.world_from_avatar))
    )


def mirrored_points(points: Array) -> Array:
    """S p of points or vectors [..., 3]."""
    return _signed(points, POINT)


def mirrored_quats(quat_wxyz: Array) -> Array:
    """Quaternions [..., 4], of any length, of S R S for those of R: (w, x, -y, -z)."""
    return _signed(quat_wxyz, QUAT)


def mirrored_matrices(matrix: Array) -> Array:
    """S M S of [..., 3, 3], or of affine [..., 4, 4]."""
    return _signed(matrix, MATRIX3 if matrix.shape[-1] == 3 else MATRIX4)


def mirrored_boxes(boxes: Mapping[str, Mapping[str, Any]]) -> dict[str, dict[str, list[float]]]:
    """Boxes {"min", "max"} by name in the other frame: the ends in x change places and signs."""
    return {
        name: {
            "min": [-box["max"][0], box["min"][1], box["min"][2]],
            "max": [-box["min"][0], box["max"][1], box["max"][2]],
        }
        for name, box in boxes.items()
    }


def sh_signs(rules: Rules, coefficients: int) -> Signs:
    """Factors [K] of the SH coefficients.

    Each basis function is even or odd in x and in y: coefficient l^2 + l + m goes by cos(m phi) for m >= 0, by
    sin(-m phi) for m < 0; x -> -x is phi -> pi - phi, y -> -y is phi -> -phi. Colour is seen along R^T d: with
    R' = S R S the direction becomes S R^T d, with the frame S F D of a triangle D F^T d, so there it goes by y.
    """
    in_triangle = rules.rotation == "triangle_frame" and rules.sh_direction == "inverse_rotation"
    return (SH_IN_Y if in_triangle else SH_IN_X)[:coefficients]


def _signed(values: Array, signs: Signs) -> Array:
    result: Array = values * signs
    return result


def _gaussians(g: Gaussians, sh: Signs) -> Gaussians:
    return replace(
        g, mean=mirrored_points(g.mean), quat_wxyz=mirrored_quats(g.quat_wxyz), sh=_signed(g.sh, sh[:, None])
    )


def _sparse(sparse: SparseRows, signs: Mapping[str, Signs]) -> SparseRows:
    """Each attribute times its signs; attributes without signs are unchanged."""
    values = {name: _signed(v, signs[name]) if name in signs else v for name, v in sparse.values.items()}
    return replace(sparse, values=values)


def _correctives(sparse: SparseRows, attribute: str) -> SparseRows:
    """S times the delta, negated if its pose feature changes sign."""
    return _sparse(sparse, {attribute: FEATURE[sparse.column % 9, None] * POINT})


def _rig(rig: Rig) -> Rig:
    return replace(
        rig,
        vertices=mirrored_points(rig.vertices),
        morphs=_sparse(rig.morphs, {"position": POINT}),
        correctives=_correctives(rig.correctives, "position"),
        late_morphs=_sparse(rig.late_morphs, {"position": POINT}),
        rest_local=mirrored_matrices(rig.rest_local),
        inverse_bind_matrix=mirrored_matrices(rig.inverse_bind_matrix),
        joint_basis=mirrored_points(rig.joint_basis),
    )


def _embedding(e: Embedding, rules: Rules) -> Embedding:
    """Turns of vertices become S T S and local rotations S L S; those in a triangle's frame D L S.

    D S turns by pi about z, quaternion k: k (w, x, -y, -z) = (z, y, x, w).
    """
    in_triangle = rules.rotation == "triangle_frame"
    quat = e.local_quat_wxyz
    return replace(
        e,
        canonical_vertices=mirrored_points(e.canonical_vertices),
        displacement=-e.displacement,
        local_offset=_signed(e.local_offset, TRIANGLE),
        local_quat_wxyz=quat[:, ::-1].copy() if in_triangle else mirrored_quats(quat),
    )


def _relight(relight: Relight) -> Relight:
    x, y, z = relight.centre
    return replace(
        relight,
        normal=mirrored_points(relight.normal),
        ambient=_signed(relight.ambient, SH_IN_X[: len(relight.ambient), None]),
        centre=(-x, y, z),
    )


def mirrored_light(light: Light) -> Light:
    """The same light in the other frame."""
    lights = (replace(one, place=(-one.place[0], *one.place[1:])) for one in light.lights)
    return replace(
        light, ambient=_signed(light.ambient, SH_IN_X[: len(light.ambient), None]), lights=tuple(lights)
    )


def _driving(driving: Driving) -> Driving:
    """Rotation vectors are axial: their y and z change sign, x does not."""
    x, y, z = driving.head_pivot
    matrix = driving.matrix
    if matrix is not None:
        turns = [name.startswith("joint/") and name.endswith(("/y", "/z")) for name in driving.outputs]
        matrix = _signed(matrix, np.where(turns, -1, 1).astype(np.int8)[:, None])
    return replace(driving, matrix=matrix, head_pivot=(-x, y, z))


def _clip(clip: Clip) -> Clip:
    return replace(
        clip,
        joint_delta=mirrored_matrices(clip.joint_delta),
        world_from_avatar=mirrored_matrices(clip.world_from_avatar),
    )
