"""The poses and expressions to dump for distilling: every driver alone, the ends of ranges, random mixtures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from avatar_export.asm.files import is_face
from avatar_export.bodies.body_model import read_body_model
from avatar_export.bodies.body_rig import bake_rig
from avatar_export.bodies.inputs import ZERO
from avatar_export.bodies.subject_files import read_shape
from avatar_export.distill.drivers import Drivers
from avatar_export.rigs.rig_file import READERS as RIG_FILES
from avatar_export.rigs.rig_file import read_rig_file
from avatar_runtime.avatar import F64, I64, Rig
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.stages.joints import chain, rest_transforms

DEGREES = 15.0  # a joint turns by up to this about any axis, unless TURNS has it
# Rotation vectors of joints that turn less, or more, in degrees: (lowest, highest) about x, y, z of the joint.
TURNS: dict[str, tuple[tuple[float, float], ...]] = {
    "jaw": ((0.0, 20.0), (-5.0, 5.0), (-2.0, 2.0)),
    "lefteye": ((-20.0, 20.0), (-25.0, 25.0), (0.0, 0.0)),
    "righteye": ((-20.0, 20.0), (-25.0, 25.0), (0.0, 0.0)),
}
BODY_RANGE = (-2.0, 2.0)  # of an expression of a body model, in standard deviations
MORPH_RANGE = (0.0, 1.0)  # of a morph target
MIXED = 0.3  # part of the morph targets that a random frame mixes: faces of all at once do not occur
RANDOM_TAKES = 5  # into which random frames are cut, so that whole takes can be held out
LEAST_RANDOM = 60
ALONE, ENDS = 0, 1  # takes; random ones follow


@dataclass(frozen=True)
class Driven:
    """A rig and the ranges of its drivers."""

    rig: Rig
    driver_names: tuple[str, ...]  # [K] columns of rig.morphs
    driver_range: tuple[float, float]  # of every driver
    turns: F64  # [J, 3, 2] lowest and highest rotation vector, radians; zeros for a joint that stays


def driven(path: Path, shape: Path | None, degrees: float) -> Driven:
    """The rig of a body model (FLAME, SMPL, SMPL-X) with the identity `shape`, or of a .glb, .fbx or ASM face.

    Joints turn by up to `degrees` about each axis. Roots stay: they move the avatar as a whole. Raises AvatarError for
    files that are neither, and for `shape` beside a rig.
    """
    suffix = path.suffix.lower()
    if suffix in RIG_FILES and (suffix != ".npz" or is_face(path)):
        if shape is not None:
            raise AvatarError("goes with a body model; a rig has its own shape", field="--shape")
        found = read_rig_file(path)
        return Driven(found.rig, found.morph_names, MORPH_RANGE, _turns(found.rig, degrees))
    body = read_body_model(path)
    given = None if shape is None or str(shape) == ZERO else read_shape(shape)
    rig = bake_rig(body, given)
    return Driven(rig, body.expression_names, BODY_RANGE, _turns(rig, degrees))


def poses_to_dump(source: Driven, count: int | None, seed: int) -> Drivers:
    """The frames: the rest pose and every driver alone at its ends; every joint alone at its ends; `count` random ones.

    By default there are as many random frames as others, and at least LEAST_RANDOM. Same `seed`, same frames.
    """
    rng = np.random.default_rng(seed)
    weights, turns = _alone(source)
    count = max(LEAST_RANDOM, len(weights)) if count is None else count
    weights = np.concatenate([weights, _random_weights(source, count, rng)])
    turns = np.concatenate([turns, _random_turns(source, count, rng)])
    delta = homogeneous(matrix_from_rotvec(turns))
    world = chain(source.rig, weights.astype(np.float32), delta)[2]
    return Drivers(
        source.rig.joint_names,
        source.rig.parents.astype(np.int64),
        rest_transforms(source.rig),
        world,
        source.driver_names,
        weights.astype(np.float32).astype(np.float64),
        _takes(source, count),
    )


def _turns(rig: Rig, degrees: float) -> F64:
    ranges = np.tile(np.array([-degrees, degrees]), (rig.joint_count, 3, 1))
    for joint, name in enumerate(rig.joint_names):
        plain = "".join(c for c in name.lower() if c.isalpha()).removesuffix("smplhf")
        if plain in TURNS:
            ranges[joint] = TURNS[plain]
    ranges[rig.parents < 0] = 0
    result: F64 = np.radians(ranges)
    return result


def _single(source: Driven) -> tuple[I64, F64]:
    """(driver, weight) of each frame in which one driver stands at an end of its range."""
    ends = [end for end in source.driver_range if end]
    drivers: I64 = np.repeat(np.arange(len(source.driver_names)), len(ends))
    return drivers, np.tile(np.array(ends), len(source.driver_names))


def _alone(source: Driven) -> tuple[F64, F64]:
    """(weights [F, K], rotation vectors [F, J, 3]): the rest pose, each driver alone, each axis of each joint alone."""
    driver, weight = _single(source)
    joint, axis, end = np.nonzero(source.turns)
    first = 1 + len(driver)
    weights = np.zeros((first + len(joint), len(source.driver_names)))
    turns = np.zeros((len(weights), source.rig.joint_count, 3))
    weights[1 + np.arange(len(driver)), driver] = weight
    turns[first + np.arange(len(joint)), joint, axis] = source.turns[joint, axis, end]
    return weights, turns


def _takes(source: Driven, count: int) -> I64:
    drivers = 1 + len(_single(source)[0])
    joints = int(np.count_nonzero(source.turns))
    random: I64 = ENDS + 1 + np.arange(count) * RANDOM_TAKES // max(count, 1)
    takes = np.concatenate([np.full(drivers, ALONE), np.full(joints, ENDS), random])
    if drivers == 1:  # the rest pose has no take of its own
        takes[0] = takes[min(1, len(takes) - 1)]
    result: I64 = np.unique(takes, return_inverse=True)[1].astype(np.int64)
    return result


def _random_weights(source: Driven, count: int, rng: np.random.Generator) -> F64:
    """Body models: normal, cut at the ends of the range. Morph targets: uniform, a part of them in each frame."""
    low, high = source.driver_range
    shape = (count, len(source.driver_names))
    if low < 0:
        result: F64 = np.clip(rng.normal(0, 1, shape), low, high)
        return result
    mixed: F64 = rng.uniform(low, high, shape) * (rng.random(shape) < MIXED)
    return mixed


def _random_turns(source: Driven, count: int, rng: np.random.Generator) -> F64:
    """Uniform about each axis; about x, y and z at once the angle is up to 1.7 times that about one."""
    low, high = source.turns[..., 0], source.turns[..., 1]
    result: F64 = low + (high - low) * rng.random((count, *low.shape))
    return result
