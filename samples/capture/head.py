"""The head as a capture: it plays the real recording and exercises, seen by a camera that moves around it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from PIL import Image

from avatar_runtime.camera import Camera
from avatar_trainer.captures.own import Shot, write
from avatar_trainer.head import (
    GAUSSIAN_SHAPES,
    JOINTS,
    BodyModel,
    Head,
    build_body_model,
    closing_lids,
    driving,
    save_body,
    smoothstep,
    tracking_body,
)
from samples.capture.extras import EXTRAS
from samples.capture.model import Model
from samples.capture.shots import Noise, camera_towards, rays_per_pixel, shot, splits
from samples.subjects.head import load_head
from samples.subjects.take import Take, performed, recording

Array = npt.NDArray[Any]

FPS = 30.0
EXERCISE_SHARE = 0.2  # of the frames, the first ones
# Frames of `--jitter`: expressions and a camera that nobody performed, so that the training frames cover the range.
# JITTERED: share of a recorded frame that is kept; FULL: weight of one more.
JITTER_SEED, JITTERED, FULL = 11, (0.2, 0.8), (0.7, 1.0)
GOLDEN = (5**0.5 - 1) / 2  # of the path between the cameras of two such frames
# Frames of `--close`: the camera looks at what their expression moves, so near (metres), so far aside (radians).
NEAR, ASIDE = (0.26, 0.48), (0.75, 0.3)
EYES_MOVE, EYE_AHEAD, MOUTH = ("eye", "brow"), (0.0, 0.0, 0.012), (0.0, -0.028, 0.09)  # name prefixes; metres
TOGETHER = 1.5  # sum of the weights of the expressions that are exercised in one frame, at most
# The camera: how far it swings (radians), how often over the capture, where it begins.
YAW, PITCH, ROLL = (np.radians(40.0), 5.0, 0.3), (0.26, 7.0, 1.1), (0.06, 3.0, 2.0)
WIDE = (0.16, 0.23, 0.35, 0.42)  # shares of the capture between which a wider yaw comes in and goes: one beat
DISTANCE, NEARER = 0.86, (0.05, 4.0, 0.7)  # metres; share of it
TARGET = (0.0, -0.025, 0.0)
FOV_Y = 0.43
SOURCE = (
    "synthetic: computed pictures of a scanned head, no footage; moved by a real range-of-motion recording and "
    "exercises, seen by a computed camera; parameters exact but for the noise asked for"
)
LICENSE = (
    "ICT-FaceKit, Copyright (c) 2020 USC Institute for Creative Technologies: MIT; Infinite, 3D Head Scan by Lee "
    "Perry-Smith, based on a work at www.triplegangers.com: CC BY 3.0, changed; Live Link Face take, Copyright (c) "
    "2021 Alexandre Donciu-Julin: MIT"
)
AUTHOR = "scan: Lee Perry-Smith; pictures: avatar-export samples.capture"
CONSENT = "the scan bears the name of Lee Perry-Smith, who published it for any use that names him"


def blinking_head() -> Head:
    """The head of samples/data, its eyes shut by eyeBlink."""
    return closing_lids(load_head())


def jittered(names: tuple[str, ...], count: int, held_out: tuple[str, ...]) -> Array:
    """Weights [count, names] at random: a part of a recorded frame, and one expression after the other nearly at full.

    The recorded frames are those of training. mouthClose needs an open jaw: alone it lifts the lips over the nose.
    """
    if not count:
        return np.zeros((0, len(names)))
    rng = np.random.default_rng(JITTER_SEED)
    known = recorded(names, 5 * count)[: 4 * count]
    result = known[rng.permutation(len(known))[:count]] * rng.uniform(*JITTERED, (count, 1))
    one = np.arange(count) % len(names)
    result[np.arange(count), one] = rng.uniform(*FULL, count)
    close, jaw = names.index("mouthClose"), names.index("jawOpen")
    result[:, jaw] = np.maximum(result[:, jaw], result[:, close])
    result[:, [names.index(name) for name in held_out]] = 0
    return result


def weights(names: tuple[str, ...], frames: int, held_out: tuple[str, ...]) -> Array:
    """ARKit weights [frames, names]: exercises, then the recording.

    Expressions that are held out are 0 in training and rise to 1 one after the other in testing.
    """
    exercise = round(frames * EXERCISE_SHARE)
    result = np.concatenate([exercises(len(names), exercise), recorded(names, frames - exercise)])
    test = np.array(splits(frames)) == "test"
    for k, name in enumerate(held_out):
        turn = np.arange(test.sum()) / max(test.sum(), 1) * 2 * np.pi * len(held_out) - 2 * np.pi * k
        lone = (turn >= 0) & (turn < 2 * np.pi)
        result[~test, names.index(name)] = 0
        result[test, names.index(name)] = np.where(lone, (1 - np.cos(turn)) / 2, 0)
    return result


def exercises(count: int, frames: int) -> Array:
    """Weights [frames, count]: each expression rises and falls, one after the other."""
    if not frames:
        return np.zeros((0, count))
    width = max(frames / count, 1)
    centre = (np.arange(count) + 0.5) * frames / count
    weight = np.clip(1 - np.abs(np.arange(frames)[:, None] + 0.5 - centre) / width, 0, 1)
    share = np.minimum(1, TOGETHER / np.maximum(weight.sum(axis=1, keepdims=True), 1e-9))
    result: Array = weight * share
    return result


def recorded(names: tuple[str, ...], frames: int) -> Array:
    """Weights [frames, names] of the whole recording at `frames` even times; 0 for names that it lacks."""
    columns, values = recording()
    times = np.linspace(0, len(values) - 1, frames)
    result = np.zeros((frames, len(names)))
    for k, name in enumerate(names):
        if name in columns:
            result[:, k] = np.interp(times, np.arange(len(values)), values[:, columns.index(name)])
    return result


def perform(body: BodyModel, frames: int, held_out: tuple[str, ...], jitter: int = 0) -> Take:
    """The parameters of `jitter` frames at random, then of every frame of the take.

    ValueError for a held-out name that is not an expression.
    """
    names = tuple(sorted(body.expression_names))
    for name in held_out:
        if name not in names:
            raise ValueError(f"{name} is not an expression of the head; there are {', '.join(names)}")
    shape = np.zeros(body.shapedirs_identity.shape[2])
    return performed(
        body,
        shape,
        names,
        np.concatenate([jittered(names, jitter, held_out), weights(names, frames, held_out)]),
    )


def cameras(
    head: Head, frames: int, size: int, yaw: float, jitter: int, close: int = 0
) -> list[tuple[Array, Array, Array]]:
    """(K, R, t) of `jitter` frames anywhere on the camera's path, of `close` ones, then of every frame of the take."""
    places = [(0.5 + k * GOLDEN) % 1 * frames for k in range(jitter)]
    near = [close_camera(head, jitter + k, size) for k in range(close)]
    path = [camera_at(place, frames, size, yaw) for place in (*places, *range(frames))]
    return path[:jitter] + near + path[jitter:]


