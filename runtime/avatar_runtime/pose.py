"""A pose by names, and the arrays that the stages take."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64, Avatar
from avatar_runtime.checks import arguments
from avatar_runtime.io.errors import AvatarError, no_such
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec

IDENTITY = np.eye(4)
AFFINE = [0.0, 0.0, 0.0, 1.0]  # last row of a matrix
LARGEST = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class Pose:
    """A pose by names. Weights that are not named are 0; joints that are not named stay at rest.

    `joints` maps a joint to a 4x4 `delta` on the right of its rest transform:
    parent_from_joint = rest_local @ delta. A FLAME or SMPL rotation is such a delta without change.
    `world_from_avatar` moves the posed avatar as a whole; it is not the root joint.
    """

    expressions: Mapping[str, float] = field(default_factory=dict)
    joints: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)  # [4, 4] each
    eyelids: Mapping[str, float] = field(default_factory=dict)  # late morphs, by name
    world_from_avatar: npt.NDArray[Any] = field(default_factory=lambda: IDENTITY)  # [4, 4] rigid


@dataclass(frozen=True)
class PoseArrays:
    """A pose with its names resolved against one avatar."""

    expression_weights: F32  # [K]
    late_weights: F32  # [L]
    joint_delta: F64  # [J, 4, 4]
    world_from_avatar: F64  # [4, 4]


def joint_rotation(rotvec: Iterable[float]) -> F64:
    """The delta [4, 4] of a joint that rotates by a rotation vector [3] (radians), in the joint's rest frame.

    Raises TypeError or ValueError unless `rotvec` is three finite numbers.
    """
    if not isinstance(rotvec, Iterable) or isinstance(rotvec, str | bytes):
        raise arguments.wrong_type("rotvec", rotvec, "three numbers")
    given = rotvec if isinstance(rotvec, np.ndarray) else list(rotvec)
    result: F64 = homogeneous(matrix_from_rotvec(arguments.finite_array("rotvec", given, (3,))))
    return result


def resolve(pose: Pose, avatar: Avatar) -> PoseArrays:
    """`pose` as arrays for `avatar`.

    Raises AvatarError, with near matches, for a name that the avatar lacks, and for numbers that cannot pose it: one
    that is not finite, a matrix that is not affine. Raises TypeError or ValueError for values of other types or shapes.
    """
    arguments.instance("pose", pose, Pose)
    for part in ("expressions", "joints", "eyelids"):
        held = arguments.mapping(f"pose.{part}", getattr(pose, part))
        for given in held:
            arguments.instance(f"a name in pose.{part}", given, str, "a text")
    own = {name: name for name in avatar.expression_names}
    aliases = {alias: e.name for e in avatar.expressions for alias in e.aliases} | own
    named: dict[str, float] = {}
    for given, weight in pose.expressions.items():
        name = aliases.get(given, given)
        if name in named:
            raise AvatarError("is given twice, by its name and an alias", field=f"expression {name}")
        named[name] = weight
    joint_names = avatar.rig.joint_names if avatar.rig else ()
    delta = np.tile(IDENTITY, (len(joint_names), 1, 1))
    for joint, matrix in pose.joints.items():
        if joint not in joint_names:
            raise no_such("joint of this avatar", joint, joint_names)
        delta[joint_names.index(joint)] = _matrix(matrix, f"joint {joint}")
    return PoseArrays(
        _weights("expression", named, avatar.expression_names),
        _weights("eyelid", pose.eyelids, avatar.eyelids),
        delta,
        _matrix(pose.world_from_avatar, "world_from_avatar"),
    )


def _weights(what: str, given: Mapping[str, float], names: tuple[str, ...]) -> F32:
    index = {name: i for i, name in enumerate(names)}
    weights = np.zeros(len(names), np.float32)
    for name, number in given.items():
        if name not in index:
            raise no_such(f"{what} of this avatar", name, names)
        weight = arguments.real(f"{what} {name}", number)
        if not abs(weight) <= LARGEST:
            raise AvatarError(f"weight {weight} is not a finite float32", field=f"{what} {name}")
        weights[index[name]] = weight
    return weights


def _matrix(matrix: npt.NDArray[Any], what: str) -> F64:
    m = arguments.array(what, matrix, (4, 4))
    if not np.isfinite(m).all():
        raise AvatarError("expected a finite 4x4 matrix", field=what)
    if m[3].tolist() != AFFINE:
        raise AvatarError(
            f"its last row is {m[3].tolist()}, not {AFFINE}: it multiplies column vectors, so a translation stands in "
            "the last column",
            field=what,
        )
    return m
