"""How far the avatar as a bundle holds it lies from the formulas of RGBAvatar, in seeded random poses."""

from __future__ import annotations

import numpy as np

from avatar_export.notes.note import Note, fact
from avatar_export.readers.rgbavatar.drivers import Map
from avatar_export.readers.rgbavatar.frames import Binding
from avatar_runtime.avatar import F32, F64, Avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_schema import constants

POSES, SEED = 8, 0
DEVIATION = 1.0  # of an expression, in standard deviations
MIXED = 0.2  # part of the expressions with ARKit names that a pose mixes
TURN = np.radians(15.0)  # of neck, jaw and eyes about each axis, at most
JAW = (np.radians((0.0, -4.0, -2.0)), np.radians((20.0, 4.0, 2.0)))  # lowest and highest rotation vector


def note(avatar: Avatar, binding: Binding, driven: Map) -> Note:
    """On means, rotations and colours in POSES random poses; clips' poses are like these.

    Raises AvatarError for a mesh that leaves float32 in one of them.
    """
    assert avatar.rig is not None
    rng = np.random.default_rng(SEED)
    player = Player(avatar, "reference")
    off: list[F64] = []
    turns_off: list[F64] = []
    colours_off: list[F64] = []
    for _ in range(POSES):
        weights, turns, lids = _random(avatar, driven, rng)
        values = driven.values(weights[None, : driven.expressions], turns[None], lids[None], np.zeros((1, 3)))
        of_bases = driven.network.weights(values)[0]
        if not driven.network.linear:
            weights[-len(of_bases) :] = of_bases - driven.at_rest()
        pose = Pose(
            dict(zip(avatar.expression_names, weights.tolist(), strict=True)),
            dict(zip(avatar.rig.joint_names, homogeneous(turns), strict=True)),
        )
        mesh = player.mesh(pose).astype(np.float64)
        if not np.isfinite(mesh).all():
            raise AvatarError(
                "moves vertices beyond float32 in a random pose: look at its expression directions"
            )
        truth = binding.posed(mesh, of_bases)
        splats = player.animate(pose)
        off.append(np.linalg.norm(splats.mean - truth.mean, axis=1))
        dot = np.abs(np.sum(_unit(splats.quat_wxyz) * truth.quat_wxyz, axis=1))
        turns_off.append(2 * np.arccos(np.minimum(dot, 1)))
        colours_off.append(np.abs(splats.sh[:, 0] - truth.dc).max(axis=1) * float(constants()["sh_c0"][0]))
    far, turned, faded = (np.concatenate(part) for part in (off, turns_off, colours_off))
    return fact(
        "no_tangent_frames", poses=POSES, deviation=DEVIATION, rms=_rms(far), far=float(far.max()),
        degrees=float(np.degrees(_rms(turned))), colour=_rms(faded),
    )  # fmt: skip


def _random(avatar: Avatar, driven: Map, rng: np.random.Generator) -> tuple[F64, F64, F64]:
    """(weights [K], rotations [5, 3, 3], eyelids [2]); the weights of bases are 0."""
    weights = np.zeros(len(avatar.expressions))
    for column, e in enumerate(avatar.expressions[: driven.expressions]):
        drawn, uniform, chosen = rng.normal(0, DEVIATION), rng.uniform(0, 1), rng.random() < MIXED
        weights[column] = np.clip(drawn, *e.range) if e.range[0] < 0 else uniform * chosen
    lids = np.zeros(2)
    lids[: driven.eyelids] = rng.uniform(0, 1, driven.eyelids)
    weights[driven.expressions : driven.expressions + driven.eyelids] = lids[: driven.eyelids]
    vectors = rng.uniform(-TURN, TURN, (5, 3))
    vectors[0], vectors[2] = 0, rng.uniform(*JAW)
    return weights, matrix_from_rotvec(vectors), lids


def _unit(quats: F32) -> F64:
    result: F64 = quats / np.maximum(np.linalg.norm(quats.astype(np.float64), axis=1, keepdims=True), 1e-30)
    return result


def _rms(values: F64) -> float:
    return float(np.sqrt(np.mean(values**2)))
