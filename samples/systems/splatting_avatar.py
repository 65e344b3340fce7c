"""The content of a trained SplattingAvatar: Gaussians embedded in a triangle mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.rotation import quat_from_matrix
from avatar_trainer.head import Mesh, unit

Array = npt.NDArray[Any]

SH_C0 = 0.28209479177387814
AREA_DAMPING = 1e-4  # squared training units, added to both areas of a triangle
# Training leaves some samples just outside their triangle: how many of them, and how far.
OUTSIDE_SHARE, OUTSIDE = 0.01, 5e-4
QUATERNION_LENGTH = (0.4, 3.0)


@dataclass(frozen=True)
class Layer:
    """N Gaussians on a posed mesh, before they become a checkpoint; metres."""

    face: Array  # i64 [N]
    bary: Array  # f64 [N, 3]
    displacement: Array  # f64 [N], along the interpolated normal
    frame: Array  # f64 [N, 3, 3], columns: the splat's axes
    sigma: Array  # f64 [N, 3], deviations along them
    colour: Array  # f64 [N, 3], display sRGB, 0..1
    opacity: Array  # f64 [N], 0..1


@dataclass(frozen=True)
class Embedded:
    """A checkpoint's arrays: V vertices, F triangles, N Gaussians, training units."""

    vertices: Array  # f64 [V, 3], the first frame's mesh, rounded to six decimals
    triangles: Array  # i64 [F, 3]
    face: Array  # i64 [N], the triangle of each Gaussian
    bary: Array  # f32 [N, 3]
    displacement: Array  # f32 [N]
    rotation: Array  # f32 [N, 4] wxyz, any length, any sign
    log_scale: Array  # f32 [N, 3]
    opacity_logit: Array  # f32 [N]
    sh: Array  # f32 [N, (degree + 1)^2, 3]

    @property
    def xyz(self) -> Array:
        """Where the Gaussians are on that mesh [N, 3], f64."""
        return positions(Mesh(self.vertices, self.triangles), self.face, self.bary, self.displacement)


def joined(layers: Sequence[Layer]) -> Layer:
    """The rows of all layers, in order."""
    return Layer(*(np.concatenate([getattr(layer, f.name) for layer in layers]) for f in fields(Layer)))


def positions(mesh: Mesh, face: Array, bary: Array, displacement: Array) -> Array:
    """Points [N, 3]: the weighted corners, and `displacement` along the unit interpolated normal."""
    at = mesh.triangles[face]
    normal = unit(np.einsum("nc,ncx->nx", bary, mesh.vertex_normals[at]))
    foot = np.einsum("nc,ncx->nx", bary, mesh.vertices[at])
    result: Array = foot + displacement[:, None] * normal
    return result


def rounded(mesh: Mesh, units_per_metre: float) -> Mesh:
    """The mesh in training units, rounded to the six decimals of the text."""
    return Mesh(np.round(mesh.vertices * units_per_metre, 6), mesh.triangles)


def embed(
    canonical: Mesh,
    layer: Layer,
    log_scale: Array,
    units_per_metre: float,
    opacity_logit: Array,
    rest: Array,
    seed: int,
) -> Embedded:
    """The checkpoint of `layer`, whose frames are those of the mesh `canonical` (training units, six decimals).

    `log_scale` [N, 3] is in training units; `rest` [N, K - 1, 3] are the SH coefficients beyond the first.
    """
    rng = np.random.default_rng(seed)
    n = len(layer.face)
    sign = rng.choice((-1.0, 1.0), n)
    rotation = quat_from_matrix(layer.frame) * (sign * rng.uniform(*QUATERNION_LENGTH, n))[:, None]
    dc = (layer.colour - 0.5) / SH_C0
    return Embedded(
        canonical.vertices,
        canonical.triangles,
        layer.face,
        stored_bary(layer.bary, rng),
        (layer.displacement * units_per_metre).astype(np.float32),
        rotation.astype(np.float32),
        log_scale.astype(np.float32),
        opacity_logit.astype(np.float32),
        np.concatenate([dc[:, None], rest], axis=1).astype(np.float32),
    )


def stored_bary(bary: Array, rng: np.random.Generator) -> Array:
    """Weights [N, 3] as trained: u, v and 1 - u - v in float32, a few of them a little below 0."""
    n = len(bary)
    outside = np.flatnonzero(rng.random(n) < OUTSIDE_SHARE)
    corner = rng.integers(0, 3, len(outside))
    moved = bary.copy()
    below = -rng.uniform(0, OUTSIDE, len(outside))
    moved[outside, (corner + 1) % 3] += moved[outside, corner] - below
    moved[outside, corner] = below
    u, v = moved[:, :2].astype(np.float32).T
    return np.stack([u, v, np.float32(1) - u - v], axis=1)


def fit_log_scale(wanted: Array, ratio: Array, cover: Array, spill: Array) -> Array:
    """The log scales [N, 3] that training finds if `with_mesh_scaling` multiplies them by the area ratio.

    `wanted` [T, N, 3]: the logarithm that each of T frames needs; `ratio` [T, N]: its factor there. The result
    lies between the least squares over the frames (`cover` [N] 0) and the smallest value that is too small in
    no frame (`cover` 1); in no frame is it too large by more than `spill` [N].
    """
    a = ratio[:, :, None]
    best = np.sum(a * wanted, axis=0) / np.sum(a * a, axis=0)
    widest = np.max(wanted / a, axis=0)
    most = np.min((wanted + spill[:, None]) / a, axis=0)
    result: Array = np.minimum(best + cover[:, None] * (widest - best), most)
    return result


def area_ratio(canonical: Mesh, posed: Mesh, face: Array) -> Array:
    """(posed area + damping) / (canonical area + damping) of the triangles `face` [N]; both in training units."""
    now, before = (triangle_areas(mesh)[face] for mesh in (posed, canonical))
    result: Array = (now + AREA_DAMPING) / (before + AREA_DAMPING)
    return result


def triangle_areas(mesh: Mesh) -> Array:
    """Areas [F]."""
    corner = mesh.vertices[mesh.triangles]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    result: Array = np.linalg.norm(across, axis=1) / 2
    return result
