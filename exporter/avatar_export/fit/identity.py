"""Would the Gaussians lie on another identity of the same body model?"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from avatar_export.bodies.body_model import BodyModel
from avatar_export.bodies.body_rig import shaped_template
from avatar_export.fit.known import TIMES
from avatar_export.fit.surface import SEARCHED, Mesh
from avatar_runtime.avatar import F64

# So many times nearer is enough for an identity that is at hand; a fitted one needs known.TIMES.
NAMED_TIMES = 2.0
FITTED = 20  # coefficients; the first ones hold most of a face's shape
STEPS = 4
FIT_POINTS = 500
RIDGE = 1e-3  # of the mean square of a coefficient's effect, per point
LEAST_GAIN = 1e-3  # of the mesh's diagonal; a smaller gain is not worth a warning


def better_identity(
    points: F64, body: BodyModel, shape: F64 | None, others: Mapping[str, F64]
) -> tuple[str | None, F64, float] | None:
    """(name in `others`, None for a fitted one; its coefficients; median distance) of an identity on which `points`
    [N, 3] lie several times nearer (in the median) than on `shape`; None without one."""
    sample = points[np.unique(np.linspace(0, len(points) - 1, min(FIT_POINTS, len(points))).astype(np.int64))]
    own = np.zeros(0) if shape is None else shape
    base = _median(sample[:SEARCHED], _mesh(body, own))
    gain = LEAST_GAIN * float(np.linalg.norm(np.ptp(body.v_template, axis=0)))
    if base <= gain:
        return None
    spread = sample[:: max(1, len(sample) // SEARCHED)]
    named = {name: c for name, c in others.items() if not c[body.identity_dirs.shape[2] :].any()}
    tried = [(_median(spread, _mesh(body, c)), name) for name, c in named.items()]
    if tried and min(tried)[0] <= min(base / NAMED_TIMES, base - gain):
        median, name = min(tried)
        return name, named[name], median
    if not body.identity_dirs.shape[2]:
        return None
    fitted = _fitted(sample, body, own)
    median = _median(spread, _mesh(body, fitted))
    return (None, fitted, median) if median <= min(base / TIMES, base - gain) else None


def _mesh(body: BodyModel, shape: F64) -> Mesh:
    return Mesh(shaped_template(body, shape), body.triangles)


def _median(points: F64, mesh: Mesh) -> float:
    return float(np.median(mesh.nearest(points).distance))


def _fitted(points: F64, body: BodyModel, start: F64) -> F64:
    """Coefficients by which the mesh meets the points along its normals (Gauss-Newton, weights 1 / distance)."""
    count = min(FITTED, body.identity_dirs.shape[2])
    shape: F64 = np.zeros(body.identity_dirs.shape[2])
    shape[: min(len(start), len(shape))] = start[: len(shape)]
    for _ in range(STEPS):
        mesh = _mesh(body, shape)
        found = mesh.nearest(points)
        corners = body.triangles[found.triangle]
        places = np.einsum("ij,ijk->ik", found.barycentric, mesh.vertices[corners])
        a, b, c = (mesh.vertices[corners[:, k]] for k in range(3))
        normal = np.cross(b - a, c - a)
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
        effect = np.einsum(
            "ij,ik,ijkc->ic", found.barycentric, normal, body.identity_dirs[corners][..., :count]
        )
        off = np.einsum("ij,ij->i", points - places, normal)
        weight = 1 / np.maximum(found.distance, 1e-2 * max(float(np.median(found.distance)), 1e-9))
        square = (effect * weight[:, None]).T @ effect
        if not square.any():
            return shape  # no direction moves the mesh here
        ridge = RIDGE * np.trace(square) / count * np.eye(count)
        shape[:count] += np.linalg.solve(square + ridge, (effect * weight[:, None]).T @ off)
    return shape
