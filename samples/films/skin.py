"""Six textures by code, none of them the scan's: skin, brows drawn hair by hair, lips, freckles, moles, beard, eyes."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
from numba import prange
from PIL import Image, ImageDraw, ImageFilter

from avatar_runtime.backends.cpu.jit import kernel
from avatar_trainer.head import Head, closing_lids, smoothstep, unit
from samples.capture.eyes import texels
from samples.subjects.colour import SKIN, depth_shade, iris_colour, relief_shade
from samples.subjects.head import DATA
from samples.subjects.surface import Samples

Array = npt.NDArray[Any]
Colour = tuple[float, float, float]

SIZE = 1024  # texels along an edge
# The drawings lie on the face as seen from the front: pixels to a metre, and the box they fill, metres.
SCALE, LEFT, TOP, WIDTH, HEIGHT = 8000.0, -0.09, 0.15, 0.18, 0.34
# From the middle to the side, and the height of the lowest hairs of a brow, metres: where the mesh has its own.
BROW = ((0.012, 0.020, 0.030, 0.045, 0.056), (0.0458, 0.0465, 0.0480, 0.0480, 0.0432))
# Outline of the lips, metres: from the middle to the side, height of the upper and of the lower border.
LIPS = (
    (0.000, -0.0214, -0.0415),
    (0.004, -0.0200, -0.0415),
    (0.007, -0.0212, -0.0410),
    (0.012, -0.0243, -0.0395),
    (0.018, -0.0288, -0.0366),
    (0.025, -0.0334, -0.0338),
)
WAVES = 28  # of a noise
FRECKLE, MOLE = (0.72, 0.58, 0.48), (0.20, 0.12, 0.10)  # factor on the skin; colour


@dataclass(frozen=True)
class Skin:
    """The colours of a person, display-referred, and the sizes of what is painted."""

    tone: Colour
    lips: Colour
    brow: Colour
    iris: Colour  # factor on the iris of samples.subjects.colour
    flush: float  # redness of cheeks, nose, ears
    brow_raised: float  # metres above BROW
    brow_width: float
    brow_share: float  # density of its hairs, 0..1
    beard: float = 0.0  # density of the beard
    freckles: int = 0
    moles: int = 2
    cropped: float = 0.0  # of the hair on the scalp, painted
    seed: int = 0


# fmt: off
SKINS = {
    "fair": Skin((0.86, 0.68, 0.59), (0.72, 0.40, 0.39), (0.42, 0.30, 0.21), (0.90, 1.05, 1.25), flush=0.6,
                 brow_raised=0.0020, brow_width=0.0065, brow_share=0.70, freckles=260, cropped=0.55, seed=1),
    "ruddy": Skin((0.80, 0.57, 0.48), (0.63, 0.34, 0.32), (0.36, 0.27, 0.20), (0.75, 0.90, 1.00), flush=1.0,
                  brow_raised=0.0000, brow_width=0.0085, brow_share=0.85, beard=0.75, moles=4, cropped=0.5, seed=2),
    "olive": Skin((0.72, 0.53, 0.41), (0.58, 0.33, 0.30), (0.10, 0.08, 0.07), (0.70, 0.50, 0.32), flush=0.35,
                  brow_raised=0.0005, brow_width=0.0090, brow_share=1.00, beard=0.35, cropped=0.85, seed=3),
    "brown": Skin((0.52, 0.36, 0.27), (0.45, 0.25, 0.24), (0.07, 0.05, 0.05), (0.50, 0.36, 0.26), flush=0.25,
                  brow_raised=0.0025, brow_width=0.0070, brow_share=0.90, moles=5, cropped=0.9, seed=4),
    "dark": Skin((0.34, 0.23, 0.18), (0.33, 0.19, 0.19), (0.04, 0.03, 0.03), (0.36, 0.26, 0.20), flush=0.12,
                 brow_raised=0.0010, brow_width=0.0080, brow_share=0.90, beard=0.45, cropped=0.95, seed=5),
    "light": Skin((0.81, 0.67, 0.57), (0.68, 0.35, 0.36), (0.13, 0.11, 0.11), (0.45, 0.36, 0.30), flush=0.4,
                  brow_raised=0.0030, brow_width=0.0050, brow_share=0.80, freckles=40, cropped=0.8, seed=6),
}
# fmt: on


@cache
def _texels() -> tuple[Array, Array, Array, Array, Array]:
    """(uv [F, 3, 2]; of the texels in a triangle: row and column [N], its index [N], the place in it [N, 3])."""
    with np.load(DATA / "head_uv.npz", allow_pickle=False) as file:
        uv = file["uv"]
    face, bary = np.full((SIZE, SIZE), -1), np.zeros((SIZE, SIZE, 3))
    texels(uv.astype(np.float64), SIZE, face, bary)
    y, x = np.nonzero(face >= 0)
    return uv, y, x, face[y, x], bary[y, x]


def painted(head: Head, skin: Skin) -> tuple[Array, Array]:
    """(image f32 [SIZE, SIZE, 3], uv [F, 3, 2]) of a skin; `head` is the scan's, whose places the sizes speak of."""
    uv, y, x, face, bary = _texels()
    place = np.einsum("nc,ncx->nx", bary, head.vertices[head.triangles[face]])
    at = Samples(face, bary, place, np.zeros((len(face), 3, 3)), np.zeros(len(face)))
    on_skin = head.triangles_in(*SKIN)[face]
    colour = _skin_colour(head, skin, at)
    for name, tone in PARTS.items():
        rows = head.triangles_in(name)[face]
        colour[rows] = np.array(tone) * (0.94 + 0.06 * _noise(place[rows], 0.004, 3))[:, None]
    colour = np.where(on_skin[:, None], colour, _eyes(head, skin, at, colour) * depth_shade(head, at))
    image = np.tile(np.array(skin.tone, np.float32), (SIZE, SIZE, 1))
    image[y, x] = np.clip(colour, 0, 1)
    return _spread(image, y, x), uv


