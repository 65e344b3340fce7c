"""True scans of other people, for fits of ASM faces: points on the surface of a head made of identity shapes.

A scan's points are not the vertices of a template: they lie anywhere on its triangles. Only parts that a scanner sees
from the front are included, without mouth and eye sockets.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_trainer.asm.align import KEYPOINTS, Scan, face_region
from avatar_trainer.asm.register.fit import template_keypoints
from avatar_trainer.asm.template.place import front_depth
from samples.asm.data import AsmHead

WIDE = 1.3  # of the facial region's radius, that a scan covers
HIDDEN = 0.006  # metres behind the surface seen from the front
HOLES, HOLE_RADIUS = 6, 0.008  # metres

Array = npt.NDArray[Any]


def seen(head: AsmHead) -> npt.NDArray[np.int64]:
    """Rows of the head's triangles that a scanner in front of the face sees, in and around the facial region."""
    vertices, triangles = (
        head.template.vertices.astype(np.float64),
        head.template.triangles.astype(np.int64),
    )
    centre, radius = face_region(template_keypoints(head.template))
    near = np.flatnonzero(np.sum((vertices - centre) ** 2, axis=1) < (WIDE * radius) ** 2)
    front = near[vertices[near, 2] > front_depth(vertices, triangles, vertices[near, :2]) - HIDDEN]
    return np.flatnonzero(np.isin(triangles, front).all(axis=1))


def coefficients(seed: int, modes: int) -> npt.NDArray[np.float64]:
    """A person: standard deviations [modes] of the identity shapes, normal."""
    return np.random.default_rng(seed).normal(size=modes)


def person_scan(
    head: AsmHead,
    triangles: Array,
    vertices: Array,
    seed: int,
    *,
    points: int = 5000,
    noise_mm: float = 0.0,
    holes: bool = False,
) -> Scan:
    """A scan of `vertices` [V, 3], the head of another person: `points` on its `triangles` (of `seen`) by area.

    noise_mm: standard deviation of each coordinate; holes: HOLES balls of HOLE_RADIUS are missing.
    """
    random = np.random.default_rng(seed)
    corner = vertices.astype(np.float64)[head.template.triangles[triangles]]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    chosen = corner[random.choice(len(corner), points, p=area / area.sum())]
    places = np.einsum("nk,nkx->nx", random.dirichlet(np.ones(3), points), chosen)
    if holes:
        middles = places[random.choice(points, HOLES)]
        places = places[(np.linalg.norm(places[:, None] - middles, axis=2) > HOLE_RADIUS).all(axis=1)]
    places += random.normal(size=places.shape) * (noise_mm * 1e-3)
    rows = {name: head.template.landmarks[landmark] for name, landmark in KEYPOINTS.items()}
    keypoints = {name: vertices[row].astype(np.float64) for name, row in rows.items()}
    return Scan(f"person_{seed}", places, None, keypoints)


def head_scan(head: AsmHead) -> Scan:
    """A head as a scan."""
    template = head.template
    points = template.vertices.astype(np.float64)
    return Scan(head.name, points, template.triangles.astype(np.int64), template_keypoints(template))