def close_camera(head: Head, frame: int, size: int) -> tuple[Array, Array, Array]:
    """(K, R, t) that looks closely at the eye, or the mouth, that the lone expression of a jittered frame moves."""
    name = sorted(head.expression_names)[frame % len(head.expression_names)]
    side = int(name.endswith("Right"))
    target = head.eye_centres[side] + EYE_AHEAD if name.startswith(EYES_MOVE) else np.array(MOUTH)
    aside, above, away = (((frame + 0.5) * GOLDEN**power) % 1 for power in (1, 2, 3))
    near, far = NEAR
    yaw, pitch = ASIDE[0] * (2 * aside - 1), ASIDE[1] * (2 * above - 1)
    return camera_towards(target, near + (far - near) * away, yaw, pitch, FOV_Y, size)


def camera_at(frame: float, frames: int, size: int, yaw: float = YAW[0]) -> tuple[Array, Array, Array]:
    """(K, R, t) of the camera, OpenCV: on a smooth path about the head, looking at it.

    It swings by `yaw` radians to either side; beyond YAW only in one beat of the training part.
    """
    time = 2 * np.pi * frame / frames
    wide = smoothstep(frame / frames, *WIDE[:2]) * smoothstep(frame / frames, *WIDE[:1:-1])
    narrow = min(yaw, YAW[0])
    reach = narrow + (yaw - narrow) * float(wide)

    def swing(path: tuple[float, float, float]) -> float:
        reach, beats, start = path
        return float(reach * np.sin(beats * time + start))

    distance = DISTANCE * (1 + swing(NEARER))
    yaw, pitch = swing((reach, *YAW[1:])), swing(PITCH)
    k, rotation, translation = camera_towards(np.array(TARGET), distance, yaw, pitch, FOV_Y, size)
    roll = swing(ROLL)
    turn = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]])
    return k, turn @ rotation, turn @ translation