PARTS: dict[str, Colour] = {
    "mouth_socket": (0.45, 0.19, 0.18),
    "eye_sockets": (0.62, 0.36, 0.33),
    "upper_gums": (0.62, 0.32, 0.31),
    "lower_gums": (0.60, 0.31, 0.30),
    "upper_teeth": (0.80, 0.77, 0.69),
    "lower_teeth": (0.74, 0.71, 0.63),
}


def _spread(image: Array, y: Array, x: Array) -> Array:
    """Texels beside a chart take the colour of the nearest in it, so that its edges do not fade."""
    known = np.zeros((SIZE, SIZE), np.float32)
    known[y, x] = 1
    for _ in range(4):
        near = np.zeros_like(image)
        count = np.zeros_like(known)
        for axis in (0, 1):
            for step in (1, -1):
                near += np.roll(image * known[..., None], step, axis)
                count += np.roll(known, step, axis)
        new = (known == 0) & (count > 0)
        image[new] = near[new] / count[new][:, None]
        known[new] = 1
    return image


def _noise(place: Array, size: float, seed: int) -> Array:
    """[N] a smooth random field with waves as long as `size` metres; deviation 1."""
    rng = np.random.default_rng(seed)
    way = unit(rng.standard_normal((WAVES, 3))) * 2 * np.pi / size * rng.uniform(0.6, 1.5, (WAVES, 1))
    return _waves(place, way, rng.uniform(0, 2 * np.pi, WAVES))


@kernel(parallel=True)
def _waves(place: Array, way: Array, phase: Array) -> Array:
    result = np.empty(len(place))
    for i in prange(len(place)):
        total = 0.0
        for k in range(len(way)):
            total += np.sin(
                place[i, 0] * way[k, 0] + place[i, 1] * way[k, 1] + place[i, 2] * way[k, 2] + phase[k]
            )
        result[i] = total * np.sqrt(2 / len(way))
    return result


def _skin_colour(head: Head, skin: Skin, at: Samples) -> Array:
    """[N, 3] of all texels, as if all were skin."""
    place = at.position
    x, y, z = place.T
    tone = np.array(skin.tone)
    light = at.interpolate(relief_shade(head)[:, None], head.triangles)[:, 0]
    mottled = 1 + 0.025 * _noise(place, 0.02, skin.seed) + 0.02 * _noise(place, 0.003, skin.seed + 50)
    colour = tone * (light * mottled * (1 + 0.012 * _noise(place, 0.0012, skin.seed + 99)))[:, None]
    red = np.array([1.04, 0.80, 0.78])
    colour *= 1 + (red - 1) * (skin.flush * _flushed(place, skin.seed))[:, None]
    sockets = sum(
        np.exp(-((np.abs(x) - cx) ** 2 / 2e-4 + (y - cy) ** 2 / 6e-5)) * (z > 0.06)
        for cx, cy in ((0.028, 0.022), (0.017, 0.043))
    )
    colour *= 1 - np.array([0.13, 0.17, 0.14]) * np.minimum(sockets, 1)[:, None]
    colour *= 1 - skin.cropped * 0.75 * _scalp(place, skin.seed)[:, None] * (1 - 0.5 * np.array(skin.brow))
    colour = _bearded(colour, place, skin)
    drawn = _drawing(skin)
    front = smoothstep(z, 0.045, 0.06) * head.triangles_in(*SKIN)[at.face]
    for name, tint in (
        ("freckles", np.multiply(skin.tone, FRECKLE)),
        ("moles", MOLE),
        ("brows", skin.brow),
    ):
        share = _sampled(drawn[name], place) * front
        colour += share[:, None] * (np.array(tint) - colour)
    colour = _lips(colour, place, skin)
    return _lashes(closing_lids(head), colour, at, skin)


