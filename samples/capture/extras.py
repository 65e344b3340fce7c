"""Extras of a synthetic head: glasses and hair, meshes made by code at a distance from the face's own mesh.

They move rigidly with the head, whose pose is in the camera, and are not in the capture's body model.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from avatar_trainer.captures.mesh_raster import Surface
from avatar_trainer.head import Head, Mesh, smoothstep, unit

F64 = npt.NDArray[np.float64]
I64 = npt.NDArray[np.int64]

PLASTIC = (0.085, 0.075, 0.08)  # display-referred
PLASTIC_GLOSS = (0.35, 30.0)  # strength of the highlight, its exponent
# A rim: middle (x of the left one, y), half width and height, exponent of the superellipse, metres.
RIM_MIDDLE, RIM_HALF, RIM_POWER = (0.0350, 0.0310), (0.0265, 0.0205), 3.0
RIM_Z, RIM_WRAP = 0.1180, 1.6  # metres in front, less this times x^2
RIM_TUBE = (0.0022, 0.0026)  # half the width seen from the front, half the depth
BRIDGE = ((0.0105, 0.0385), (0.0055, 0.0410), (0.0, 0.0418))  # x, y from the left rim to the middle
BRIDGE_TUBE = (0.0019, 0.0022)
# x, y, z of the left temple from its hinge to its end behind the ear.
TEMPLE = (
    (0.0600, 0.0400, 0.1100),
    (0.0690, 0.0405, 0.1050),
    (0.0735, 0.0415, 0.0930),
    (0.0775, 0.0440, 0.0600),
    (0.0815, 0.0475, 0.0250),
    (0.0845, 0.0500, 0.0000),
    (0.0850, 0.0470, -0.0150),
    (0.0845, 0.0370, -0.0280),
    (0.0835, 0.0220, -0.0380),
)
TEMPLE_TUBE = (0.0014, 0.0026)

HAIR = (0.215, 0.150, 0.105)
HAIR_GLOSS = (0.10, 14.0)
HAIR_SHADES = 0.28  # deviation of a tuft's brightness
TUFTS, TUFT_JOINTS, TUFT_SIDES = 3600, 9, 3
TUFT_LENGTH = (0.022, 0.042)  # metres
TUFT_WIDTH = 0.0028  # metres at the root
TUFT_RISE, TUFT_FALL, TUFT_CURL = 0.42, 1.9, 0.003  # share along the normal; bend; metres
CAP = 0.004  # metres between the scalp and the layer below the tufts
# The hairline: below these heights an upright head has no hair, by z.
HAIRLINE = (
    (-0.110, -0.032),
    (-0.055, -0.032),
    (-0.034, 0.000),
    (-0.024, 0.052),
    (0.000, 0.053),
    (0.026, 0.053),
    (0.046, 0.068),
    (0.070, 0.094),
    (0.110, 0.104),
)
HAIR_SEED = 5


@dataclass(frozen=True)
class Extra(Mesh):
    """A coloured mesh that the head wears."""

    rgb: F64  # [F, 3] display-referred
    shade: F64  # [V] factor on its light
    gloss: tuple[float, float]  # strength of the highlight, its exponent


def worn_with(surface: Surface, extra: Extra, vertices: F64, gain: F64, gloss: F64) -> Surface:
    """`surface` and the extra as one, with `vertices` [V, 3], `gain` and `gloss` [V] of the extra.

    The texture gets rows of the extra's colours. The rasteriser then decides which hides the other.
    """
    colours, which = np.unique(extra.rgb.astype(np.float32), axis=0, return_inverse=True)
    height, width = surface.texture.shape[:2]
    rows = -(-len(colours) // width)
    strip = np.zeros((rows * width, 3), np.float32)
    strip[: len(colours)] = colours
    # A colour is read at the centre of its texel, where no other texel counts.
    texture = np.concatenate([surface.texture, strip.reshape(rows, width, 3)])
    which = which.reshape(-1)
    middle = np.stack([(which % width + 0.5) / width, (height + which // width + 0.5) / len(texture)], axis=1)
    own = surface.uv * np.array([1, height / len(texture)], np.float32)
    return Surface(
        np.concatenate([surface.vertices, vertices]),
        np.concatenate([surface.triangles, extra.triangles + len(surface.vertices)]),
        np.concatenate([own, np.repeat(middle[:, None], 3, axis=1)]).astype(np.float32),
        texture,
        np.concatenate([surface.gain, gain]).astype(np.float32),
        np.concatenate([surface.gloss, gloss]).astype(np.float32),
        np.concatenate([surface.opacity, np.ones(len(extra.vertices))]).astype(np.float32),
    )


def glasses(head: Head) -> Extra:
    """A frame of dark plastic: two rims, a bridge, two temples; 5 to 30 mm in front of the face."""
    left = _rim()
    temple = _smooth(np.array(TEMPLE), 24)
    half = np.array([(x, y, _rim_z(x) + 0.001) for x, y in BRIDGE])
    bridge = _smooth(np.concatenate([half, half[-2::-1] * (-1, 1, 1)]), 16)
    taper = np.minimum(1, np.arange(24)[::-1] / 1.5)
    forward, up = np.array([0.0, 0, 1]), np.array([0.0, 1, 0])
    parts = []
    for side in (1, -1):
        mirror = np.array([side, 1, 1])
        parts.append(
            tubes((left * mirror)[None], np.ones((1, len(left))), RIM_TUBE, forward, 10, closed=True)
        )
        parts.append(tubes((temple * mirror)[None], taper[None], TEMPLE_TUBE, up, 10))
    parts.append(tubes(bridge[None], np.ones((1, len(bridge))), BRIDGE_TUBE, forward, 10))
    vertices, triangles = joined(parts)
    rgb = np.tile(PLASTIC, (len(triangles), 1))
    return Extra(vertices, triangles, rgb, np.ones(len(vertices)), PLASTIC_GLOSS)


def _rim_z(x: float) -> float:
    return RIM_Z - RIM_WRAP * x * x


def _rim() -> F64:
    """The middle line [n, 3] of the left rim."""
    angle = 2 * np.pi * np.arange(64) / 64
    x, y = (
        middle + half * np.sign(wave) * np.abs(wave) ** (2 / RIM_POWER)
        for middle, half, wave in zip(RIM_MIDDLE, RIM_HALF, (np.cos(angle), np.sin(angle)), strict=True)
    )
    return np.stack([x, y, RIM_Z - RIM_WRAP * x * x], axis=1)


def _smooth(points: F64, count: int) -> F64:
    """[count, 3] along a curve through `points` (Catmull-Rom)."""
    padded = np.concatenate([2 * points[:1] - points[1:2], points, 2 * points[-1:] - points[-2:-1]])
    t = np.linspace(0, len(points) - 1, count)
    k = np.minimum(t.astype(int), len(points) - 2)
    u = (t - k)[:, None]
    a, b, c, d = (padded[k + i] for i in range(4))
    result: F64 = 0.5 * (
        2 * b + (c - a) * u + (2 * a - 5 * b + 4 * c - d) * u**2 + (3 * b - a - 3 * c + d) * u**3
    )
    return result


def hair(head: Head) -> Extra:
    """Some thousand tapered tufts 1 to 3 cm above the scalp, over a layer that covers it."""
    rng = np.random.default_rng(HAIR_SEED)
    cap = _scalp(head)
    corner = head.vertices[head.triangles[cap]]
    normal = head.vertex_normals[head.triangles[cap]]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    face = rng.choice(len(corner), TUFTS, p=area / area.sum())
    share = rng.dirichlet((1, 1, 1), TUFTS)[:, :, None]
    root, away = (corner[face] * share).sum(axis=1), unit((normal[face] * share).sum(axis=1))
    path = _tufts(root, away, rng)
    along = np.linspace(0, 1, TUFT_JOINTS)
    width = np.tile(np.sqrt(1 - along**2) * (1 - 0.5 * along) + 0.02, (TUFTS, 1))
    reference = unit(rng.standard_normal((TUFTS, 3)))
    tufts = tubes(path, width, (TUFT_WIDTH, 0.6 * TUFT_WIDTH), reference, TUFT_SIDES)
    used, flat = np.unique(head.triangles[cap], return_inverse=True)
    layer = (head.vertices[used] + CAP * head.vertex_normals[used], flat.reshape(-1, 3))
    vertices, triangles = joined([tufts, layer])
    bright = np.round(np.exp(HAIR_SHADES * rng.standard_normal(TUFTS)), 2)
    per_tuft = len(tufts[1]) // TUFTS
    factor = np.concatenate([np.repeat(bright, per_tuft), np.full(cap.sum(), 0.6)])
    shade = np.concatenate(
        [np.tile(np.repeat(0.55 + 0.5 * along, TUFT_SIDES), TUFTS), np.full(len(used), 0.5)]
    )
    return Extra(vertices, triangles, factor[:, None] * np.array(HAIR), shade, HAIR_GLOSS)


def _scalp(head: Head) -> npt.NDArray[np.bool_]:
    """Mask [F] of the triangles above the hairline."""
    middle = head.vertices[head.triangles].mean(axis=1)
    z, lowest = np.array(HAIRLINE).T
    above: npt.NDArray[np.bool_] = middle[:, 1] > np.interp(middle[:, 2], z, lowest)
    return head.triangles_in("face", "head") & above


def _tufts(root: F64, away: F64, rng: np.random.Generator) -> F64:
    """Middle lines [TUFTS, TUFT_JOINTS, 3]: away from the scalp, back and to the sides, bent down by their weight."""
    count = len(root)
    side = np.sign(root[:, :1]) * smoothstep(np.abs(root[:, :1]), 0.0, 0.05)
    comb = np.concatenate([0.5 * side, np.zeros((count, 1)), np.full((count, 1), -0.8)], axis=1)
    comb[:, 1] += 0.35 * smoothstep(root[:, 2], 0.02, 0.09)  # up from the forehead
    comb = comb - np.sum(comb * away, axis=1, keepdims=True) * away
    start = unit(TUFT_RISE * away + (1 - TUFT_RISE) * unit(comb) + 0.22 * rng.standard_normal((count, 3)))
    length = rng.uniform(*TUFT_LENGTH, count)
    t = np.linspace(0, 1, TUFT_JOINTS)[None, :, None]
    fall = np.array([0.0, -TUFT_FALL, -0.4]) / 6
    line = start[:, None] * t + (unit(comb)[:, None] * 0.35 + fall) * t**2
    phase, turns = rng.uniform(0, 2 * np.pi, (2, count, 1, 1))
    curl = TUFT_CURL * t * np.sin(phase + (4 + turns) * t) * unit(np.cross(start, away) + 1e-3)[:, None]
    result: F64 = root[:, None] - 0.001 * away[:, None] + length[:, None, None] * line + curl
    return result


def tubes(
    path: F64,  # [S, n, 3] middle lines
    width: F64,  # [S, n] factor on `half`
    half: tuple[float, float],  # half axes across: beside the reference, along it
    reference: F64,  # [3] or [S, 3] along no path
    sides: int,
    closed: bool = False,
) -> tuple[F64, I64]:
    """(vertices [S n sides, 3], triangles) of tubes with elliptic sections, open at their ends unless `closed`."""
    count, n = path.shape[:2]
    if closed:
        tangent = np.roll(path, -1, axis=1) - np.roll(path, 1, axis=1)
    else:
        tangent = np.gradient(path, axis=1)
    tangent = unit(tangent)
    beside = unit(np.cross(tangent, np.broadcast_to(np.atleast_2d(reference)[:, None], path.shape)))
    along = np.cross(tangent, beside)
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = (
        half[0] * np.cos(angle)[:, None] * beside[:, :, None]
        + half[1] * np.sin(angle)[:, None] * along[:, :, None]
    )
    vertices = (path[:, :, None] + width[:, :, None, None] * ring).reshape(-1, 3)
    step, around = np.meshgrid(np.arange(n if closed else n - 1), np.arange(sides), indexing="ij")
    after, beyond = (step + 1) % n, (around + 1) % sides
    a, b, c, d = (
        i * sides + j for i, j in ((step, around), (after, around), (after, beyond), (step, beyond))
    )
    quads = np.stack([a, d, c, a, c, b], axis=-1).reshape(-1, 3)
    triangles = (quads[None] + n * sides * np.arange(count)[:, None, None]).reshape(-1, 3)
    return vertices, triangles.astype(np.int64)


def joined(parts: list[tuple[F64, I64]]) -> tuple[F64, I64]:
    """The meshes as one."""
    begins = np.cumsum([0, *(len(vertices) for vertices, _ in parts[:-1])])
    triangles = [faces + begin for (_, faces), begin in zip(parts, begins, strict=True)]
    return np.concatenate([vertices for vertices, _ in parts]), np.concatenate(triangles)


EXTRAS: dict[str, Callable[[Head], Extra]] = {"glasses": glasses, "hair": hair}
