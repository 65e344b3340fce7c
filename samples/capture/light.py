"""The truth of relighting: the head in lights and poses that no training saw, computed in linear light.

Each pose is drawn in the light of the captures, which is `train`, and in every light of LIGHTS, which is `test`.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from avatar_runtime.camera import Camera
from avatar_runtime.light import Light, light_of
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_trainer.captures.mesh_raster import MeshImage, Surface, Visible, draw, pixels, visible
from avatar_trainer.captures.own import Shot
from avatar_trainer.head import JOINTS, NECK, BodyModel, build_body_model, save_body, tracking_body
from samples.capture.extras import EXTRAS
from samples.capture.head import blinking_head, write_frames
from samples.capture.linear_light import (
    BIAS,
    FLOOR_CELLS,
    Hits,
    Lamp,
    display,
    floor,
    harmonics,
    hits,
    lamp,
    linear,
    reached,
    shaded,
)
from samples.capture.model import Model, Part, captured, matt
from samples.capture.shots import camera_towards, rays_per_pixel, shot
from samples.capture.unseen import HEAD, LICENSE, chosen, recorded
from samples.subjects.take import Take, joint_motion, performed

Array = npt.NDArray[Any]
Said = Mapping[str, Any]  # a light in the words of SPEC.md, section 19

CAPTURED, CAPTURE_LIGHT, FOLDER, FLOOR = "capture", "capture_light.json", "lights", "floor"


def _key(direction: list[float], colour: float | list[float]) -> Said:
    return {"direction": direction, "colour": colour if isinstance(colour, list) else [colour] * 3}


# From above bluish, from below brownish: the first row and that of y.
SKY = [[1.90, 1.93, 2.09], [-0.44, -0.62, -0.84], *([[0.0, 0.0, 0.0]] * 7)]
LIGHTS: Mapping[str, Said] = {
    "left": {"ambient": [0.12] * 3, "lights": [_key([1, 0.25, 0.35], 0.95)]},
    "right": {"ambient": [0.12] * 3, "lights": [_key([-1, 0.25, 0.35], 0.95)]},
    "above": {"ambient": [0.15] * 3, "lights": [_key([0.05, 1, 0.35], 0.95)]},
    "below": {"ambient": [0.12] * 3, "lights": [_key([0, -1, 0.6], 0.85)]},
    "front": {"ambient": [0.15] * 3, "lights": [_key([0, 0.1, 1], 0.9)]},
    "rim": {"ambient": [0.1] * 3, "lights": [_key([0.8, 0.35, -0.8], 1.3), _key([-0.4, 0.2, 1], 0.25)]},
    "red": {"ambient": [0.10, 0.08, 0.08], "lights": [_key([0.6, 0.5, 0.6], [1.1, 0.35, 0.25])]},
    "green": {"ambient": [0.07, 0.10, 0.08], "lights": [_key([-0.5, 0.6, 0.6], [0.3, 0.95, 0.5])]},
    "warm_cool": {
        "ambient": [0.06, 0.07, 0.09],
        "lights": [_key([1, 0.2, 0.3], [1.0, 0.62, 0.35]), _key([-1, 0.2, 0.3], [0.3, 0.5, 0.95])],
    },
    "sky": {"ambient": SKY},
    "near": {
        "ambient": [0.12] * 3,
        "lights": [{"position": [0.22, 0.02, 0.22], "colour": [0.05, 0.045, 0.038]}],
    },
    "hard": {"ambient": [0.04] * 3, "lights": [_key([-0.7, 0.6, 0.5], 1.2)]},
}
# Of a pose: how the neck is turned, how the whole avatar is (radians about x, y, z), and the camera's yaw and pitch.
NO = (0.0, 0.0, 0.0)
POSES = (
    (NO, NO, (0, 0)),
    ((0.0, 0.35, 0.0), NO, (20, 4)),
    (NO, (0.0, -0.35, 0.0), (-20, -4)),
    ((0.2, 0.0, 0.0), NO, (14, -6)),
    (NO, (-0.15, 0.2, 0.0), (-30, 6)),
    ((0.0, 0.0, 0.2), NO, (0, 0)),
    (NO, (0.1, -0.3, 0.0), (28, 4)),
    ((0.0, 0.5, 0.0), NO, (-28, -4)),
    (NO, (0.0, -0.5, 0.1), (10, 0)),
    ((-0.1, 0.1, -0.1), (0.0, 0.3, 0.0), (0, 5)),
)
SHIFT = (0.02, 0.01, -0.01)  # metres that the avatar is moved for each pose
GREY = 0.6  # display value on which the light of the captures and its linear form agree
SOURCE = (
    "synthetic: computed pictures of a scanned head in computed light, no footage; moved by frames of a real "
    "recording that no sample is trained on; parameters exact"
)


def capture_light() -> Said:
    """The light of the captures, which multiplies display values, as linear light that turns with the head."""
    count = np.arange(4000) + 0.5
    z, angle = 1 - count / 2000, count * np.pi * (3 - np.sqrt(5))
    r = np.sqrt(1 - z * z)
    normal = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1)
    factor = linear(GREY * matt(normal)) / linear(np.array(GREY))
    rows = np.linalg.lstsq(harmonics(normal), factor, rcond=None)[0]
    return {"ambient": np.repeat(rows[:, None], 3, axis=1).round(5).tolist(), "frame": "head"}


@dataclass(frozen=True)
class Scene:
    """The head in one pose, and a camera."""

    model: Model
    take: Take
    frame: int
    size: int

    @property
    def world(self) -> Array:
        """[4, 4] world from avatar."""
        return homogeneous(matrix_from_rotvec(np.array(POSES[self.frame][1])), self.frame * np.array(SHIFT))

    @property
    def view(self) -> tuple[Array, Array, Array]:
        """K, R, t."""
        target, distance, fov_y = HEAD
        yaw, pitch = np.radians(POSES[self.frame][2])
        return camera_towards(self.world[:3, 3] + target, distance, yaw, pitch, fov_y, self.size)

    @cached_property
    def camera(self) -> Camera:
        k, rotation, shift = self.view
        return Camera.from_opencv(rotation, shift, k, self.size, self.size)

    @cached_property
    def parts(self) -> tuple[Part, ...]:
        turn, shift = self.world[:3, :3], self.world[:3, 3]
        own = self.model.parts(self.take, self.frame)
        return tuple(replace(part, vertices=part.vertices @ turn.T + shift) for part in own)

    @cached_property
    def surface(self) -> Surface:
        """Without light."""
        none = [np.zeros(len(part.vertices)) for part in self.parts]
        return self.model.surface(self.parts, [(dark, dark) for dark in none])

    @cached_property
    def seen(self) -> Visible:
        return visible(self.surface, self.camera, rays_per_pixel(self.size))

    @cached_property
    def hits(self) -> list[Hits]:
        return hits(self.surface, self.parts, self.seen)

    def captured(self) -> MeshImage:
        """As the captures are drawn: their light turns with the head."""
        turn, shift = joint_motion(self.model.body, self.take, self.frame, NECK)
        turn, shift = self.world[:3, :3] @ turn, self.world[:3, :3] @ shift + self.world[:3, 3]
        upright = [replace(part, vertices=(part.vertices - shift) @ turn) for part in self.parts]
        light = [captured(part, (self.camera.centre - shift) @ turn) for part in upright]
        return draw(self.model.surface(self.parts, light), self.camera, rays_per_pixel(self.size))

    def lit(self, light: Light, by: Lamp | None = None) -> MeshImage:
        """In a light of the world; `by`, its first lamp, casts shadows."""
        eye, shape = self.camera.centre.astype(np.float64), self.seen.layers[0].shape
        colour, through = np.zeros((*shape, 3), np.float32), np.ones(shape, np.float32)
        for found in self.hits:
            free = 1.0 if by is None else reached(found.at + BIAS * found.normal, by)
            at = found.row, found.column
            share = found.alpha * through[at]
            colour[at] += share[:, None] * display(shaded(found, light, eye, free))
            through[at] -= share
        return pixels(colour, through, rays_per_pixel(self.size))


def posed(body: BodyModel) -> Take:
    """The poses: every second one of those of `--unseen`, and how the neck is turned."""
    names = tuple(sorted(body.expression_names))
    weights = recorded(names)
    rows = weights[chosen(dict(zip(names, weights.T, strict=True)), 2 * len(POSES))[::2]]
    take = performed(body, np.zeros(body.shapedirs_identity.shape[2]), names, rows)
    take.pose[:, NECK] += np.array([neck for neck, _, _ in POSES], np.float32)
    return take


def write_light(out: Path, size: int, worn: tuple[str, ...] = (), shadow: bool = False) -> Path:
    """Write every pose in every light into the folder `out` as a capture; the path of capture.json.

    A frame is called LIGHT_POSE. lights/LIGHT.json are the lights, capture_light.json is that of the captures. With
    `shadow` the first light of each casts, on the head itself and on a floor: floor/LIGHT_POSE.png is 0 in the shadow.
    """
    head = blinking_head()
    model = Model(head, build_body_model(head), tuple(EXTRAS[name](head) for name in worn))
    body = tracking_body(head, model.body)
    save_body(body, np.zeros(0), out / "body")
    said = {name: {**light, "shadow": True} if shadow else light for name, light in LIGHTS.items()}
    (out / FOLDER).mkdir(exist_ok=True)
    for name, light in {f"{FOLDER}/{name}.json": light for name, light in said.items()}.items():
        (out / name).write_text(json.dumps(light, indent=1) + "\n")
    (out / CAPTURE_LIGHT).write_text(json.dumps(capture_light(), indent=1) + "\n")
    lights = {name: light_of(light, name) for name, light in said.items()}
    frames = _frames(out, model, posed(model.body), size, lights)
    name = ", ".join(["scanned head in many lights, synthetic", *worn])
    return write_frames(out, body, frames, name=name, fps=60.0, source=SOURCE, license=LICENSE)


def _frames(
    out: Path, model: Model, take: Take, size: int, lights: Mapping[str, Light]
) -> Iterator[tuple[str, Shot]]:
    for k in range(len(POSES)):
        scene = Scene(model, take, k, size)
        rest = dict(zip(JOINTS, take.pose[k], strict=True))
        stated = scene.view, take.expression[k], rest
        yield f"{CAPTURED}_{k:02d}", shot(scene.captured(), *stated, "train", scene.world)
        for name, light in lights.items():
            by = lamp(light, scene.surface) if light.shadow and light.lights else None
            yield f"{name}_{k:02d}", shot(scene.lit(light, by), *stated, "test", scene.world)
            at = floor(light)
            if by is not None and at is not None:
                free = reached(at, by).reshape(FLOOR_CELLS, FLOOR_CELLS)
                (out / FLOOR).mkdir(exist_ok=True)
                Image.fromarray(np.uint8(255 * free)).save(out / FLOOR / f"{name}_{k:02d}.png")