def _flushed(place: Array, seed: int) -> Array:
    """[N] 0..1: cheeks, the tip of the nose, chin and ears."""
    x, y, z = place.T
    cheeks = np.exp(-((np.abs(x) - 0.042) ** 2 / 5e-4 + (y + 0.002) ** 2 / 5e-4))
    nose = np.exp(-(x**2 / 2.5e-4 + (y - 0.0) ** 2 / 2.5e-4)) * (z > 0.11)
    ears = smoothstep(np.abs(x), 0.074, 0.082) * np.exp(-(z**2) / 1e-3) * (np.abs(y - 0.01) < 0.05)
    both = 0.8 * cheeks + nose + 0.9 * ears
    return np.clip(both * (0.8 + 0.2 * _noise(place, 0.012, seed + 7)), 0, 1)


def _scalp(place: Array, seed: int) -> Array:
    """[N] 0..1 where hair grows on the head."""
    y, z = place.T[1:]
    line = np.interp(
        z, (-0.11, -0.034, -0.02, 0.03, 0.05, 0.075, 0.11), (-0.03, -0.03, 0.02, 0.03, 0.07, 0.095, 0.105)
    )
    edge = line + 0.002 * _noise(place, 0.008, seed + 11) + 0.0012 * _noise(place, 0.0015, seed + 12)
    return smoothstep(y, edge, edge + 0.009) * (
        0.86 + 0.1 * np.clip(_noise(place, 0.0012, seed + 13), -1.4, 1.4)
    )


def _bearded(colour: Array, place: Array, skin: Skin) -> Array:
    """The shadow of a beard: cheeks below a line, upper lip, chin, throat."""
    x, y, z = place.T
    side = np.abs(x)
    top = np.interp(side, (0, 0.012, 0.03, 0.055, 0.075, 0.09), (-0.018, -0.02, -0.03, -0.032, 0.0, 0.012))
    grown = smoothstep(y, top, top - 0.010) * smoothstep(y, -0.118, -0.098) * smoothstep(z, -0.005, 0.02)
    bare = np.exp(-((side - 0.0) ** 2 / 3e-5 + (y + 0.062) ** 2 / 2e-5))  # below the lip
    grain = 0.72 + 0.28 * np.clip(
        _noise(place, 0.0011, skin.seed + 21) + 0.5 * _noise(place, 0.009, skin.seed + 22), -1.5, 1.5
    )
    share = skin.beard * grown * (1 - 0.6 * bare) * grain
    return colour + np.clip(0.75 * share, 0, 0.9)[:, None] * (np.array(skin.brow) * 0.9 + 0.02 - colour)


def _near(place: Array, points: Array) -> tuple[Array, Array]:
    """(distance [N], index [N]) of the nearest of the points."""
    which = _nearest(place, points)
    return np.linalg.norm(place - points[which], axis=1), which


@kernel(parallel=True)
def _nearest(place: Array, points: Array) -> Array:
    which = np.zeros(len(place), np.int64)
    for i in prange(len(place)):
        best = np.inf
        for k in range(len(points)):
            a, b, c = place[i, 0] - points[k, 0], place[i, 1] - points[k, 1], place[i, 2] - points[k, 2]
            far = a * a + b * b + c * c
            if far < best:
                best, which[i] = far, k
    return which


def _lips(colour: Array, place: Array, skin: Skin) -> Array:
    """Upper and lower lip with the surfaces on which they meet."""
    x, y, z = place.T
    side, top, bottom = np.array(LIPS).T
    edge = 0.0004 * _noise(place, 0.006, skin.seed + 30)
    above = y - np.interp(np.abs(x), side, top) - edge
    below = np.interp(np.abs(x), side, bottom) - y - edge
    share = smoothstep(np.maximum(above, below), 0.0007, -0.0007) * (z > 0.085) * (np.abs(x) < side[-1])
    wrinkles = 1 + 0.05 * _noise(place * (1, 0.25, 1), 0.0022, skin.seed + 31)
    front = 0.1095 - 0.006 * (x / 0.022) ** 2
    tone = np.array(skin.lips) * (wrinkles * (0.6 + 0.4 * smoothstep(z, front - 0.004, front)))[:, None]
    colour += 0.9 * share[:, None] * (tone - colour)
    return colour


