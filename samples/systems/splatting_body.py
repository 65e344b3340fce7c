"""The walking man as a SplattingAvatar: suit and visor embedded in the mesh of his first step."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_trainer.head import Mesh, smoothstep, unit
from samples.subjects.body import Body
from samples.subjects.colour import logit
from samples.subjects.surface import Samples, near_pairs, sample_mesh, spacing_on
from samples.systems.splatting_avatar import Embedded, Layer, embed, rounded

Array = npt.NDArray[Any]

UNITS_PER_METRE = 1.0
OPACITY_LOGIT = 6.0
WIDTH, THICKNESS = 0.7, 0.1  # deviation of a splat, in sample spacings
OFF = 0.0012  # metres of the suit from its mesh, to either side
HELD = (0, 12, 24, 36)  # keys of the walk whose stretch the splats cover, since poses do not scale them
TRUNK, HEAD = range(2)
SPACING = np.array([1.0, 0.7])
HEAD_HEIGHT = 1.16  # metres, in the first step
# Where colours meet, splats are shorter across the seam and longer along it.
REACH, CONTRAST, ACROSS, ALONG = 1.6, 0.12, 0.7, 1.2
LIGHT = (0.25, 0.8, 0.55)


def build_walker(body: Body, gaussians: int) -> Embedded:
    """A checkpoint of `gaussians` splats on the welded mesh at the first key of the walk."""
    meshes = [body.posed(key) for key in HELD]
    rest, canonical = meshes[0], rounded(meshes[0], UNITS_PER_METRE)
    height = rest.vertices[body.triangles][:, :, 1].mean(axis=1)
    regions = np.where(height > HEAD_HEIGHT, HEAD, TRUNK)
    samples = sample_mesh(rest, regions, SPACING, gaussians, seed=21)
    spacing = np.max([spacing_on(mesh, samples, regions) for mesh in meshes], axis=0)
    colour = body.colour(samples.face, samples.bary)
    frame, share = along_seams(samples, colour)
    sigma = spacing[:, None] * share * np.array([WIDTH, WIDTH, THICKNESS])
    displacement = OFF * np.sin(samples.position @ np.array([210.0, 170.0, 260.0]))
    colour *= samples.interpolate(shading(rest), body.triangles)[:, None]
    layer = Layer(samples.face, samples.bary, displacement, frame, sigma, colour, np.ones(gaussians))
    log_scale = np.log(sigma * UNITS_PER_METRE)
    rest_sh = np.zeros((gaussians, 0, 3))
    return embed(
        canonical, layer, log_scale, UNITS_PER_METRE, logit(layer.opacity, OPACITY_LOGIT), rest_sh, seed=22
    )


def along_seams(samples: Samples, colour: Array) -> tuple[Array, Array]:
    """Frames [N, 3, 3] whose first axis crosses the nearest seam of colours, and factors [N, 3] on the widths."""
    i, j, distance = near_pairs(samples.position, REACH * float(samples.spacing.max()))
    near = distance < REACH * np.minimum(samples.spacing[i], samples.spacing[j])
    differ = near & (np.abs(colour[i] - colour[j]).max(axis=1) > CONTRAST)
    i, j = np.r_[i[differ], j[differ]], np.r_[j[differ], i[differ]]
    towards = np.zeros_like(samples.position)
    np.add.at(towards, i, unit(samples.position[j] - samples.position[i]))
    normal = samples.frame[:, :, 2]
    towards -= np.sum(towards * normal, axis=1, keepdims=True) * normal
    seam = np.linalg.norm(towards, axis=1) > 0.5
    first = np.where(seam[:, None], unit(towards), samples.frame[:, :, 0])
    frame = np.stack([first, np.cross(normal, first), normal], axis=-1)
    return frame, np.where(seam[:, None], (ACROSS, ALONG, 1.0), 1.0)


def shading(mesh: Mesh) -> Array:
    """Factor [V] of the light that a capture would have baked in, from above and in front."""
    facing = mesh.vertex_normals @ unit(np.array(LIGHT))
    result: Array = 0.5 + 0.47 * smoothstep(facing, -1.0, 1.0)
    return result
