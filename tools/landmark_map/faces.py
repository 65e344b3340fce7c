"""Heads drawn at random, with all that is true about them, and what MediaPipe says of their pictures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import cv2
import mediapipe
import numpy as np
import numpy.typing as npt
from mediapipe.tasks import python as tasks
from mediapipe.tasks.python import vision
from samples.capture.extras import Extra, glasses, worn_with
from samples.capture.eyes import lid_shade
from samples.capture.head import blinking_head, recorded
from samples.capture.model import Model
from samples.subjects.take import performed, posed_vertices

from avatar_runtime.camera import Camera
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.captures.mesh_raster import Surface, draw
from avatar_trainer.film.models import LANDMARKER
from avatar_trainer.head import Mesh, build_body_model, head_for, load_head_model, unit
from tools.landmark_map.skins import regions, skin

Array = npt.NDArray[Any]
Random = np.random.Generator

SIZE, RAYS = 288, 2  # pixels of a picture; rays across a pixel
FACE = (100.0, 225.0)  # pixels from hairline to chin, TALL metres, at the head's distance
TALL, DISTANCE = 0.19, (0.3, 1.6)  # metres
YAW, PITCH, ROLL = (np.radians(angle) for angle in (42.0, 27.0, 16.0))
PLAIN = 3  # every third skin has nothing of the scan's
MIDDLE = (0.0, -0.01, 0.06)  # metres: what the camera looks at
ONE_SIDED = ("jawLeft", "jawRight", "mouthLeft", "mouthRight")
GAZE = (0.5, 0.4)  # deviation of weights that turn both eyes: aside, up or down
WORN = 0.1  # share of the pictures with glasses


@dataclass(frozen=True)
class Faces:
    """N pictures' truth, and MediaPipe's findings. Pixels have their centres at .5; head space in metres."""

    identity: Array  # i64 [N] which identity
    skin: Array  # i64 [N] which texture
    weights: Array  # f32 [N, 51] true, in the order of the head's names
    rotation: Array  # f32 [N, 3, 3] camera_from_head
    translation: Array  # f32 [N, 3]
    focal: Array  # f32 [N] pixels; the principal point is the picture's middle
    pixels: Array  # f32 [N, V, 2] every vertex in the picture
    landmarks: Array  # f32 [N, 478, 3] MediaPipe's, pixels; z is its own depth
    scores: Array  # f32 [N, 52] MediaPipe's weights, `_neutral` first
    matrix: Array  # f32 [N, 4, 4] MediaPipe's pose

    def save(self, path: Path) -> None:
        """As one .npz."""
        path.parent.mkdir(parents=True, exist_ok=True)
        np.savez(path, **{field.name: getattr(self, field.name) for field in fields(self)})

    @staticmethod
    def load(paths: list[Path]) -> Faces:
        """The pictures of several files, in order."""
        parts = [dict(np.load(path, allow_pickle=False)) for path in paths]
        return Faces(**{f.name: np.concatenate([part[f.name] for part in parts]) for f in fields(Faces)})

    def chosen(self, mask: Array | slice) -> Faces:
        """The pictures in `mask` [N]."""
        return Faces(**{field.name: getattr(self, field.name)[mask] for field in fields(self)})


class Detector:
    """MediaPipe's face landmarker on single pictures."""

    def __init__(self) -> None:
        options = vision.FaceLandmarkerOptions(
            base_options=tasks.BaseOptions(model_asset_path=str(LANDMARKER.path())),
            output_face_blendshapes=True,
            output_facial_transformation_matrixes=True,
        )
        self._landmarker = vision.FaceLandmarker.create_from_options(options)

    def __call__(self, rgb: Array) -> tuple[Array, Array, Array] | None:
        """(landmarks [478, 3] pixels, scores [52], pose [4, 4]) of the first face of u8 [H, W, 3], if there is one."""
        image = mediapipe.Image(image_format=mediapipe.ImageFormat.SRGB, data=np.ascontiguousarray(rgb))
        found = self._landmarker.detect(image)
        if not found.face_landmarks:
            return None
        height, width = rgb.shape[:2]
        points = [(p.x * width, p.y * height, p.z * width) for p in found.face_landmarks[0]]
        scores = [category.score for category in found.face_blendshapes[0]]
        return np.array(points), np.array(scores), np.array(found.facial_transformation_matrixes[0])


