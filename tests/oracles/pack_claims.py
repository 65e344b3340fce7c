"""A judge of what a pack claims: its own poses, cameras and figures. It shares nothing with the claim but the player.

`judged` draws poses that follow from a seed: single ends of ranges, pairs of them, mixtures of up to a quarter of the
expressions, joints, all within their ranges, and moments of a recorded face or between two frames of the clips.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.driving.drive import poses as driven
from avatar_export.driving.takes import read_take
from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation

RECORDING = Path(__file__).parents[2] / "samples" / "drive" / "live_link_face_udp.gesichter"
MEAN_BELOW, WORST_BELOW = 0.5, 2.0  # dB that what is judged may lie below the claim
SIDES = ((12.0, 8.0), (-27.0, -6.0), (55.0, 12.0))  # yaw and pitch of the cameras, degrees
FOV = math.radians(27.0)
MOST = 3.0  # of a weight
TURN = math.radians(12.0)
FACES = ("single", "pair", "mixture", "moment", "joints")
BODIES = ("joints", "joints", "moment")
Array = npt.NDArray[Any]
Turns = dict[str, tuple[Any, Any]]  # by joint, the ends of its rotation vectors


@dataclass(frozen=True)
class Verdict:
    """What was found inside the outline in all images."""

    mean: float
    worst: float
    pixel: float  # the largest error of a channel, of 255
    images: int

    def keeps(self, mean: float, worst: float) -> bool:
        """Whether a claim holds."""
        return self.mean >= mean - MEAN_BELOW and self.worst >= worst - WORST_BELOW


def judged(source: Avatar, packed: Avatar, count: int = 200, size: int = 512, seed: int = 99) -> Verdict:
    """`packed` against `source` in `count` poses and 3 views of `size` x `size` pixels."""
    shown = list(_poses(source, count, seed))
    truth, other = Player(source, "cpu"), Player(packed, "cpu")
    cameras = _cameras(truth, shown[:: max(1, count // 20)], size)
    found, pixel = [], 0.0
    for pose in shown:
        for camera in cameras:
            wanted, drawn = (player.frame(pose, camera, (0.0, 0.0, 0.0)).image for player in (truth, other))
            inside = wanted.transmittance < 0.5
            error = drawn.colour[inside].astype(np.float64) - wanted.colour[inside]
            if len(error):
                square = float(np.vdot(error, error)) / error.size
                found.append(150.0 if square < 1e-15 else -10 * math.log10(square))
                pixel = max(pixel, 255 * float(np.abs(error).max()))
    return Verdict(math.fsum(found) / len(found), min(found), pixel, len(found))


def _poses(avatar: Avatar, count: int, seed: int) -> Iterator[Pose]:
    rng = np.random.default_rng(seed)
    recorded = _recorded(avatar)
    frames = [(clip, frame) for clip in avatar.clips for frame in range(clip.frames)]
    turns = _turns(avatar)
    kinds = FACES if avatar.expressions or avatar.eyelids else BODIES
    for index in range(count):
        kind = kinds[index % len(kinds)]
        if kind == "moment" and recorded:
            yield recorded[int(rng.integers(len(recorded)))]
        elif kind == "moment" and frames:
            one, two = (frames[int(at)] for at in rng.integers(len(frames), size=2))
            yield _between(avatar, one, two, float(rng.random()))
        elif kind in ("joints", "moment"):
            yield Pose(joints=_joints(turns, rng))
        else:
            yield _strong(avatar, kind, turns, rng)


def _recorded(avatar: Avatar) -> list[Pose]:
    return [] if avatar.driving.mode == "none" else driven(avatar, read_take(RECORDING))


def _between(avatar: Avatar, one: Any, two: Any, share: float) -> Pose:
    """Weights between two frames of clips, and the joints of the first."""
    first, second = frame_pose(avatar, *one), frame_pose(avatar, *two)
    names = avatar.expression_names
    weights = {
        name: (1 - share) * first.expressions[name] + share * second.expressions[name] for name in names
    }
    return Pose(weights, first.joints, first.eyelids)


def _strong(avatar: Avatar, kind: str, turns: Turns, rng: np.random.Generator) -> Pose:
    most = max(min(4, len(avatar.expressions)), len(avatar.expressions) // 4)
    count = {"single": 1, "pair": 2}.get(kind) or int(rng.integers(min(3, most), most + 1))
    weights = {}
    for at in rng.choice(len(avatar.expressions), min(count, len(avatar.expressions)), replace=False):
        low, high = (min(max(end, -MOST), MOST) for end in avatar.expressions[at].range)
        end = low if low and (not high or rng.random() < 0.5) else high
        weights[avatar.expressions[at].name] = end * (1 if kind != "mixture" else rng.uniform(0.4, 1))
    if kind != "mixture":
        return Pose(weights)
    eyelids = {name: float(rng.random()) for name in avatar.eyelids}
    return Pose(weights, _joints(turns, rng) if rng.random() < 0.5 else {}, eyelids)


def _joints(turns: Turns, rng: np.random.Generator) -> dict[str, Array]:
    return {name: joint_rotation(rng.uniform(low, high, 3)) for name, (low, high) in turns.items()}


def _turns(avatar: Avatar) -> Turns:
    """By joint, the least and the largest rotation that the clips give it, or 12 degrees."""
    found: Turns = {}
    for at, name in enumerate(avatar.rig.joint_names if avatar.rig else ()):
        seen = [_rotation_vector(delta[at]) for clip in avatar.clips for delta in clip.joint_delta]
        found[name] = (np.min(seen, axis=0), np.max(seen, axis=0)) if seen else (-TURN, TURN)
    return found


def _rotation_vector(matrix: Array) -> Array:
    m = matrix[:3, :3].astype(np.float64)
    twice = np.array([m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]])
    sine, cosine = float(np.linalg.norm(twice)) / 2, (float(np.trace(m)) - 1) / 2
    return twice * (math.atan2(sine, cosine) / (2 * sine) if sine > 1e-9 else 0.5)


def _cameras(player: Player, shown: Sequence[Pose], size: int) -> list[Camera]:
    points = np.concatenate([player.animate(pose).mean for pose in shown])
    low, high = np.quantile(points, [0.002, 0.998], axis=0)
    across = max(high[1] - low[1], math.hypot(high[0] - low[0], high[2] - low[2]))
    distance = 0.55 * across / math.sin(FOV / 2)
    return [
        Camera.orbit((low + high) / 2, distance, math.radians(yaw), math.radians(pitch), FOV, size, size)
        for yaw, pitch in SIDES
    ]
