"""Gaussians in the tangent frames of triangles, as RGBAvatar trains them, and the same as skinning and deltas.

x = [T B N] (xyz + sum_b w_b xyz_b) + sum_c bary_c v_c;  q = quat([T B N]) (rot + sum_b w_b rot_b), normalised;
DC = f_dc + sum_b w_b f_dc_b. T and B follow the texture coordinates and each is made unit: the frame is not
orthogonal, and quat() of a turned frame is not quite the turned quat(). Scale and opacity are constant.
Source: model/binding.py and cuda_utils/face_tbn.cu of 27c2ba8.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from avatar_export.readers.rgbavatar.files import Model
from avatar_export.sparse import SparseRowsBuilder, no_shifts, sparse_rows
from avatar_runtime.avatar import F32, F64, U32, Blendshapes, Gaussians, Rig, SparseRows
from avatar_runtime.rotation import quat_from_matrix, quat_multiply

TINY = 1e-30
ROWS = 1024  # Gaussians at a time
STEP = 1.0  # of a weight: the slope of a frame is that of its chord from -1 to 1


@dataclass(frozen=True)
class Posed:
    """Gaussians of one pose."""

    mean: F64  # [N, 3]
    quat_wxyz: F64  # [N, 4] unit
    dc: F64  # [N, 3]


@dataclass(frozen=True)
class Binding:
    """A model on the triangles of its mesh."""

    model: Model
    triangles: U32  # [F, 3]
    uv_corners: F64  # [F, 3, 2]
    triangle: U32  # [N]

    def posed(self, vertices: F64, weights: F64) -> Posed:
        """The formulas above, on posed vertices [V, 3] with the weights [K] of the bases."""
        frame = tangent_frames(vertices[self.triangles], self.uv_corners)[self.triangle]
        mean, quat, dc = self.local(weights)
        return Posed(
            np.einsum("nij,nj->ni", frame, mean) + self._feet(vertices),
            _unit(quat_multiply(frame_quats(frame), quat)),
            dc,
        )

    def local(self, weights: F64) -> tuple[F64, F64, F64]:
        """(mean [N, 3], raw quaternion [N, 4], DC [N, 3]) in the frames, with the weights [K] of the bases."""
        g, m = self.model.gaussians, self.model
        return (
            g.mean + np.einsum("k,nki->ni", weights, m.mean_basis),
            g.quat_wxyz + np.einsum("k,nki->ni", weights, m.quat_basis),
            g.sh[:, 0] + np.einsum("k,nki->ni", weights, m.dc_basis),
        )

    def _feet(self, vertices: F64) -> F64:
        corner = vertices[self.triangles[self.triangle]]
        feet: F64 = np.einsum("nc,nci->ni", self.model.barycentric.astype(np.float64), corner)
        return feet


def tangent_frames(corners: F64, uv_corners: F64) -> F64:
    """[F, 3, 3] columns tangent, bitangent, normal of triangles [F, 3, 3] with texture coordinates [F, 3, 2]."""
    e1, e2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    d1, d2 = uv_corners[:, 1] - uv_corners[:, 0], uv_corners[:, 2] - uv_corners[:, 0]
    area = d1[:, 0] * d2[:, 1] - d1[:, 1] * d2[:, 0]
    side = np.where(area < 0, -1.0, 1.0)[:, None]
    tangent = side * (e1 * d2[:, 1:] - e2 * d1[:, 1:])
    bitangent = side * (e2 * d1[:, :1] - e1 * d2[:, :1])
    return np.stack([_unit(tangent), _unit(bitangent), _unit(np.cross(e1, e2))], axis=-1)


def frame_quats(frames: F64) -> F64:
    """Unit quaternions [..., 4] of frames [..., 3, 3] that need not be orthogonal."""
    return _unit(quat_from_matrix(frames))


def at_rest(binding: Binding, vertices: F64, weights: F64) -> Gaussians:
    """The Gaussians at rest, in mesh space."""
    frame = tangent_frames(vertices[binding.triangles], binding.uv_corners)[binding.triangle]
    _, quat, dc = binding.local(weights)
    posed = binding.posed(vertices, weights)
    return replace(
        binding.model.gaussians,
        mean=posed.mean.astype(np.float32),
        quat_wxyz=quat_multiply(frame_quats(frame), quat).astype(np.float32),
        sh=dc[:, None].astype(np.float32),
    )


def blendshapes(
    binding: Binding,
    rig: Rig,
    rest: F64,
    coefficients: F64,
    pose_coefficients: F64,
    thresholds: Mapping[str, float],
) -> Blendshapes:
    """What expressions and joints do to the Gaussians, to first order about the rest pose.

    rest [K]: weights of the bases at rest. coefficients [E, K]: how much an expression adds to them;
    pose_coefficients [9 C, K]: how much a pose feature does. A delta is that of the triangle's corners, of the frame
    (the chord from weight -1 to 1), and of the bases. Pose features move means only.
    """
    n, count, features = len(binding.triangle), len(coefficients), len(pose_coefficients)
    shapes: dict[str, tuple[int, dict[str, tuple[int, ...]]]] = {
        "geometry": (count, {"mean": (3,), "quat_wxyz": (4,)}),
        "appearance": (count, {"log_scale": (3,), "opacity_logit": (), "sh": (1, 3)}),
        "correctives": (features, {"mean": (3,)}),
    }
    built = {
        part: SparseRowsBuilder(n, columns, shape, {name: thresholds[name] for name in shape})
        for part, (columns, shape) in shapes.items()
    }
    deltas = _Deltas.of(binding, rig, rest, coefficients, pose_coefficients)
    for first in range(0, n, ROWS):
        for part, values in deltas.of_rows(slice(first, min(first + ROWS, n))).items():
            built[part].append(values)
    done = {part: builder.finish() for part, builder in built.items()}
    return Blendshapes(**done, late_morphs=no_shifts(n, of="mean"))


@dataclass(frozen=True)
class _Deltas:
    """What the deltas of all Gaussians are made of."""

    binding: Binding
    coefficients: F64  # [E, K]
    pose_coefficients: F64  # [9 C, K]
    morphs: F64
    correctives: F64
    slopes: tuple[F32, F32]
    pose_slopes: tuple[F32, F32]
    mean: F64  # [N, 3] at rest, in the frames of the triangles
    quat: F64  # [N, 4]
    frames: F64  # [F, 3, 3]

    @staticmethod
    def of(binding: Binding, rig: Rig, rest: F64, coefficients: F64, pose_coefficients: F64) -> _Deltas:
        vertices = rig.vertices.astype(np.float64)
        morphs, correctives = (_dense(s, "position") for s in (rig.morphs, rig.correctives))
        mean, quat, _ = binding.local(rest)
        return _Deltas(
            binding,
            coefficients,
            pose_coefficients,
            morphs,
            correctives,
            _slopes(binding, vertices, morphs),
            _slopes(binding, vertices, correctives),
            mean,
            quat,
            tangent_frames(vertices[binding.triangles], binding.uv_corners),
        )

    def of_rows(self, rows: slice) -> dict[str, dict[str, F64]]:
        """Part of the blendshapes -> values [B, columns, ...] of some Gaussians."""
        model, at, coefficients = self.binding.model, self.binding.triangle[rows], self.coefficients
        mean_basis, quat_basis, dc_basis = (
            part[rows].astype(np.float64) for part in (model.mean_basis, model.quat_basis, model.dc_basis)
        )
        block = _Block(
            at,
            self.binding.triangles[at],
            model.barycentric[rows].astype(np.float64),
            self.mean[rows],
            np.einsum("nij,nkj->nki", self.frames[at], mean_basis),
        )
        turn = np.broadcast_to(frame_quats(self.frames[at])[:, None], quat_basis.shape)
        own_turn = np.einsum("ek,nki->nei", coefficients, quat_multiply(turn, quat_basis))
        raw = np.moveaxis(self.slopes[1][:, at], 0, 1)
        frame_turn = quat_multiply(raw, np.broadcast_to(self.quat[rows][:, None], raw.shape))
        still = np.zeros((len(at), len(coefficients), 3))
        return {
            "geometry": {
                "mean": _moved(block, self.morphs, self.slopes[0], coefficients),
                "quat_wxyz": own_turn + frame_turn,
            },
            "appearance": {
                "log_scale": still,
                "opacity_logit": still[..., 0],
                "sh": np.einsum("ek,nki->nei", coefficients, dc_basis)[:, :, None],
            },
            "correctives": {
                "mean": _moved(block, self.correctives, self.pose_slopes[0], self.pose_coefficients)
            },
        }


@dataclass(frozen=True)
class _Block:
    """Some Gaussians, as `_moved` needs them."""

    triangle: U32  # [B]
    corner: U32  # [B, 3] vertices
    barycentric: F64  # [B, 3]
    mean: F64  # [B, 3] in their frames, at rest
    basis: F64  # [B, K, 3] in mesh space, at rest


def _moved(block: _Block, offsets: F64, slope: F32, factor: F64) -> F64:
    """[B, E, 3] how each column moves the means: by the corners, by the frame, and by the bases."""
    feet = np.einsum("nc,encj->nej", block.barycentric, offsets[:, block.corner])
    turned = np.einsum("enij,nj->nei", slope[:, block.triangle], block.mean)
    result: F64 = feet + turned + np.einsum("ek,nki->nei", factor, block.basis)
    return result


def skin(binding: Binding, rig: Rig) -> SparseRows:
    """Weights of the Gaussians: those of the corners of their triangles, barycentric."""
    weights = np.zeros((len(rig.vertices), rig.joint_count))
    weights[_rows(rig.skin), rig.skin.column] = rig.skin.values["weight"]
    mixed = np.einsum(
        "nc,ncj->nj",
        binding.model.barycentric.astype(np.float64),
        weights[binding.triangles[binding.triangle]],
    )
    mixed /= np.maximum(mixed.sum(axis=1, keepdims=True), TINY)
    return sparse_rows({"weight": mixed}, {"weight": 0.0})


def _slopes(binding: Binding, vertices: F64, offsets: F64) -> tuple[F32, F32]:
    """(frames [E, F, 3, 3], quaternions [E, F, 4]): how they change per weight of `offsets` [E, V, 3]."""
    faces = len(binding.triangles)
    slopes = np.zeros((len(offsets), faces, 3, 3), np.float32), np.zeros((len(offsets), faces, 4), np.float32)
    carrying = np.zeros(faces, bool)
    carrying[binding.triangle] = True
    for column, offset in enumerate(offsets):
        moved = np.flatnonzero(carrying & offset.any(axis=1)[binding.triangles].any(axis=1))
        at, uv = binding.triangles[moved], binding.uv_corners[moved]
        low, still, high = (tangent_frames((vertices + step * offset)[at], uv) for step in (-STEP, 0.0, STEP))
        slopes[0][column, moved] = (high - low) / (2 * STEP)
        turns = [_towards(frame_quats(frames), frame_quats(still)) for frames in (low, high)]
        slopes[1][column, moved] = (turns[1] - turns[0]) / (2 * STEP)
    return slopes


def _towards(quats: F64, goal: F64) -> F64:
    """The same rotations, with the signs nearer to `goal`."""
    signs = np.where(np.sum(quats * goal, axis=-1, keepdims=True) < 0, -1.0, 1.0)
    return quats * signs


def _dense(sparse: SparseRows, name: str) -> F64:
    """[columns, rows, 3]"""
    result = np.zeros((sparse.columns, sparse.rows, 3))
    result[sparse.column, _rows(sparse)] = sparse.values[name]
    return result


def _rows(sparse: SparseRows) -> U32:
    ptr = sparse.row_ptr.astype(np.int64)
    return np.repeat(np.arange(sparse.rows, dtype=np.uint32), ptr[1:] - ptr[:-1])


def _unit(v: F64) -> F64:
    result: F64 = v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), TINY)
    return result
