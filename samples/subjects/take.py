"""A recorded take as tracked poses of the sample head: the output of a face tracker for a video."""

from __future__ import annotations

import csv
import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.head import GAUSSIAN_SHAPES, JOINTS, NECK, PARENTS, ROOT, BodyModel, driving, padded

Array = npt.NDArray[Any]

RECORDING = Path(__file__).parents[1] / "drive" / "live_link_face_rom_300.csv"
# Rows of the recording: a smile, a blink, then the jaw opens and closes twice.
FIRST_ROW, FRAMES = 102, 80
EASE = 8  # frames in which the face leaves and comes back to rest
EXERCISES = (
    ("jawOpen",),
    ("eyeBlinkLeft", "eyeBlinkRight"),
    ("mouthSmileLeft", "mouthSmileRight"),
    ("mouthPucker",),
    ("browInnerUp", "browOuterUpLeft", "browOuterUpRight"),
    ("browDownLeft", "browDownRight"),
    ("cheekPuff",),
    ("noseSneerLeft", "noseSneerRight"),
)
# The recording has no head rotation. These are its sizes, radians about x, y and z, and its beats over the take.
SWAY = {ROOT: (0.01, 0.06, 0.015), NECK: (0.07, 0.24, 0.06)}
BEATS, START = (2, 1, 1), (0.6, 0.4, 1.1)
SHAPE_COEFFICIENTS = 100
# The actor looks down at a phone and frowns throughout: (value at rest, gain) of shapes, by name prefix.
AT_REST = {
    "eyeBlink": (0.33, 1.5),
    "eyeLookDown": (0.25, 0.6),
    "eyeSquint": (0.0, 0.5),
    "mouthFrown": (0.3, 0.7),
}


@dataclass(frozen=True)
class Take:
    """T frames of FLAME's parameters."""

    shape: Array  # f32 [SHAPE_COEFFICIENTS]
    expression: Array  # f32 [T, GAUSSIAN_SHAPES]
    pose: Array  # f32 [T, 5, 3], rotation vectors of root, neck, jaw, left and right eye

    @property
    def frames(self) -> int:
        return len(self.pose)


def recording() -> tuple[tuple[str, ...], Array]:
    """(ARKit names, weights [T, names]) of the whole recording, the face at rest at 0."""
    header, *rows = csv.reader(RECORDING.read_text("utf-8").splitlines())
    names = tuple(name[:1].lower() + name[1:] for name in header[2:])
    weights = np.array([row[2:] for row in rows], np.float64)
    for begin, (rest, gain) in AT_REST.items():
        columns = [k for k, name in enumerate(names) if name.startswith(begin)]
        weights[:, columns] = np.clip((weights[:, columns] - rest) * gain, 0, 1)
    return names, weights


def load_take(body: BodyModel, shape: Array) -> Take:
    """The recording on this body, with a sway of head and trunk."""
    names, weights = recording()
    weights = weights[FIRST_ROW : FIRST_ROW + FRAMES] * eased(FRAMES)[:, None]
    take = performed(body, shape, names, weights)
    turn = 2 * np.pi * np.arange(FRAMES)[:, None] / FRAMES
    for j, size in SWAY.items():
        take.pose[:, j] += (np.sin(turn * BEATS + START) * size).astype(np.float32)
    return take


def eased(frames: int) -> Array:
    """[frames] 0 at both ends, 1 in between: a take begins and ends with a face at rest.

    The first frame's mesh is what Gaussians are embedded in, and the log_area rule swells them where a face at
    rest is smaller than that mesh.
    """
    edge = np.minimum(np.arange(frames), np.arange(frames)[::-1]) / EASE
    x = np.clip(edge, 0, 1)
    return x * x * (3 - 2 * x)


def exercises(body: BodyModel, shape: Array) -> Take:
    """The neutral face, then one frame for each of EXERCISES."""
    names = tuple(sorted({name for exercise in EXERCISES for name in exercise}))
    weights = np.zeros((1 + len(EXERCISES), len(names)))
    for row, exercise in enumerate(EXERCISES, 1):
        weights[row, [names.index(name) for name in exercise]] = 1
    return performed(body, shape, names, weights)


def performed(body: BodyModel, shape: Array, names: tuple[str, ...], weights: Array) -> Take:
    """ARKit weights [T, names] on this body: expressions by name, jaw and eyes as joints."""
    way = driving(body, names)
    track = dict(zip(way["outputs"], np.array(way["matrix"]) @ weights.T, strict=True))
    expression = [track[f"expression/{name}"] for name in body.expression_names[:GAUSSIAN_SHAPES]]
    pose = np.zeros((len(weights), len(JOINTS), 3), np.float32)
    for j, joint in enumerate(JOINTS):
        for axis, letter in enumerate("xyz"):
            pose[:, j, axis] = track.get(f"joint/{joint}/{letter}", 0)
    return Take(padded(shape, SHAPE_COEFFICIENTS), np.stack(expression, axis=1).astype(np.float32), pose)


def posed_vertices(body: BodyModel, take: Take, frame: int) -> Array:
    """Vertices [V, 3] of one frame in metres: FLAME's linear blend skinning, in double precision."""
    identity = take.shape[: body.shapedirs_identity.shape[2]].astype(np.float64)
    shaped = body.v_template + body.shapedirs_identity @ identity
    shaped += body.shapedirs_expression[:, :, :GAUSSIAN_SHAPES] @ take.expression[frame].astype(np.float64)
    joints = body.J_regressor @ shaped
    rotation = matrix_from_rotvec(take.pose[frame].astype(np.float64))
    vertices = shaped + body.posedirs @ (rotation[1:] - np.eye(3)).reshape(-1)
    world: list[tuple[Array, Array]] = []
    for j, parent in enumerate(PARENTS):
        turn, origin = world[parent] if parent >= 0 else (np.eye(3), joints[j])
        if parent >= 0:
            origin = origin + turn @ (joints[j] - joints[parent])
        world.append((turn @ rotation[j], origin))
    posed = np.zeros_like(vertices)
    for j, (turn, origin) in enumerate(world):
        posed += body.lbs_weights[:, j, None] * ((vertices - joints[j]) @ turn.T + origin)
    return posed


def joint_motion(body: BodyModel, take: Take, frame: int, joint: int) -> tuple[Array, Array]:
    """(R, t) of the trunk (ROOT) or the skull (NECK): a point x that follows it is at R x + t."""
    rest = body.joints.astype(np.float64)
    turn = matrix_from_rotvec(take.pose[frame, ROOT].astype(np.float64))
    origin = rest[ROOT]
    if joint == NECK:
        origin = origin + turn @ (rest[NECK] - rest[ROOT])
        turn = turn @ matrix_from_rotvec(take.pose[frame, NECK].astype(np.float64))
    return turn, origin - turn @ rest[joint]


def save_flame_params(take: Take, path: Path, units_per_metre: float) -> None:
    """IMavatar's flame_params.json: a camera in front of the face, shape, and expression and pose of each frame."""
    camera = np.c_[np.diag([1.0, -1.0, -1.0]), (0.0, 0.0, 0.9 * units_per_metre)]
    frames = [
        {
            "file_path": f"./image/{k + 1}",
            "world_mat": camera.tolist(),
            "expression": expression.tolist(),
            "pose": pose.reshape(-1).tolist(),
        }
        for k, (expression, pose) in enumerate(zip(take.expression, take.pose, strict=True))
    ]
    content = {
        "intrinsics": [2.3, 2.3, 0.5, 0.5],
        "shape_params": take.shape.tolist(),
        "frames": frames,
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(json.dumps(content) + "\n")