def _lashes(head: Head, colour: Array, at: Samples, skin: Skin) -> Array:
    """A dark line along the edge of the upper lids, which is found where they are shut, and a faint one below them."""
    for side, name in enumerate(("eyeBlinkLeft", "eyeBlinkRight")):
        away = at.position - head.eye_centres[side]
        rows = np.flatnonzero((np.abs(away[:, 0]) < 0.016) & (np.abs(away[:, 1]) < 0.02) & (away[:, 2] > 0))
        way = at.interpolate(head.expression(name), head.triangles)[rows]
        x, y, _ = (at.position[rows] + way).T
        lid = way[:, 1] < -0.003
        column = np.floor((x - x.min()) / 0.0012).astype(int)
        lowest = np.full(column.max() + 1, np.inf)
        np.minimum.at(lowest, column[lid], y[lid])
        middles = x.min() + 0.0012 * (np.arange(len(lowest)) + 0.5)
        known = np.isfinite(lowest)
        above = y - np.interp(x, middles[known], lowest[known])
        lashes = np.where(way[:, 1] < -0.0004, 0.9 * smoothstep(above, 0.0020, 0.0010), 0.0)
        lashes += np.where(way[:, 1] >= -0.0004, 0.35 * smoothstep(above, -0.0016, -0.0006), 0.0) * (
            above < 0.001
        )
        lashes *= smoothstep(np.abs(away[rows, 0]), 0.016, 0.013)
        colour[rows] += lashes[:, None] * (np.array(skin.brow) * 0.35 - colour[rows])
    return colour


def _sampled(drawing: Array, place: Array) -> Array:
    """[N] of a drawing on the face, at its nearest pixel."""
    column = np.clip((place[:, 0] - LEFT) * SCALE, 0, drawing.shape[1] - 1).astype(int)
    row = np.clip((TOP - place[:, 1]) * SCALE, 0, drawing.shape[0] - 1).astype(int)
    result: Array = drawing[row, column]
    return result


def _drawing(skin: Skin) -> dict[str, Array]:
    """Masks 0..1 of what is drawn on the face as seen from the front."""
    rng = np.random.default_rng(skin.seed)
    shape = round(WIDTH * SCALE), round(HEIGHT * SCALE)
    layers = {name: Image.new("L", shape, 0) for name in ("brows", "freckles", "moles")}
    pens = {name: ImageDraw.Draw(layer) for name, layer in layers.items()}

    def pixel(x: float, y: float) -> tuple[float, float]:
        return (x - LEFT) * SCALE, (TOP - y) * SCALE

    for side in (1, -1):
        lift = rng.normal(0, 0.0009)  # no face is the same on both sides
        for _ in range(round(900 * skin.brow_share)):
            t, across = rng.beta(1.1, 1.3), max(rng.normal(0, 0.33), -0.4)
            x = 0.012 + 0.043 * t
            wide = skin.brow_width * (1.0 - 0.75 * t**1.6)
            y = np.interp(x, *BROW) + skin.brow_raised + lift + across * wide
            angle = np.radians(70 - 75 * t - 55 * across * (1 - t)) + rng.normal(0, 0.2)
            long = rng.uniform(0.004, 0.0075)
            end = x + long * np.cos(angle), y + long * 0.75 * np.sin(angle)
            pens["brows"].line(
                [pixel(side * x, y), pixel(side * end[0], end[1])], fill=int(rng.uniform(120, 235)), width=2
            )
    for _ in range(skin.freckles):
        x, y = rng.normal(0, 0.034), rng.normal(0.006, 0.022)
        _dot(pens["freckles"], pixel(x, y), SCALE * rng.uniform(0.0004, 0.0011), int(rng.uniform(50, 140)))
    for _ in range(skin.moles):
        _dot(
            pens["moles"],
            pixel(*rng.uniform((-0.06, -0.075), (0.06, 0.085))),
            SCALE * rng.uniform(0.0008, 0.0017),
            225,
        )
    return {
        name: np.asarray(layer.filter(ImageFilter.GaussianBlur(1.6)), np.float32) / 255
        for name, layer in layers.items()
    }


def _dot(pen: ImageDraw.ImageDraw, middle: tuple[float, float], radius: float, fill: int) -> None:
    x, y = middle
    pen.ellipse([x - radius, y - 0.85 * radius, x + radius, y + 0.85 * radius], fill=fill)


def _eyes(head: Head, skin: Skin, at: Samples, colour: Array) -> Array:
    """The colours with both eyeballs painted, the iris in this person's colour."""
    result: Array = iris_colour(head, at, colour)
    for eye, name in enumerate(("left_eye", "right_eye")):
        rows = np.flatnonzero(head.triangles_in(name)[at.face])
        way = unit(at.position[rows] - head.eye_centres[eye])
        angle = np.degrees(np.arccos(np.clip(way[:, 2], -1, 1)))
        iris = smoothstep(angle, 21.0, 18.0)[:, None]
        result[rows] *= 1 + iris * (np.array(skin.iris) - 1)
    return result
