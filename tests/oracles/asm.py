"""ASM (arXiv 2304.09423) in float64, bone by bone and vertex by vertex, as its equations stand. Shares nothing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def density(uv: Array, zeta: Array, pi: Array, mu: Array, covariance: Array) -> float:
    """Eq. 4 of one bone at one place: pi [K], mu [K, 2], covariance [K, 3] (xx, xy, yy)."""
    total = 0.0
    for weight, shift, (xx, xy, yy) in zip(pi, mu, covariance, strict=True):
        matrix = np.array([[xx, xy], [xy, yy]], np.float64)
        d = uv - (shift + zeta)
        exponent = -0.5 * float(d @ np.linalg.inv(matrix) @ d)
        total += weight * math.exp(exponent) / (2 * math.pi * math.sqrt(np.linalg.det(matrix)))
    return total


def weights(uv: Array, zeta: Array, pi: Array, mu: Array, covariance: Array, rule: str) -> Array:
    """Eq. 6 [V, J], or softplus of each mixture first."""
    rows = []
    for place in uv:
        row = [density(place, *bone) for bone in zip(zeta, pi, mu, covariance, strict=True)]
        if rule == "softplus":
            row = [math.log(1 + math.exp(w)) for w in row]
        rows.append([w / sum(row) for w in row])
    return np.array(rows)


def barycentric(p: Array, a: Array, b: Array, c: Array) -> tuple[float, float, float]:
    """Eq. 10."""
    alpha = (-(p[0] - b[0]) * (c[1] - b[1]) + (p[1] - b[1]) * (c[0] - b[0])) / (
        -(a[0] - b[0]) * (c[1] - b[1]) + (a[1] - b[1]) * (c[0] - b[0])
    )
    beta = (-(p[0] - c[0]) * (a[1] - c[1]) + (p[1] - c[1]) * (a[0] - c[0])) / (
        -(b[0] - c[0]) * (a[1] - c[1]) + (b[1] - c[1]) * (a[0] - c[0])
    )
    return alpha, beta, 1 - alpha - beta


def holds(p: Array, a: Array, b: Array, c: Array) -> bool:
    """Eq. 8, a point on an edge counted in."""

    def cross(u: Array, v: Array) -> float:
        return float(u[0] * v[1] - u[1] * v[0])

    t = (cross(a - p, b - p), cross(b - p, c - p), cross(c - p, a - p))
    return all(x >= 0 for x in t) or all(x <= 0 for x in t)


def bone_position(
    zeta: Array, uv: Array, triangles: Array, vertices: Array, anchor: int, first: Array
) -> Array:
    """Eq. 11; zeta must lie in a triangle."""
    for corners in triangles:
        a, b, c = (uv[k] for k in corners)
        if holds(zeta, a, b, c):
            shares = barycentric(zeta, a, b, c)
            place = sum(s * vertices[k] for s, k in zip(shares, corners, strict=True))
            return np.asarray(place - vertices[anchor] + first)
    raise AssertionError("zeta lies in no triangle")


def trs(rotation_vector: Sequence[float], translation: Sequence[float], scale: Sequence[float]) -> Array:
    """M(tau) = T R S [4, 4]; R by Rodrigues' formula."""
    angle = math.sqrt(sum(x * x for x in rotation_vector))
    turn = np.eye(3)
    if angle > 0:
        x, y, z = (part / angle for part in rotation_vector)
        k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        turn = turn + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k
    t, r, s = np.eye(4), np.eye(4), np.eye(4)
    t[:3, 3], r[:3, :3], s[:3, :3] = translation, turn, np.diag(scale)
    return np.asarray(t @ r @ s)


def transforms(binds: Array, parents: Sequence[int], tau: Sequence[tuple[Any, Any, Any]]) -> Array:
    """T_j of Eq. 13 [J, 4, 4], each bone's chain walked to its root: Eq. 15, 16."""
    found = []
    for j in range(len(binds)):
        product, at = np.eye(4), j
        while at >= 0:
            above = np.linalg.inv(binds[parents[at]]) if parents[at] >= 0 else np.eye(4)
            product = above @ binds[at] @ trs(*tau[at]) @ product
            at = parents[at]
        found.append(product @ np.linalg.inv(binds[j]))
    return np.array(found)


def posed(vertices: Array, weight: Array, transform: Array) -> Array:
    """Eq. 12 [V, 3]."""
    result = np.zeros((len(vertices), 3))
    for v, point in enumerate(vertices):
        for w, matrix in zip(weight[v], transform, strict=True):
            result[v] += w * (matrix @ np.append(point, 1.0))[:3]
    return result


def posed_face(face: Any, take: Any, frame: int) -> Array:
    """All of it for a face and one frame of a take: reads their arrays, computes everything itself."""
    t, b = face.template, face.binding
    uv, vertices = t.uv.astype(np.float64), t.vertices.astype(np.float64)
    binds = []
    for j in range(len(t.bone_names)):
        bind = np.eye(4)
        bind[:3, :3] = t.rest_linear[j]
        bind[:3, 3] = bone_position(
            b.zeta[j],
            uv,
            t.triangles,
            vertices,
            int(t.anchor_vertex[j]),
            t.rest_position[j].astype(np.float64),
        )
        binds.append(bind)
    weight = weights(uv, b.zeta, b.pi, b.mu, b.covariance, t.weight_rule)
    tau = [
        (take.rotation_vector[frame, j], take.translation[frame, j], take.scale[frame, j])
        for j in range(len(binds))
    ]
    return posed(vertices, weight, transforms(np.array(binds), t.parents.tolist(), tau))