class Studio:
    """The scan's head, `skins` textures for it, and people at random."""

    def __init__(self, skins: int, seed: int) -> None:
        self.head, self.seed = blinking_head(), seed
        self.modes = len(load_head_model().identity)
        model = Model(self.head, build_body_model(self.head))
        self.uv, parts = model.texture[1], regions(model)
        draws = (np.random.default_rng([seed, 1, k]) for k in range(skins - 1))
        self.skins = [model.texture[0], *(skin(parts, rng, k % PLAIN == 1) for k, rng in enumerate(draws))]
        self.names = self.head.expression_names
        self.moves = recorded(self.names, 2000)
        self.glasses = glasses(self.head)

    def person(self, number: int) -> Model:
        """Identity `number`; 0 is the scan."""
        rng = np.random.default_rng([self.seed, 2, number])
        head = head_for(rng.normal(size=self.modes)) if number else self.head
        return Model(head, build_body_model(head))

    def weights(self, rng: Random) -> Array:
        """Weights [51] at random: of the recording, of a few expressions, or of both; then lids and gaze."""
        kind, result = rng.random(), dict.fromkeys(self.names, 0.0)
        if kind < 0.65:
            frame = self.moves[rng.integers(len(self.moves))] * rng.uniform(0.2, 1.1)
            result.update(zip(self.names, frame.tolist(), strict=True))
        if kind > 0.35:
            single = [name for name in self.names if not name.startswith("eyeLook")]
            for name in rng.choice(single, rng.integers(1, 5), replace=False).tolist():
                result[name] = rng.uniform(0.1, 1)
                other = name.replace("Left", "Right") if "Left" in name else name.replace("Right", "Left")
                if rng.random() < 0.75 and name not in ONE_SIDED:
                    result[other] = result[name]
        if rng.random() < 0.25:
            result["eyeBlinkLeft"] = result["eyeBlinkRight"] = rng.uniform(0.3, 1)
        if rng.random() < 0.6:
            aside, above = rng.normal(size=2) * GAZE
            for side, inwards in (("Left", -aside), ("Right", aside)):
                for way, angle in (("In", inwards), ("Out", -inwards), ("Up", above), ("Down", -above)):
                    result[f"eyeLook{way}{side}"] = max(angle, 0)
        result["mouthClose"] = min(result["mouthClose"], result["jawOpen"])
        return np.clip(list(result.values()), 0, 1)

    def rotation(self, rng: Random) -> Array:
        """camera_from_head [3, 3] at random."""
        return turn(rng)

    def surface(
        self, model: Model, shade: Array, vertices: Array, image: Array, eye: Array, look: Random
    ) -> Surface:
        """The posed head in a light at random, seen from `eye` [3], sometimes with glasses."""
        mesh = Mesh(vertices, self.head.triangles)
        light = unit(np.array([look.normal() * 0.9, 0.35 + 0.6 * look.normal(), 1.0]))
        ambient, wrap = look.uniform(0.3, 0.85), look.uniform(0.1, 0.5)

        def lit(mesh: Mesh, strength: Array, power: Array) -> tuple[Array, Array]:
            normal = mesh.vertex_normals
            direct = np.clip((normal @ light + wrap) / (1 + wrap), 0, 1)
            half = unit(light + unit(eye - mesh.vertices))
            return ambient + (1.1 - ambient) * direct, strength * np.clip(
                (half * normal).sum(1), 0, 1
            ) ** power

        gain, shine = lit(mesh, *model.gloss)
        made = Surface(
            vertices,
            mesh.triangles,
            self.uv,
            image * look.uniform(0.92, 1.08, 3).astype(np.float32),
            (shade * gain).astype(np.float32),
            (shade * shine).astype(np.float32),
            np.ones(len(vertices), np.float32),
        )
        if look.random() > WORN:
            return made
        worn = self._fitted(vertices)
        gain, shine = lit(worn, *map(np.array, worn.gloss))
        return worn_with(made, worn, worn.shade * gain, shine)

    def _fitted(self, vertices: Array) -> Extra:
        """The glasses as far in front of these eyes as of the scan's."""
        eyes = self.head.in_part("left_eye", "right_eye")
        move = vertices[eyes].mean(axis=0) - self.head.vertices[eyes].mean(axis=0)
        return replace(self.glasses, vertices=self.glasses.vertices + move + (0, 0, 0.003))

    def picture(
        self, model: Model, shade: Array, image: Array, rng: Random, look: Random
    ) -> tuple[Array, dict[str, Array]]:
        """(u8 [SIZE, SIZE, 3], the truth by the fields of Faces); `look` draws what stays the same over a film."""
        weights = self.weights(rng)
        take = performed(
            model.body, np.zeros(model.body.shapedirs_identity.shape[2]), self.names, weights[None]
        )
        vertices = posed_vertices(model.body, take, 0)
        rotation = self.rotation(rng)
        distance = np.exp(look.uniform(*np.log(DISTANCE)))
        focal = np.exp(look.uniform(*np.log(FACE))) / TALL * distance
        aside = rng.uniform(-0.08, 0.08, 2) * SIZE / focal * distance
        translation = np.array([*aside, distance]) - rotation @ MIDDLE
        k = np.array([[focal, 0, SIZE / 2], [0, focal, SIZE / 2], [0, 0, 1]])
        camera = Camera.from_opencv(rotation, translation, k, SIZE, SIZE)
        surface = self.surface(model, shade, vertices, image, -rotation.T @ translation, look)
        drawn = draw(surface, camera, RAYS)
        x = vertices @ rotation.T + translation
        truth = dict(weights=weights, rotation=rotation, translation=translation, focal=np.array(focal))
        truth["pixels"] = x[:, :2] / x[:, 2:] * focal + SIZE / 2
        return developed(drawn.colour, drawn.alpha, look), truth


