"""The textured head that captures draw, and their light."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from avatar_runtime.camera import Camera
from avatar_trainer.captures.mesh_raster import MeshImage, Surface, draw
from avatar_trainer.head import NECK, BodyModel, Head, Mesh, unit
from samples.capture.extras import Extra, worn_with
from samples.capture.eyes import lid_shade, painted_eyes
from samples.subjects.colour import surface_opacity
from samples.subjects.head import DATA
from samples.subjects.surface import Samples
from samples.subjects.take import Take, joint_motion, posed_vertices

Array = npt.NDArray[Any]

# The light stands before the subject's left temple and turns with the head, as the head's pose lives in the camera.
LIGHT = unit(np.array([0.35, 0.55, 0.76]))
DARK, LIT, WRAP = 0.80, 0.26, 0.3
# (part of the head, strength of the highlight, its exponent)
GLOSS = {"skin": (0.07, 10.0), "wet": (0.12, 25.0), "eye": (0.45, 60.0)}
WET, EYES = ("upper_teeth", "lower_teeth", "upper_gums", "lower_gums"), ("left_eye", "right_eye")


@dataclass(frozen=True)
class Part(Mesh):
    """The head, or a thing worn, in one pose."""

    shade: Array  # [V] factor on its light
    strength: Array  # of the highlight, [V] or one
    exponent: Array  # of the highlight, [V] or one


@dataclass(frozen=True)
class Model:
    """The textured head that images are made of."""

    head: Head
    body: BodyModel  # of every vertex
    worn: tuple[Extra, ...] = ()

    @cached_property
    def texture(self) -> tuple[Array, Array]:
        """(image f32 [h, w, 3], uv f32 [F, 3, 2])."""
        image = np.asarray(Image.open(DATA / "head_texture.webp").convert("RGB"), np.float32) / 255
        with np.load(DATA / "head_uv.npz", allow_pickle=False) as file:
            return painted_eyes(self.head, image, file["uv"]), file["uv"]

    @cached_property
    def opacity(self) -> Array:
        """[V] the lower edge of the bust fades out."""
        v = len(self.head.vertices)
        nothing = np.zeros((v, 3, 3))
        at = Samples(np.zeros(v, int), np.zeros((v, 3)), self.head.vertices, nothing, np.zeros(v))
        return surface_opacity(self.head, at).astype(np.float32)

    @cached_property
    def gloss(self) -> tuple[Array, Array]:
        """(strength [V], exponent [V]) of the highlights."""
        table = np.tile(GLOSS["skin"], (len(self.head.vertices), 1))
        table[self.head.in_part(*WET)] = GLOSS["wet"]
        table[self.head.in_part(*EYES)] = GLOSS["eye"]
        table[self.head.in_part("mouth_socket", "eye_sockets"), 0] = 0
        strength, exponent = table.T
        return strength, exponent

    def image(self, take: Take, frame: int, camera: Camera, samples: int) -> MeshImage:
        """One frame of a take, seen by `camera`."""
        parts = self.parts(take, frame)
        return draw(self.surface(parts, [captured(part, camera.centre) for part in parts]), camera, samples)

    def region(self, take: Take, frame: int, camera: Camera, samples: int) -> Array:
        """[H, W] share of each pixel in which something worn is seen; independent of the light."""
        parts = self.parts(take, frame)
        none = [np.zeros(len(part.vertices)) for part in parts]
        white = [(none[0], none[0]), *((0 * dark, 1 + dark) for dark in none[1:])]
        image = draw(self.surface(parts, white), camera, samples)
        share: Array = image.colour[..., 0] * image.alpha
        return share

    def parts(self, take: Take, frame: int) -> tuple[Part, ...]:
        """The head in a frame, then what it wears, which follows the skull."""
        mesh = Mesh(posed_vertices(self.body, take, frame), self.head.triangles)
        turn, shift = joint_motion(self.body, take, frame, NECK)
        worn = [
            Part(e.vertices @ turn.T + shift, e.triangles, e.shade, *map(np.array, e.gloss))
            for e in self.worn
        ]
        return Part(mesh.vertices, mesh.triangles, lid_shade(self.head, mesh), *self.gloss), *worn

    def surface(self, parts: Sequence[Part], light: Sequence[tuple[Array, Array]]) -> Surface:
        """The parts as one; `light` has the gain [V] and the gloss [V] of each."""
        texture, uv = self.texture
        (gain, gloss), *others = light
        surface = Surface(
            parts[0].vertices,
            parts[0].triangles,
            uv,
            texture,
            gain.astype(np.float32),
            gloss.astype(np.float32),
            self.opacity,
        )
        for extra, part, (gain, gloss) in zip(self.worn, parts[1:], others, strict=True):
            surface = worn_with(surface, extra, part.vertices, gain, gloss)
        return surface


def captured(part: Part, eye: Array) -> tuple[Array, Array]:
    """(factor on the colour [V], what shines [V]) in the light of the captures; `eye` [3] is the camera."""
    normal = part.vertex_normals
    half = unit(LIGHT + unit(eye - part.vertices))
    shine = part.strength * np.clip(np.sum(half * normal, axis=1), 0, 1) ** part.exponent
    return part.shade * matt(normal), part.shade * shine


def matt(normal: Array) -> Array:
    """[...] factor that the light of the captures puts on the display-referred colour, by unit normals [..., 3]."""
    lambert = np.clip((normal @ LIGHT + WRAP) / (1 + WRAP), 0, 1)
    gain: Array = DARK + LIT * lambert
    return gain
