"""The head as a SplattingAvatar: skin, hair, brows and mouth embedded in the mesh of a take's first frame."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.rotation import matrix_from_quat
from avatar_trainer.head import BodyModel, Head, Mesh, smoothstep, unit
from samples.subjects.colour import logit, surface_colour, surface_opacity
from samples.subjects.surface import Samples, deformation, sample_mesh, spacing_on
from samples.subjects.take import Take, exercises, posed_vertices
from samples.systems.gaussian_blendshapes import (
    BACK,
    EYE,
    FADED_THICKNESS,
    FEATURE,
    FINE,
    IRIS,
    SKIN,
    SOCKET,
    THICKNESS,
    WIDTH,
    face_regions,
    held_vertices,
)
from samples.systems.splatting_avatar import (
    Embedded,
    Layer,
    area_ratio,
    embed,
    fit_log_scale,
    joined,
    rounded,
)

Array = npt.NDArray[Any]

UNITS_PER_METRE = 4.0
LIPS, SCALP, TEETH, GUMS, THROAT, BROW = range(IRIS + 1, IRIS + 7)  # regions beyond face_regions's
OPACITY_LOGIT = 6.0
HAIR_SHARE, BROW_SHARE = 0.2, 0.02  # of all Gaussians
# Region -> spacing of its samples relative to the others'; how much their scales cover the frames that stretch
# them, from least squares (0) to all (1); and the most, ln, that they may be too wide in a frame that presses them.
REGIONS = {
    SKIN: (0.95, 0.8, 1.15),
    FEATURE: (0.62, 0.95, 1.45),
    FINE: (0.28, 0.2, 0.7),
    BACK: (1.3, 0.5, 1.0),
    SOCKET: (1.1, 0.5, 1.0),
    EYE: (0.6, 0.0, 1.0),
    IRIS: (0.3, 0.0, 1.0),
    LIPS: (0.3, 0.55, 0.7),
    SCALP: (1.9, 0.0, 1.0),
    TEETH: (0.7, 0.0, 1.0),
    GUMS: (1.1, 0.0, 1.0),
    THROAT: (0.8, 1.0, 2.5),
    BROW: (0.5, 0.6, 0.9),
}
KEY_FRAMES = 16  # that the scales are fitted to
NOISE_REST = 0.06
# The largest distance of skin, hair and brows from the mesh, metres.
SKIN_OFF, HAIR_OFF, BROW_OFF = 0.0004, (0.0005, 0.007), (0.0002, 0.0016)
HAIR_SIGMA, BROW_SIGMA = (0.0042, 0.0011, 0.0009), (0.0022, 0.00045, 0.0004)
HAIR_COLOUR = np.array([0.20, 0.135, 0.095])
CROWN, HAIR_COMB = np.array([0.015, 0.142, -0.045]), np.array([0.0, -0.15, 0.35])


def build_head(
    head: Head, body: BodyModel, take: Take, gaussians: int, sh_degree: int, noise_seed: int | None = None
) -> Embedded:
    """A checkpoint of `gaussians` splats trained on `take`; with `noise_seed` SH rest and opacities are random."""
    hair, brows = (round(share * gaussians) for share in (HAIR_SHARE, BROW_SHARE))
    regions = head_regions(head)
    held = replace(head, vertices=held_vertices(body, head.vertices))
    spacing, cover, spill = np.array([REGIONS[r] for r in range(len(REGIONS))]).T
    samples = sample_mesh(head, regions, spacing, gaussians - hair - brows, seed=11, held=held)
    samples = replace(samples, spacing=spacing_on(held, samples, regions))
    layer = joined([skin_layer(head, samples), hair_layer(head, hair), brow_layer(head, brows)])
    frames = np.linspace(0, take.frames, KEY_FRAMES, endpoint=False).astype(int)
    shown = [(take, int(k)) for k in frames]
    trained = exercises(body, take.shape[: len(head.identity)])
    shown += [(trained, k) for k in range(trained.frames)]
    meshes = [Mesh(posed_vertices(body, *frame), head.triangles) for frame in shown]
    cover, spill = (np.append(x[regions[samples.face]], np.zeros(hair + brows)) for x in (cover, spill))
    log_scale = trained_log_scale(layer, samples, regions, meshes, cover, spill)
    opacity = logit(layer.opacity, OPACITY_LOGIT)
    rest = np.zeros((gaussians, (sh_degree + 1) ** 2 - 1, 3))
    if noise_seed is not None:
        rng = np.random.default_rng(noise_seed)
        rest = rng.normal(0, NOISE_REST, rest.shape)
        opacity = opacity + rng.normal(-4, 2, opacity.shape)
    turned = turned_layer(layer, head, meshes[0])
    canonical = rounded(meshes[0], UNITS_PER_METRE)
    return embed(canonical, turned, log_scale, UNITS_PER_METRE, opacity, rest, seed=12)


def trained_log_scale(
    layer: Layer, samples: Samples, regions: Array, meshes: list[Mesh], cover: Array, spill: Array
) -> Array:
    """Log scales [N, 3] in training units that keep the skin closed in all of `meshes`, metres, the first canonical.

    The first rows of `layer` are `samples`, whose neighbours move away and back; hair and brows keep their size.
    """
    wanted = np.log(UNITS_PER_METRE * np.tile(layer.sigma, (len(meshes), 1, 1)))
    for k, mesh in enumerate(meshes):
        stretch = spacing_on(mesh, samples, regions) / samples.spacing
        wanted[k, : len(stretch)] += np.log(stretch)[:, None]
    units = [rounded(mesh, UNITS_PER_METRE) for mesh in meshes]
    ratio = np.stack([area_ratio(units[0], mesh, layer.face) for mesh in units])
    return fit_log_scale(wanted, ratio, cover, spill)


def turned_layer(layer: Layer, head: Head, posed: Mesh) -> Layer:
    """The layer with its frames rotated by the triangles from the neutral head to `posed`."""
    corner = head.triangles[layer.face]
    foot = np.einsum("nc,ncx->nx", layer.bary, head.vertices[corner])
    _, turn, _ = deformation(head.vertices[corner], posed.vertices[corner], foot)
    return replace(layer, frame=matrix_from_quat(turn) @ layer.frame)


def head_regions(head: Head) -> Array:
    """Key in REGIONS of each triangle [F], -1 for none."""
    regions = face_regions(head)
    centre = head.vertices[head.triangles].mean(axis=1)
    regions[(regions == FINE) & (centre[:, 1] < 0)] = LIPS
    x, y, z = centre.T
    throat = (y < -0.06) & (y > -0.14) & (np.abs(x) < 0.06) & (z > 0)
    regions[head.triangles_in("face", "head") & throat & (regions != LIPS)] = THROAT
    regions[(regions == FEATURE) & (y > 0.03) & (y < 0.085) & (z > 0.05)] = BROW
    regions[head.triangles_in("head") & (hair_share(head, centre) > 0.9)] = SCALP
    regions[(np.abs(x) > 0.078) & (np.abs(y - 0.01) < 0.045) & (np.abs(z - 0.005) < 0.035)] = FEATURE  # ears
    regions[head.triangles_in("upper_gums", "lower_gums")] = GUMS
    regions[head.triangles_in("upper_teeth", "lower_teeth")] = TEETH
    return regions


def skin_layer(head: Head, samples: Samples) -> Layer:
    """Skin, eyes and mouth: flat splats within a fraction of a millimetre of the surface."""
    colour = surface_colour(head, samples)
    under = hair_share(head, samples.position)[:, None]
    colour = colour + 0.9 * under * (0.8 * HAIR_COLOUR - colour)
    opacity = surface_opacity(head, samples)
    sigma = samples.spacing[:, None] * np.array([WIDTH, WIDTH, THICKNESS])
    sigma[:, 2] += FADED_THICKNESS * samples.spacing * (1 - opacity)
    ripple = np.sin(samples.position @ np.array([410.0, 530.0, 370.0]))
    smooth = head.triangles_in("left_eye", "right_eye", "upper_teeth", "lower_teeth")[samples.face]
    displacement = SKIN_OFF * ripple * np.where(smooth, 0.1, 1.0)
    return Layer(samples.face, samples.bary, displacement, samples.frame, sigma, colour, opacity)


def hair_share(head: Head, points: Array) -> Array:
    """Where short hair grows on the scalp: 0..1 at each point [N, 3]."""
    x, y, z = points.T
    wobble = 0.003 * np.sin(170 * x + 90 * y) + 0.002 * np.sin(310 * z + 140 * y)
    # The front edge, metres along z, at each height: behind the ears, before them, temples, forehead.
    front = np.interp(
        y, (-0.05, 0.0, 0.02, 0.045, 0.085, 0.1, 0.112), (-0.035, -0.02, 0.0, 0.03, 0.05, 0.075, 0.13)
    )
    share = smoothstep(front + wobble - z, -0.004, 0.006) * smoothstep(y + wobble, -0.06, -0.045)
    return share * smoothstep(np.abs(x), 0.088, 0.083)


def hair_layer(head: Head, count: int) -> Layer:
    """Short strands on the scalp that run down and forward from the crown."""
    centre = head.vertices[head.triangles].mean(axis=1)
    scalp = head.triangles_in("face", "head") & (hair_share(head, centre) > 0.3)
    samples = sample_mesh(head, np.where(scalp, 0, -1), np.ones(1), count, seed=13)
    rng = np.random.default_rng(14)
    height = rng.uniform(0, 1, count)
    flow = unit(samples.position - CROWN) + HAIR_COMB + rng.normal(0, 0.12, (count, 3))
    tone = (0.75 + 0.55 * height) * np.exp(rng.normal(0, 0.12, count))
    shine = 1 + 0.35 * smoothstep(samples.frame[:, 1, 2], 0.2, 0.95)
    edge = hair_share(head, samples.position)
    off = HAIR_OFF[0] + (HAIR_OFF[1] - HAIR_OFF[0]) * height * edge
    return strands(
        samples, flow, 0.18, off, HAIR_SIGMA, HAIR_COLOUR * (tone * shine)[:, None], 0.35 + 0.6 * edge
    )


def brow_layer(head: Head, count: int) -> Layer:
    """Strands on the brows, outward and a little up, where the scan is dark."""
    centre = head.vertices[head.triangles].mean(axis=1)
    dark = head.colors[head.triangles].mean(axis=(1, 2)) < 0.42
    ridge = (np.abs(centre[:, 1] - 0.058) < 0.018) & (centre[:, 2] > 0.07) & (np.abs(centre[:, 0]) > 0.008)
    samples = sample_mesh(
        head, np.where(head.triangles_in("face") & dark & ridge, 0, -1), np.ones(1), count, seed=15
    )
    rng = np.random.default_rng(16)
    side = np.sign(samples.position[:, :1])
    flow = np.concatenate([side, np.full((count, 1), 0.25), np.full((count, 1), -0.2)], axis=1)
    flow += rng.normal(0, 0.25, (count, 3))
    tone = np.exp(rng.normal(0, 0.15, count))
    off = rng.uniform(*BROW_OFF, count)
    return strands(
        samples, flow, 0.1, off, BROW_SIGMA, 0.9 * HAIR_COLOUR * tone[:, None], np.full(count, 0.75)
    )


def strands(
    samples: Samples,
    flow: Array,
    lift: float,
    off: Array,
    sigma: tuple[float, ...],
    colour: Array,
    opacity: Array,
) -> Layer:
    """Long thin splats along the flow [N, 3] on the surface, rising from it with the slope `lift`."""
    normal = samples.frame[:, :, 2]
    along = unit(flow - np.sum(flow * normal, axis=1, keepdims=True) * normal) + lift * normal
    along = unit(along)
    across = unit(np.cross(normal, along))
    frame = np.stack([along, across, np.cross(along, across)], axis=-1)
    widths = np.tile(sigma, (len(off), 1))
    return Layer(
        samples.face, samples.bary, off, frame, widths, np.clip(colour, 0, 1), np.clip(opacity, 0, 1)
    )
