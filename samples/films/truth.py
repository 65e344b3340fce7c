"""The truth of a written film: camera, poses, weights, and the head itself, seen from where you like."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.rotation import matrix_from_rotvec
from samples.films.motion import Motion
from samples.films.person import person
from samples.films.render import Scene
from samples.films.table import film

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class Truth:
    """T frames of a film. OpenCV's camera: a point x of the head is at R x + t before it, metres."""

    folder: Path
    name: str
    size: int
    fps: float
    times: Array  # [T] seconds
    focal: float  # pixels
    principal: Array  # [2] pixels, centres at half integers
    R: Array  # [T, 3, 3]
    t: Array  # [T, 3]
    weights: Array  # [T, 51]
    names: tuple[str, ...]
    neutral: Array  # [V, 3] of the face at rest, in the head's own axes
    motion: Motion

    @cached_property
    def scene(self) -> Scene:
        """The film's scene, made again."""
        return Scene(film(self.name), person(film(self.name)), self.motion, self.size)

    def vertices(self, frame: int) -> Array:
        """The head's vertices [V, 3] in a frame, before the camera, metres."""
        return self.scene.vertices(frame)

    def pixels(self, frame: int) -> Array:
        """Where the head's vertices [V, 2] are in the image."""
        return self.projected(self.vertices(frame))

    def projected(self, points: Array) -> Array:
        """Pixels [N, 2] of points before the camera."""
        result: Array = self.focal * points[:, :2] / points[:, 2:] + self.principal
        return result


def load(folder: Path) -> Truth:
    """The truth of the film in a folder."""
    with np.load(folder / "truth.npz", allow_pickle=False) as file:
        data = {name: file[name] for name in file.files}
    return Truth(
        folder=folder,
        name=str(data["film"]),
        size=int(data["size"]),
        fps=float(data["fps"]),
        times=data["times"],
        focal=float(data["focal"]),
        principal=data["principal"],
        R=data["R"],
        t=data["t"],
        weights=data["weights"],
        names=tuple(data["names"].tolist()),
        neutral=data["neutral"].astype(np.float64),
        motion=Motion(data["weights"], data["root"], data["neck"], data["shift"]),
    )


def middle(truth: Truth, frame: int) -> Array:
    """A point [3] between the ears, before the camera: a camera goes to the side about it."""
    place: Array = truth.R[frame] @ (0.0, -0.015, 0.06) + truth.t[frame]
    return place


def side_camera(truth: Truth, frame: int, yaw: float) -> tuple[Array, Array]:
    """(R, t) from the film's camera to one `yaw` degrees to the side, as far from the head and turned to it."""
    turn, axis = matrix_from_rotvec(np.array([0.0, np.radians(yaw), 0.0])), middle(truth, frame)
    return turn, axis - turn @ axis


def side_view(truth: Truth, frame: int, yaw: float) -> tuple[Array, Array]:
    """(colour times alpha [H, W, 3], alpha [H, W]) of the figure in a frame, its light unchanged, from the side."""
    return truth.scene.rgba(frame, side_camera(truth, frame, yaw))
