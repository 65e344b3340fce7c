"""The truth of poses that no training sees, close up: frames of a second recording, and where people look.

Each pose is seen twice: the whole head, and the face from near by. `crops.json` says where in each image are the parts
that `samples.closeups` judges.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.driving.takes import read_take
from avatar_runtime.driving.arkit import CHANNELS
from avatar_runtime.io.errors import AvatarError
from avatar_trainer.head import Head, build_body_model, save_body, tracking_body
from samples.capture.extras import EXTRAS
from samples.capture.head import blinking_head, shots, write_frames
from samples.capture.model import Model
from samples.capture.shots import Noise, camera_towards
from samples.subjects.take import RECORDING, Take, performed, posed_vertices

Array = npt.NDArray[Any]
View = tuple[Array, Array, Array]  # K, R, t of a camera, OpenCV
Box = tuple[int, int, int, int]  # pixels: left, top, right, bottom; the last two are outside

UNSEEN = RECORDING.with_name("live_link_face_udp.gesichter")
CROPS = "crops.json"
APART = 3  # frames of the recording between two poses, at least
# How many poses of 20 show what: those where the smallest of these weights is greatest.
STRONGEST: tuple[tuple[int, tuple[str, ...]], ...] = (
    (3, ("eyeBlinkLeft", "eyeBlinkRight")),
    (1, ("eyeBlinkLeft",)),
    (1, ("eyeBlinkRight",)),
    (2, ("jawOpen",)),
    (2, ("mouthSmileLeft", "mouthSmileRight", "mouthUpperUpLeft", "mouthUpperUpRight")),
    (1, ("eyeLookInLeft", "eyeLookOutRight")),
    (1, ("eyeLookOutLeft", "eyeLookInRight")),
    (1, ("eyeLookDownLeft", "eyeLookDownRight")),
    (2, ("eyeWideLeft", "eyeWideRight")),
)
HALF_CLOSED = 2  # more, where both lids are nearest to 0.5; the rest are spread evenly
# Where a pose is seen from, in turn: (yaw, pitch) degrees.
SIDES = ((0, 0), (28, 4), (-28, -4), (14, -6), (-14, 6))
HEAD = ((0.0, -0.025, 0.0), 0.86, 0.43)  # target, distance in metres, vertical field of view in radians
FACE = ((0.0, -0.006, 0.09), 0.50, 0.32)
LID_REACH = 0.022  # metres from an eye's centre
LIPS = ((0.0, -0.042), (0.032, 0.022))  # metres: middle, half of a box
WORN = ("glasses",)  # with a crop of their own; hair is judged with the head
CLOSED = 0.85  # of eyeBlink: from here on the crop is called a lid, under which no eye may show
MARGIN = 0.05  # of a box's size, on every side
SOURCE = (
    "synthetic: computed pictures of a scanned head, no footage; moved by frames of a real recording that no sample is "
    "trained on; parameters exact"
)
LICENSE = (
    "ICT-FaceKit, Copyright (c) 2020 USC Institute for Creative Technologies: MIT; Infinite, 3D Head Scan by Lee "
    "Perry-Smith, based on a work at www.triplegangers.com: CC BY 3.0, changed; recording of Live Link Face packets: "
    "BSD-2"
)


def recorded(names: tuple[str, ...]) -> Array:
    """ARKit weights [frames, names] of the whole recording; 0 for names that it lacks."""
    channels = read_take(UNSEEN).channels
    column = {name: k for k, name in enumerate(CHANNELS)}
    return np.stack([channels[:, column[n]] if n in column else 0 * channels[:, 0] for n in names], axis=1)


def chosen(weights: Mapping[str, Array], count: int) -> list[int]:
    """`count` frames of a recording, in order: its closed and half-closed lids, widest mouth, teeth, gazes, the rest
    spread evenly. Weights [frames] by name. ValueError for more than the recording has room for.
    """
    frames = len(next(iter(weights.values())))
    free, found = np.ones(frames, bool), list[int]()

    def take(score: Array) -> None:
        best = int(np.where(free, score, -np.inf).argmax())
        if not free[best]:
            raise ValueError(f"{count} poses: the recording has room for {len(found)}")
        found.append(best)
        free[max(best - APART, 0) : best + APART + 1] = False

    lids = [weights[name] for name in ("eyeBlinkLeft", "eyeBlinkRight")]
    rules = [(many, np.min([weights[name] for name in names], axis=0)) for many, names in STRONGEST]
    rules.append((HALF_CLOSED, -np.max([np.abs(lid - 0.5) for lid in lids], axis=0)))
    for many, score in rules:
        for _ in range(min(many, count - len(found))):
            take(score)
    for place in np.linspace(0, frames - 1, count - len(found)):
        take(-np.abs(np.arange(frames) - place))
    return sorted(found)


def view(at: tuple[tuple[float, float, float], float, float], side: tuple[float, float], size: int) -> View:
    """(K, R, t) of a camera that looks at the head from `side`, as SIDES has them."""
    target, distance, fov_y = at
    yaw, pitch = np.radians(side)
    return camera_towards(np.array(target), distance, yaw, pitch, fov_y, size)


def parts(head: Head) -> dict[str, Array]:
    """Masks [V] of the vertices whose boxes are crops: both eyes with their lids, the lips with what they open on."""
    skin, (middle, half) = head.in_part("face"), np.array(LIPS)
    front = head.vertices[:, 2] > 0.085
    found = {
        f"{side}_eye": skin & (np.linalg.norm(head.vertices - centre, axis=1) < LID_REACH)
        for side, centre in zip(("left", "right"), head.eye_centres, strict=True)
    }
    return {**found, "mouth": skin & front & (np.abs(head.vertices[:, :2] - middle) < half).all(axis=1)}


def box(vertices: Array, seen: View, size: int) -> Box:
    """The box of vertices [N, 3] in an image, with MARGIN, inside the image."""
    k, rotation, translation = seen
    x = vertices @ rotation.T + translation
    pixels = x[:, :2] / x[:, 2:] @ k[:2, :2].T + k[:2, 2]
    low, high = pixels.min(axis=0), pixels.max(axis=0)
    edge = MARGIN * (high - low)
    (left, top), (right, bottom) = (
        np.clip(np.round(corner), 0, size).astype(int).tolist() for corner in (low - edge, high + edge)
    )
    return left, top, right, bottom


def crops(
    model: Model, worn: tuple[str, ...], take: Take, frame: int, seen: View, near: bool, size: int
) -> dict[str, Box]:
    """The boxes of one frame by name: from near the whole image, its parts and the things worn, else the whole head."""
    vertices = posed_vertices(model.body, take, frame)
    names = model.body.expression_names
    if not near:
        return {"head": box(vertices, seen, size)}
    shown = {}
    for name, rows in parts(model.head).items():
        blink = f"eyeBlink{name.removesuffix('_eye').capitalize()}"  # no expression is called so of the mouth
        lid = blink in names and take.expression[frame, names.index(blink)] > CLOSED
        shown[name.replace("_eye", "_lid") if lid else name] = vertices[rows]
    shown |= {name: e.vertices for name, e in zip(worn, model.worn, strict=True) if name in WORN}
    return {"face": (0, 0, size, size), **{name: box(points, seen, size) for name, points in shown.items()}}


def read_crops(folder: Path) -> dict[str, dict[str, Box]]:
    """The boxes by frame and part. AvatarError for a folder that `write_unseen` did not write."""
    file = folder / CROPS
    if not file.is_file():
        raise AvatarError(
            "is missing: `python -m samples.capture FOLDER --unseen 20 --size 1024` writes it", file=file
        )
    return {
        frame: {part: (int(a), int(b), int(c), int(d)) for part, (a, b, c, d) in parts.items()}
        for frame, parts in json.loads(file.read_text("utf-8")).items()
    }


def write_unseen(out: Path, size: int, count: int, worn: tuple[str, ...] = ()) -> Path:
    """Write `count` poses into the folder `out` as a capture, each twice, and crops.json; the path of capture.json.

    All are `test` frames but the first two: they show the face at rest, as a capture needs two to train on.
    Raises ValueError for more poses than the recording has room for.
    """
    head = blinking_head()
    model = Model(head, build_body_model(head), tuple(EXTRAS[name](head) for name in worn))
    body = tracking_body(head, model.body)
    names = tuple(sorted(body.expression_names))
    weights = recorded(names)
    poses = chosen(dict(zip(names, weights.T, strict=True)), count)
    shape = np.zeros(model.body.shapedirs_identity.shape[2])
    rows = np.concatenate([np.zeros((2, len(names))), np.repeat(weights[poses], 2, axis=0)])
    take = performed(model.body, shape, names, rows)
    seen = [view(at, SIDES[k % len(SIDES)], size) for k in range(count + 1) for at in (HEAD, FACE)]
    boxes = {f"{k:05d}": crops(model, worn, take, k, seen[k], bool(k % 2), size) for k in range(2, len(seen))}
    save_body(body, np.zeros(0), out / "body")
    (out / CROPS).write_text(json.dumps(boxes, indent=1) + "\n")
    frames = shots(model, take, size, Noise(), seen, ["train"] * 2 + ["test"] * (2 * count))
    name = ", ".join(["scanned head, unseen poses, synthetic", *worn])
    return write_frames(out, body, frames, name=name, fps=60.0, source=SOURCE, license=LICENSE)
