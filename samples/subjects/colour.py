"""The colour and opacity of the head's surface."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_trainer.head import Head, neck_height, smooth_over_mesh, smoothstep, unit
from samples.subjects.surface import Samples

Array = npt.NDArray[Any]

SKIN = ("face", "head")
# The scan saw the sides at a grazing angle: bluish cheeks, grey scalp, ears without relief.
SIDE_SHARE = 0.88  # of the even tone in the skin there
SIDE_DEGREES = (
    (22.0, 45.0),
    (35.0, 65.0),
)  # from the face's axis, where it begins and where it is full: below and above the eyes
BUST_FADE = (0.008, 0.045)  # metres from its cut edge over which the bust appears
# Of the painted irises: colour near the pupil and farther out; (times around, phase) of their fibres.
IRIS = ((0.42, 0.43, 0.38), (0.30, 0.41, 0.47))
FIBRES = ((7, 0.4), (13, 2.1), (19, 4.4), (29, 1.3))
TEETH = 0.9  # the scan has no eyes; the mesh's own white is too bright beside its skin


def surface_colour(head: Head, samples: Samples) -> Array:
    """Display sRGB [N, 3], 0..1, of the surface at the samples: the scan's, with eyes and mouth painted."""
    colour = samples.interpolate(skin_colors(head), head.triangles)
    colour[head.triangles_in("upper_teeth", "lower_teeth")[samples.face]] *= TEETH
    painted: Array = np.clip(iris_colour(head, samples, colour) * depth_shade(head, samples), 0, 1)
    return painted


def skin_colors(head: Head) -> Array:
    """Colours [V, 3] of the vertices, the skin of sides and back evened out to a tone shaded by its relief."""
    x, y, z = head.vertices.T
    skin = head.in_part(*SKIN)
    aside = np.degrees(np.arctan2(np.hypot(x, np.maximum(y - 0.03, 0)), z))
    upper = smoothstep(y, 0.0, 0.03)
    start, end = (low + (high - low) * upper for low, high in zip(*SIDE_DEGREES, strict=True))
    side = smoothstep((aside - start) / (end - start), 0, 1)
    side = np.where(
        skin, SIDE_SHARE * np.maximum(side, smoothstep(neck_height(head.vertices), -0.06, -0.1)), 0
    )
    front = skin & (np.abs(x) < 0.05) & (np.abs(y) < 0.1) & (z > 0.06)
    tone = np.median(head.colors[front], axis=0) * relief_shade(head)[:, None]
    result: Array = head.colors + side[:, None] * (tone - head.colors)
    return result


def relief_shade(head: Head) -> Array:
    """Factor [V] near 1: darker where the surface turns down or away, and in hollows such as the ears'."""
    normal = head.vertex_normals
    light = normal @ unit(np.array([0.0, 0.45, 0.9]))
    hollow = np.zeros(len(normal))
    for axis in range(3):
        smooth = smooth_over_mesh(head, head.vertices[:, axis], 12)
        hollow += (smooth - head.vertices[:, axis]) * normal[:, axis]
    result: Array = 0.97 + 0.06 * light - np.clip(60 * hollow, -0.05, 0.3)
    return result


def surface_opacity(head: Head, samples: Samples) -> Array:
    """Opacity [N], 0..1: solid except for the lower edge of the bust, which fades out."""
    skin = head.triangles[head.triangles_in(*SKIN)]
    edges = np.sort(np.concatenate([skin[:, [0, 1]], skin[:, [1, 2]], skin[:, [2, 0]]]), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    ends = head.vertices[edges[uses == 1]]
    start, end = np.moveaxis(ends[(ends[:, :, 1] < -0.1).all(axis=1)], 1, 0)
    along = end - start
    distance = np.full(len(samples.position), np.inf)
    for a, d in zip(start, along, strict=True):
        arm = samples.position - a
        share = np.clip(arm @ d / (d @ d), 0, 1)
        distance = np.minimum(distance, np.linalg.norm(arm - share[:, None] * d, axis=1))
    return smoothstep(distance, *BUST_FADE)


def logit(opacity: Array, limit: float) -> Array:
    """Logits of opacities 0..1, kept within +-limit."""
    edge = 1 / (1 + np.exp(limit))
    inside = np.clip(opacity, edge, 1 - edge)
    result: Array = np.log(inside / (1 - inside))
    return result


def iris_colour(head: Head, samples: Samples, colour: Array) -> Array:
    """The colours with pupil, iris and white painted on the eyeballs by the angle from their axis.

    Every border is as wide as two pixels of a portrait of 512 pixels: what is sharper than the images that an avatar
    learns from becomes rings and spokes.
    """
    colour = colour.copy()
    for eye, name in enumerate(("left_eye", "right_eye")):
        rows = np.flatnonzero(head.triangles_in(name)[samples.face])
        direction = unit(samples.position[rows] - head.eye_centres[eye])
        angle = np.degrees(np.arccos(np.clip(direction[:, 2], -1, 1)))[:, None]
        turn = np.arctan2(direction[:, 1], direction[:, 0])[:, None]
        fibre = sum(np.sin(n * turn + phase + 0.11 * angle) for n, phase in FIBRES) / len(FIBRES)
        tone = np.array(IRIS[0]) + np.subtract(IRIS[1], IRIS[0]) * smoothstep(angle, 8.0, 15.0)
        iris = tone * (1.0 + 0.16 * fibre)
        iris = iris + (np.array([0.13, 0.18, 0.21]) - iris) * smoothstep(angle, 15.5, 20.5)
        iris = iris + (np.array([0.03, 0.03, 0.035]) - iris) * smoothstep(angle, 9.0, 6.0)
        white = np.array([0.86, 0.82, 0.79]) + np.array([-0.12, -0.30, -0.30]) * smoothstep(angle, 35.0, 80.0)
        colour[rows] = iris + (white - iris) * smoothstep(angle, 18.5, 23.0)
    return colour


def depth_shade(head: Head, samples: Samples) -> Array:
    """Factor [N, 1] that darkens the inside of the mouth with its depth, as no light gets there."""
    inside = head.triangles_in("mouth_socket", "upper_gums", "lower_gums", "upper_teeth", "lower_teeth")
    depth = smoothstep(samples.position[:, 2], 0.035, 0.105)
    return np.where(inside[samples.face], 0.15 + 0.85 * depth, 1.0)[:, None]
