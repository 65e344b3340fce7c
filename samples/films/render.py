"""Frames of a film: the figure before the room, seen by a fixed camera while its shutter is open."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_trainer.head import NECK, unit
from samples.films.motion import Motion, motion
from samples.films.person import Person, Posed, person
from samples.films.raster import exposed
from samples.films.room import LIGHTS, background, lit
from samples.films.table import Film
from samples.subjects.take import Take

Array = npt.NDArray[Any]

SIZE = 512
FACE_PIXELS, FACE_HEIGHT = 220 / 512, 0.18  # share of the width that a face of so many metres fills
LOOKED_AT = (0.0, -0.015, 0.06)  # the middle of the image when the head is at rest
FLIP = np.diag([1.0, -1.0, -1.0])  # from the figure's axes to the camera's
SHUTTER = 0.5  # share of a frame for which the light comes in
# (time, x, y) of the parts of a frame that are averaged: shares of the shutter and of a pixel.
PARTS = np.array([(-0.375, -0.25, 0.25), (-0.125, 0.25, -0.25), (0.125, -0.25, -0.25), (0.375, 0.25, 0.25)])
GRAIN = (0.010, 0.014)  # deviation of the sensor's noise in the dark, and what light adds


@dataclass(frozen=True)
class Scene:
    """A film before it is filmed."""

    film: Film
    person: Person
    motion: Motion
    size: int = SIZE

    @property
    def frames(self) -> int:
        return len(self.motion.weights)

    @property
    def focal(self) -> float:
        """Pixels."""
        return self.film.focal * self.size

    @property
    def distance(self) -> float:
        """Metres from the camera to the face at rest."""
        return self.film.focal * FACE_HEIGHT / FACE_PIXELS

    @cached_property
    def intrinsics(self) -> Array:
        """K [3, 3]."""
        return np.array([[self.focal, 0, self.size / 2], [0, self.focal, self.size / 2], [0, 0, 1.0]])

    @cached_property
    def take(self) -> Take:
        return self.person.take(self.motion)

    def shift(self, frame: int) -> Array:
        """Where the figure stands in a frame, in its own axes about the camera: added to its vertices."""
        x, y, nearer = self.motion.shift[frame]
        place: Array = np.array([x, y, -self.distance * (1 - nearer)]) - LOOKED_AT
        return place

    def camera_from_head(self, frame: int) -> tuple[Array, Array]:
        """(R, t), OpenCV: a point x of the skull is at R x + t before the camera."""
        turn, origin = self.person.joint(self.take, frame, NECK)
        return FLIP @ turn, FLIP @ (origin + self.shift(frame))

    def vertices(self, frame: int) -> Array:
        """The head's vertices [V, 3] before the camera, metres."""
        posed = self.person.posed(self.take, frame).vertices[: len(self.person.head.vertices)]
        return (posed + self.shift(frame)) @ FLIP

    def placed(self, frame: int) -> Posed:
        """The whole figure, in its own axes about the camera."""
        posed = self.person.posed(self.take, frame)
        return Posed(posed.vertices + self.shift(frame), posed.normals)

    def rgba(self, frame: int, view: tuple[Array, Array] | None = None) -> tuple[Array, Array]:
        """(colour times alpha [H, W, 3], alpha [H, W]) without blur; seen by the film's camera, or by `view` (R, t).

        A view takes points before the film's camera to points before itself.
        """
        posed = self.placed(frame)
        return self._exposed(posed, np.zeros_like(posed.vertices), view)

    def head_share(self, frame: int, view: tuple[Array, Array] | None = None) -> Array:
        """[H, W] share of each pixel in which the head is seen, with hair and glasses, and not the shirt."""
        posed = self.placed(frame)
        turn, origin = view or (np.eye(3), np.zeros(3))
        white = np.ones((1, 1, 3), np.float32)
        image = self._drawn(
            posed, 0 * posed.vertices, turn, origin, white, self.person.above_shirt, 0 * self.person.shade
        )
        share: Array = image[..., 0]
        return share

    def filmed(self) -> Iterator[Array]:
        """Every frame u8 [H, W, 3]: motion blur, the room, noise."""
        rng = np.random.default_rng(self.film.seed + 1)
        room = background(self.size, self.size, self.film.seed + 2)
        window = [self.placed(0)] * 2
        for frame in range(self.frames):
            window.append(self.placed(min(frame + 1, self.frames - 1)))
            speed = (window[2].vertices - window[0].vertices) / 2
            colour, alpha = self._exposed(window[1], speed, None)
            image = colour + (1 - alpha[..., None]) * room
            dark, bright = GRAIN
            image += rng.standard_normal(image.shape, np.float32) * (dark + bright * np.sqrt(image))
            yield np.uint8(np.clip(image, 0, 1) * 255 + 0.5)
            window.pop(0)

    def _exposed(self, posed: Posed, speed: Array, view: tuple[Array, Array] | None) -> tuple[Array, Array]:
        person = self.person
        turn, origin = view or (np.eye(3), np.zeros(3))
        eye = FLIP @ (-turn.T @ origin)  # of the camera, in the figure's axes
        gain, shine = lit(LIGHTS[self.film.light], posed.normals, unit(eye - posed.vertices), *person.gloss)
        image = self._drawn(
            posed, speed, turn, origin, person.surface.texture, person.shade * gain, person.shade * shine
        )
        return image[..., :3], image[..., 3]

    def _drawn(
        self,
        posed: Posed,
        speed: Array,
        turn: Array,
        origin: Array,
        texture: Array,
        gain: Array,
        gloss: Array,
    ) -> Array:
        """[H, W, 4]: colour times alpha, alpha."""
        surface = self.person.surface
        image = np.zeros((len(PARTS), self.size, self.size, 4), np.float32)
        exposed(
            posed.vertices,
            SHUTTER * speed,
            turn @ FLIP,
            origin,
            surface.triangles,
            surface.uv,
            texture,
            gain,
            gloss,
            self.focal,
            PARTS + np.array([0, self.size / 2, self.size / 2]),
            image,
        )
        mean: Array = image.mean(axis=0)
        return mean


def scene(film: Film, seconds: float | None = None, size: int = SIZE) -> Scene:
    """The film's scene; of `seconds`, else as long as the table says."""
    from samples.films.motion import FPS

    who = person(film)
    frames = round((seconds or film.seconds) * FPS)
    return Scene(film, who, motion(who.names, frames, film.seed), size)
