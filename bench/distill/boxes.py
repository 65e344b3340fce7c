"""Black boxes whose truth is known: poses of the samples, and a network that no linear avatar repeats."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from samples.dumps import Change, clip_poses, random_poses

from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.pose import Pose
from avatar_runtime.stages.activate import Splats
from avatar_schema import constants

TRAINED = Path(__file__).parents[2] / "samples" / "trained"
HIDDEN = 48  # units of the network
SEED = 20
BEND = 2.2  # of its inputs: how far it is from linear
Takes = dict[str, list[Pose]]


def head_blendshapes() -> Avatar:
    """The Gaussian Blendshapes head."""
    return load(TRAINED / "head_blendshapes")


def head_splatting() -> Avatar:
    """The SplattingAvatar head."""
    return load(TRAINED / "head_splatting")


def body_splatting() -> Avatar:
    """The SplattingAvatar body."""
    return load(TRAINED / "body_splatting")


def spread(poses: list[Pose], count: int) -> list[Pose]:
    """So many of `poses`, evenly."""
    return [poses[k] for k in np.linspace(0, len(poses) - 1, count).round().astype(int)]


def clip_only(avatar: Avatar, learnt: int, held: int) -> Takes:
    """Frames of the training clip, and of the other."""
    return {
        "clip": spread(clip_poses(avatar, "training"), learnt),
        "held_clip": spread(clip_poses(avatar, "held_out"), held),
    }


def randoms(avatar: Avatar, learnt: int, held: int, degrees: float) -> Takes:
    """Random poses, of two seeds."""
    return {
        "random": random_poses(avatar, learnt, degrees),
        "held_random": random_poses(avatar, held, degrees, seed=8),
    }


def network(avatar: Avatar) -> Change:
    """Wrinkles of 1 to 2 mm and colours that a random smooth network makes of the expressions and of the place."""
    rng = np.random.default_rng(SEED)
    names, rest = avatar.expression_names, avatar.gaussians.mean
    where = np.sin(rest @ rng.normal(0, 30, (3, HIDDEN)) + rng.uniform(0, 6, HIDDEN))
    what = rng.normal(0, BEND, (len(names), HIDDEN)) / np.sqrt(8)
    moves = rng.normal(0, 1, (HIDDEN, 3))
    paints = rng.normal(0, 1, (HIDDEN, 3))

    def hidden(weights: np.ndarray) -> np.ndarray:
        return np.tanh(where + weights @ what) - np.tanh(where)

    typical = np.abs(hidden(rng.uniform(0, 1, (64, len(names))).mean(axis=0) * 0.25) @ moves)
    scale = 1.1e-3 / max(float(np.linalg.norm(typical, axis=1).mean()), 1e-12)

    def change(splats: Splats, pose: Pose) -> Splats:
        weights = np.array([pose.expressions.get(name, 0.0) for name in names])
        inner = hidden(weights)
        off = scale * inner @ moves
        assert splats.sh_rotation is not None
        sh = splats.sh.copy()
        sh[:, 0] += (0.02 * inner @ paints / float(constants()["sh_c0"][0]) * 0.28).astype(np.float32)
        mean = splats.mean + np.einsum("nij,nj->ni", splats.sh_rotation, off).astype(np.float32)
        return replace(splats, mean=mean, sh=sh)

    return change


Make = Callable[[], Avatar]
