"""A shirt: cloth over the lower edge of the bust, which moves with it, a collar, and shoulders on the trunk."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_trainer.head import Head, smooth_over_mesh, smoothstep
from samples.capture.extras import tubes

Array = npt.NDArray[Any]

CLOTH, HEM = 0.005, 0.008  # metres: from skin to cloth; from the collar to where the skin below is left out
NECKLINE, LEAN = -0.122, 0.45  # height of the collar; how much higher it is a metre farther back
COLLAR = (0.0045, 0.0060)  # half its thickness and its height
SIDES = 72
BLENDED = 7  # rings from the edge of the bust to the first of the shoulders
# Rings of the shoulders, downwards: height, half width, half depth, z of the middle, exponent of the superellipse.
RINGS = (
    (-0.222, 0.192, 0.100, -0.028, 2.3),
    (-0.245, 0.203, 0.108, -0.028, 2.4),
    (-0.290, 0.210, 0.116, -0.028, 2.6),
    (-0.370, 0.213, 0.122, -0.028, 2.8),
    (-0.520, 0.214, 0.124, -0.028, 2.8),
)


@dataclass(frozen=True)
class Shirt:
    """What lies on the bust: vertices beside those of the head, and triangles."""

    follows: Array  # [N] the head's vertex that each one moves with
    offset: Array  # [N, 3] from it, metres, along x, y and z
    triangles: Array  # [F, 3] of its own vertices
    hidden: Array  # [F of the head] mask of the triangles under it


def below_collar(vertices: Array) -> Array:
    """Metres [V] below the collar."""
    depth: Array = NECKLINE - vertices[:, 1] - LEAN * vertices[:, 2]
    return depth


def shirt(head: Head) -> Shirt:
    """The shirt of a head whose bust is where the scan's is."""
    depth = below_collar(head.vertices)
    skin = head.triangles_in("face", "head")
    on = np.flatnonzero(skin & (depth > -0.001)[head.triangles].all(axis=1))
    rows, flat = np.unique(head.triangles[on], return_inverse=True)
    normal = head.vertex_normals.copy()
    for axis in range(3):
        normal[:, axis] = smooth_over_mesh(head, normal[:, axis], 6)
    ring = _collar(head, np.flatnonzero(np.abs(depth) < 0.006))
    collar, bands = tubes(ring[None], np.ones((1, SIDES)), COLLAR, np.array([0.0, 1.0, LEAN]), 8, closed=True)
    near = ((collar[:, None] - head.vertices[rows][None]) ** 2).sum(axis=2).argmin(axis=1)
    return Shirt(
        np.concatenate([rows, rows[near]]),
        np.concatenate([CLOTH * normal[rows], collar - head.vertices[rows[near]]]),
        np.concatenate([flat.reshape(-1, 3), bands + len(rows)]),
        skin & (depth > HEM)[head.triangles].all(axis=1),
    )


def _collar(head: Head, rows: Array) -> Array:
    """The middle line [SIDES, 3] of the collar: around the neck, over the vertices `rows` that are near it."""
    ring = _around(head.vertices[rows[head.in_part("face", "head")[rows]]], 0.8 * CLOTH)
    ring[:, 1] = NECKLINE - LEAN * ring[:, 2]
    return ring


def _around(points: Array, outward: float) -> Array:
    """A line [SIDES, 3] around the upright axis through the middle of points that lie about it."""
    middle = (points.max(axis=0) + points.min(axis=0)) / 2
    x, z = points[:, 0] - middle[0], points[:, 2] - middle[2]
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    weight = np.exp(120 * (np.cos(np.arctan2(z, x)[None] - angle[:, None]) - 1))
    weight /= weight.sum(axis=1, keepdims=True)
    wide = weight @ np.hypot(x, z) + outward
    return np.stack(
        [middle[0] + wide * np.cos(angle), weight @ points[:, 1], middle[2] + wide * np.sin(angle)], axis=1
    )


def shoulders(head: Head) -> tuple[Array, Array]:
    """(vertices, triangles) of the cloth beyond the bust, from its lower edge on."""
    angle = 2 * np.pi * np.arange(SIDES) / SIDES
    c, s = np.cos(angle), np.sin(angle)
    rings = [
        np.stack(
            [
                wide * np.sign(c) * np.abs(c) ** (2 / power),
                np.full(SIDES, height),
                z + deep * np.sign(s) * np.abs(s) ** (2 / power),
            ],
            axis=1,
        )
        for height, wide, deep, z, power in RINGS
    ]
    edge = _around(head.vertices[_edge(head)], 0.0) + np.array([0, CLOTH, 0])
    share = np.linspace(0, 1, BLENDED, endpoint=False)[:, None, None]
    blend = edge + np.concatenate([share, share**1.9, share], axis=2) * (rings[0] - edge)
    rows = np.concatenate([blend.reshape(-1, 3), *rings])
    ring, side = (i.reshape(-1) for i in np.indices((BLENDED + len(RINGS) - 1, SIDES)))
    a, b = ring * SIDES + side, ring * SIDES + (side + 1) % SIDES
    return rows, np.stack([a, b, b + SIDES, a, b + SIDES, a + SIDES], axis=1).reshape(-1, 3)


def _edge(head: Head) -> Array:
    """The vertices on the lower edge of the bust."""
    skin = head.triangles[head.triangles_in("face", "head")]
    edges = np.sort(np.concatenate([skin[:, [0, 1]], skin[:, [1, 2]], skin[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    rows = np.unique(edges[uses == 1])
    return rows[head.vertices[rows, 1] < -0.1]


def folds(vertices: Array, seed: int) -> Array:
    """Factor [N] on the light of cloth at these places."""
    rng = np.random.default_rng(seed)
    wave = np.zeros(len(vertices))
    for _ in range(5):
        wave += np.sin(vertices @ rng.normal(0, 45, 3) + rng.uniform(0, 6.3))
    factor: Array = 1 + 0.03 * wave - 0.2 * smoothstep(below_collar(vertices), 0.03, 0.004)
    return factor
