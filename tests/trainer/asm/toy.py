"""A small bone-driven face for tests: a bent sheet with a nose, nine bones, and scans of it that are another mesh."""

from __future__ import annotations

import numpy as np

from avatar_export.asm.model import Binding, Template
from avatar_runtime.avatar import F64
from avatar_trainer.asm.align import KEYPOINTS, Scan

SIDE = 31  # vertices along the sheet
PLACES = {  # uv of the seven keypoints
    "right_eye_outer": (0.2, 0.7),
    "right_eye_inner": (0.4, 0.68),
    "left_eye_inner": (0.6, 0.68),
    "left_eye_outer": (0.8, 0.7),
    "nose_bottom": (0.5, 0.42),
    "mouth_right": (0.36, 0.28),
    "mouth_left": (0.64, 0.28),
}
BONES = {  # uv; `root` and `head` stand within
    "eye.R": (0.3, 0.7),
    "eye.L": (0.7, 0.7),
    "nose": (0.5, 0.5),
    "cheek.R": (0.2, 0.45),
    "cheek.L": (0.8, 0.45),
    "mouth": (0.5, 0.28),
    "chin": (0.5, 0.08),
}


def surface(uv: F64) -> F64:
    """Points [N, 3] metres of the face at uv [N, 2]: 16 cm wide, 20 cm high, +Z out of it."""
    x, y = 0.16 * (uv[:, 0] - 0.5), 0.20 * (uv[:, 1] - 0.5)
    nose = 0.02 * np.exp(-(((uv[:, 0] - 0.5) / 0.07) ** 2) - ((uv[:, 1] - 0.5) / 0.12) ** 2)
    return np.stack([x, y, 0.04 - 6 * x**2 - 2.5 * y**2 + nose], axis=1)


def grid(side: int = SIDE) -> tuple[F64, F64]:
    """(uv [side^2, 2], triangles i64 [F, 3]) of a square sheet."""
    at = np.linspace(0, 1, side)
    uv = np.stack(np.meshgrid(at, at), axis=-1).reshape(-1, 2)
    corner = np.arange(side * side).reshape(side, side)
    a, b, c, d = (
        part.ravel() for part in (corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1])
    )
    return uv, np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)])


def template(side: int = SIDE) -> Template:
    """The face with its bones."""
    uv, triangles = grid(side)
    vertices = surface(uv)

    def nearest(place: tuple[float, float]) -> int:
        return int(np.argmin(np.sum((uv - place) ** 2, axis=1)))

    anchors = [nearest((0.5, 0.5)), nearest((0.5, 0.5)), *(nearest(place) for place in BONES.values())]
    rest = vertices[anchors].copy()
    rest[:2, 2] -= (0.1, 0.06)
    count = len(anchors)
    return Template(
        vertices=vertices.astype(np.float32),
        triangles=triangles.astype(np.uint32),
        uv=uv.astype(np.float32),
        bone_names=("root", "head", *BONES),
        parents=np.array([-1, 0, *[1] * (count - 2)], np.int32),
        rest_position=rest.astype(np.float32),
        rest_linear=np.tile(np.eye(3, dtype=np.float32), (count, 1, 1)),
        anchor_vertex=np.array(anchors, np.uint32),
        landmarks={KEYPOINTS[name]: nearest(place) for name, place in PLACES.items()},
    )


def binding(of: Template, components: int = 2) -> Binding:
    """Bones weigh the sheet about them; root and head the rest of it."""
    count = len(of.bone_names)
    spread = np.full((count, components), 0.08)
    spread[:2] = 0.5
    mu = np.zeros((count, components, 2))
    mu[2:, :, 0] = 0.02 * (np.arange(components) - (components - 1) / 2)
    covariance = np.stack([spread**2, np.zeros_like(spread), spread**2], axis=-1)
    pi = np.full((count, components), 1 / components)
    return Binding(of.uv[of.anchor_vertex].astype(np.float64), pi, mu, covariance)


def scan(change: float = 0.0, points: int = 3000, seed: int = 0, name: str = "scan") -> Scan:
    """Points at random places of a face whose nose, cheeks and chin differ by `change` (1: some millimetres)."""
    uv = np.random.default_rng(seed).uniform(0.01, 0.99, (points, 2))
    marks = changed(np.array(list(PLACES.values())), change)
    return Scan(name, changed(uv, change), None, dict(zip(PLACES, marks, strict=True)))


def changed(uv: F64, change: float) -> F64:
    """Another person's face at uv."""
    found = surface(uv)
    chin = np.exp(-(((uv - (0.5, 0.08)) / 0.2) ** 2).sum(1))
    nose = np.exp(-(((uv - (0.52, 0.47)) / 0.12) ** 2).sum(1))
    cheek = np.exp(-(((uv - (0.24, 0.42)) / 0.15) ** 2).sum(1))
    found += (
        change * 1e-3 * (chin[:, None] * (0, -3, 4) + nose[:, None] * (1, 1, 5) + cheek[:, None] * (-3, 0, 3))
    )
    return found