def turn(rng: Random) -> Array:
    """camera_from_head [3, 3]: turned by up to YAW, PITCH and ROLL, the camera upside down as OpenCV's are."""
    yaw, pitch, roll = rng.uniform(-1, 1, 3) * (YAW, PITCH, ROLL)
    spin = matrix_from_rotvec(np.array([0, yaw, 0]))
    result: Array = (
        matrix_from_rotvec(np.array([0, 0, roll]))
        @ np.diag([1.0, -1, -1])
        @ matrix_from_rotvec(np.array([pitch, 0, 0]))
        @ spin
    )
    return result


def developed(colour: Array, alpha: Array, rng: Random) -> Array:
    """u8 [H, W, 3] before a background at random, blurred, with noise, now and then through JPEG."""
    small = rng.uniform(0, 1) + rng.normal(size=3) * 0.15 + rng.normal(size=(4, 4, 3)) * rng.uniform(0, 0.2)
    ground = cv2.resize(small, alpha.shape[::-1], interpolation=cv2.INTER_CUBIC)
    image = colour * alpha[..., None] + ground * (1 - alpha[..., None])
    image = cv2.GaussianBlur(image, (0, 0), rng.uniform(0.3, 1.1))
    image = np.clip(image, 0, 1) ** rng.uniform(0.8, 1.25) + rng.normal(size=image.shape) * rng.uniform(
        0, 0.02
    )
    coded = np.round(np.clip(image, 0, 1) * 255).astype(np.uint8)
    if rng.random() < 0.4:
        quality = int(rng.integers(50, 95))
        coded = cv2.imdecode(
            cv2.imencode(".jpg", coded, [cv2.IMWRITE_JPEG_QUALITY, quality])[1], cv2.IMREAD_COLOR
        )
    return coded


def photographed(
    studio: Studio, detector: Detector, person: int, count: int, film: bool
) -> Iterator[tuple[Array, dict[str, Any]]]:
    """(picture, the fields of Faces) of one identity, for each picture in which MediaPipe finds a face.

    In a `film` light, skin, size, glasses and background are the same in all pictures.
    """
    rng = np.random.default_rng([studio.seed, 3, person])
    model = studio.person(person)
    shade = lid_shade(studio.head, model.head)
    for _ in range(count):
        look = np.random.default_rng([studio.seed, 4, person]) if film else rng
        number = int(look.integers(len(studio.skins)))
        image, truth = studio.picture(model, shade, studio.skins[number], rng, look)
        found = detector(image)
        if found is None:
            continue
        names = ("landmarks", "scores", "matrix")
        yield image, {"identity": person, "skin": number, **truth, **dict(zip(names, found, strict=True))}


def gathered(rows: list[dict[str, Any]]) -> Faces:
    """Pictures' fields as one."""
    exact = ("identity", "skin")
    return Faces(**{k: np.array([r[k] for r in rows], None if k in exact else np.float32) for k in rows[0]})
