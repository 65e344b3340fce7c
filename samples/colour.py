"""The colour of the head's surface."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from samples.head import Head, smoothstep, unit
from samples.surface import Samples

Array = npt.NDArray[Any]

TEETH = 0.9  # the scan has none; the mesh's own white is too bright beside its skin


def surface_colour(head: Head, samples: Samples) -> Array:
    """Display sRGB [N, 3], 0..1, of the surface at the samples: the scan's, with eyes and mouth painted."""
    colour = samples.interpolate(head.colors, head.triangles)
    colour[head.triangles_in("upper_teeth", "lower_teeth")[samples.face]] *= TEETH
    painted: Array = np.clip(iris_colour(head, samples, colour) * depth_shade(head, samples), 0, 1)
    return painted


def iris_colour(head: Head, samples: Samples, colour: Array) -> Array:
    """The colours with pupil, iris and white painted on the eyeballs by the angle from their axis."""
    colour = colour.copy()
    for eye, name in enumerate(("left_eye", "right_eye")):
        rows = np.flatnonzero(head.triangles_in(name)[samples.face])
        direction = unit(samples.position[rows] - head.eye_centres[eye])
        angle = np.degrees(np.arccos(np.clip(direction[:, 2], -1, 1)))[:, None]
        spoke = np.sin(23 * np.arctan2(direction[:, 1], direction[:, 0]))[:, None]
        iris = np.array([0.33, 0.45, 0.50]) * (1.0 + 0.12 * spoke)
        iris = iris + (np.array([0.10, 0.14, 0.17]) - iris) * smoothstep(angle, 15.0, 20.0)
        iris = iris + (np.array([0.02, 0.02, 0.025]) - iris) * smoothstep(angle, 8.5, 6.5)
        white = np.array([0.90, 0.87, 0.84]) + np.array([-0.10, -0.28, -0.28]) * smoothstep(angle, 35.0, 75.0)
        colour[rows] = iris + (white - iris) * smoothstep(angle, 18.5, 21.5)
    return colour


def depth_shade(head: Head, samples: Samples) -> Array:
    """Factor [N, 1] that darkens the inside of the mouth with its depth, as no light gets there."""
    inside = head.triangles_in("mouth_socket", "upper_gums", "lower_gums", "upper_teeth", "lower_teeth")
    depth = smoothstep(samples.position[:, 2], 0.035, 0.105)
    return np.where(inside[samples.face], 0.15 + 0.85 * depth, 1.0)[:, None]