def write_head(
    out: Path,
    size: int,
    frames: int,
    noise: Noise,
    held_out: tuple[str, ...] = (),
    yaw: float = YAW[0],
    worn: tuple[str, ...] = (),
    jitter: int = 0,
    close: int = 0,
) -> Path:
    """Write the head's capture into the folder `out`: capture.json, images/, masks/, body/, driving.json.

    Expressions `held_out` are seen in test frames only; `yaw`: see `camera_at`; `jitter` frames for training, of random
    expressions and cameras, come first, then `close` ones whose camera is near. With things `worn` (names of EXTRAS)
    also regions/: the share of each pixel that shows them. Returns the path of capture.json. Raises ValueError for an
    unknown expression and for fewer than
    two frames.
    """
    head = blinking_head()
    model = Model(head, build_body_model(head), tuple(EXTRAS[name](head) for name in worn))
    take = perform(model.body, frames, held_out, jitter + close)
    seen = cameras(head, frames, size, yaw, jitter, close)
    body = tracking_body(head, model.body)
    save_body(body, np.zeros(0), out / "body")
    if worn:
        write_regions(out / "regions", model, take, size, seen)
    names = tuple(sorted(body.expression_names))
    (out / "driving.json").write_text(json.dumps(driving(body, names), indent=1) + "\n")
    frames_of = shots(model, take, size, noise, seen, ["train"] * (jitter + close) + splits(frames))
    name = ", ".join(["scanned head, synthetic", *worn])
    return write_frames(out, body, frames_of, name=name, fps=FPS, source=SOURCE, license=LICENSE)


def write_frames(
    out: Path,
    body: BodyModel,
    frames: Iterator[tuple[str, Shot]],
    *,
    name: str,
    fps: float,
    source: str,
    license: str,
) -> Path:
    """capture.json and the frames of the head on its body model, which lies in `out`/body; the path of capture.json."""
    return write(
        out,
        name=name,
        fps=fps,
        head_pose_in="camera",
        expressions=body.expression_names[:GAUSSIAN_SHAPES],
        body={
            "kind": "body_model",
            "model": "body/body_model.npz",
            "eyelids": "body",
            "anchor_faces": "body/back_of_head.txt",
        },
        frames=frames,
        source=source,
        license=license,
        author=AUTHOR,
        consent=CONSENT,
    )


def write_regions(
    folder: Path, model: Model, take: Take, size: int, seen: Sequence[tuple[Array, Array, Array]]
) -> None:
    """One image of grey a frame, named as the frame: what is worn, 255 where a pixel sees nothing else."""
    folder.mkdir(parents=True, exist_ok=True)
    for k, view in enumerate(seen):
        camera = Camera.from_opencv(*_in_order(view), size, size)
        share = model.region(take, k, camera, -(-rays_per_pixel(size) // 2))
        Image.fromarray(np.round(np.clip(share, 0, 1) * 255).astype(np.uint8)).save(folder / f"{k:05d}.png")


def _in_order(camera: tuple[Array, Array, Array]) -> tuple[Array, Array, Array]:
    """(R, t, K) of (K, R, t)."""
    intrinsics, rotation, translation = camera
    return rotation, translation, intrinsics


def shots(
    model: Model,
    take: Take,
    size: int,
    noise: Noise,
    seen: Sequence[tuple[Array, Array, Array]],
    split_of: Sequence[str],
) -> Iterator[tuple[str, Shot]]:
    """(name, shot) of every frame of the take, with its camera (K, R, t) and its split."""
    for k, ((intrinsics, rotation, translation), split) in enumerate(zip(seen, split_of, strict=True)):
        camera = Camera.from_opencv(rotation, translation, intrinsics, size, size)
        image = model.image(take, k, camera, rays_per_pixel(size))
        joints = dict(zip(JOINTS, noise.tracked(take.pose[k]), strict=True))
        stated = noise.calibrated(intrinsics, rotation, translation)
        yield f"{k:05d}", shot(image, stated, noise.tracked(take.expression[k]), joints, split)
