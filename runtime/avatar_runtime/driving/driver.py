"""ARKit frames to poses of one avatar: names -> matrix -> weights, joint rotations, eyelids.

`Driving.mode` "names" is a matrix of zeros and ones (each input drives the expressions and eyelids whose name
or alias spells it), so both modes use the same code. Measured rotations are added: that of the head to
`head_joint`, else to the whole avatar about `head_pivot`; that of an eye to its joint. If matrix outputs drive
an eye joint too, the measured rotation replaces them, so that the eye is not rotated twice. If the frame has no
measured rotation and no output drives the joint, the eye follows its eyeLook weights. All of it is float64.
SPEC.md, section 8, has the order of the steps and every formula.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.checks import arguments
from avatar_runtime.driving import axes
from avatar_runtime.driving.arkit import ARKIT_NAMES
from avatar_runtime.driving.frame import DrivingFrame
from avatar_runtime.driving.linear_map import linear_map
from avatar_runtime.handedness import HANDEDNESS, mirrored_matrices
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec, translation_matrix

Range = tuple[float, float]
LATE_RANGE: Range = (0.0, 1.0)  # of late morphs, which have no stored range; `bounds` holds for it
SIDES = ("Left", "Right")  # the subject's


class _Slots(NamedTuple):
    """The output row that drives each expression, eyelid and joint axis."""

    expressions: dict[str, int]
    eyelids: dict[str, int]
    joints: dict[str, dict[int, int]]  # joint -> axis -> row


class Driver:
    """Makes poses of one avatar from frames of ARKit weights and captured rotations.

    Everything that is the same for all frames is computed once, when the driver is made.
    """

    def __init__(self, avatar: Avatar, *, within_range: bool = False, handedness: str = "right") -> None:
        """`within_range` limits each expression weight to its `range` and each eyelid weight to 0..1, after the
        matrix; by default weights are used as they come. Joint rotations have no range and are never limited.

        `handedness` "left" is for an avatar whose arrays are in the left-handed frame of SPEC.md section 15.

        Raises AvatarError if ARKit cannot drive this avatar, and for a joint that cannot rotate; ValueError for
        another handedness; TypeError for arguments of other types.
        """
        arguments.instance("avatar", avatar, Avatar)
        arguments.text("handedness", handedness, HANDEDNESS)
        driving = avatar.driving
        self._linear = linear_map(avatar)
        self._slots = _slots(self._linear.outputs)
        self._names = {*ARKIT_NAMES, *self._linear.inputs}
        self._mirror = handedness == "left"
        self._rest = _rest_frames(avatar)
        self._head_joint = driving.head_joint
        self._mesh_from_pivot = translation_matrix(np.array(driving.head_pivot, np.float64))
        self._pivot_from_mesh = np.linalg.inv(self._mesh_from_pivot)
        self._eyes = dict(zip(SIDES, (driving.left_eye_joint, driving.right_eye_joint), strict=True))
        self._expression_range: dict[str, Range] = {}
        self._late_range: dict[str, Range] = {}
        if within_range:
            self._expression_range = {e.name: e.range for e in avatar.expressions}
            self._late_range = dict.fromkeys(avatar.eyelids, LATE_RANGE)

    def pose(self, frame: DrivingFrame) -> Pose:
        """The pose of one frame. Weights that the frame does not name are 0.

        Raises TypeError or ValueError for a value of another type or shape, a number that is not finite, and a
        weight of a name that is neither ARKit's nor an input of this avatar.
        """
        linear, slots = self._linear, self._slots
        frame = self._checked(frame)
        values = linear.matrix @ np.array([frame.weights.get(name, 0.0) for name in linear.inputs])
        turns = {joint: _matrix_turn(values, rows) for joint, rows in slots.joints.items()}
        self._turn_eyes(turns, frame)
        head, whole = self._seen(axes.head_rotation(frame)), np.eye(4)
        if self._head_joint is not None:
            turns[self._head_joint] = head @ turns.get(self._head_joint, np.eye(3))
        else:
            whole = self._mesh_from_pivot @ homogeneous(head) @ self._pivot_from_mesh
        rest = self._rest
        return Pose(
            _weights(values, slots.expressions, self._expression_range),
            {
                joint: homogeneous(np.linalg.solve(rest[joint], turn @ rest[joint]))
                for joint, turn in turns.items()
            },
            _weights(values, slots.eyelids, self._late_range),
            whole,
        )

    def _checked(self, frame: DrivingFrame) -> DrivingFrame:
        """`frame` itself; raises as `pose`."""
        arguments.instance("frame", frame, DrivingFrame)
        weights = arguments.mapping("frame.weights", frame.weights)
        for name, weight in weights.items():
            if name not in self._names:
                raise ValueError(
                    f"frame.weights: {name!r} is neither an ARKit name nor an input of this avatar"
                )
            arguments.finite(f"frame.weights {name}", weight)
        for part in ("head", "left_eye", "right_eye"):
            arguments.finite_array(f"frame.{part}", getattr(frame, part), (3,))
        return frame

    def _turn_eyes(self, turns: dict[str, F64], frame: DrivingFrame) -> None:
        """Adds the rotations of the eye joints to `turns`; measured ones replace those of the matrix."""
        for side, joint in self._eyes.items():
            if joint is None:
                continue
            measured = axes.eye_rotation(frame, side)
            if measured is not None:
                turns[joint] = self._seen(measured)
            elif joint not in turns:
                turns[joint] = self._seen(axes.eye_rotation_from_weights(frame.weights, side))

    def _seen(self, captured: F64) -> F64:
        """A captured rotation [3, 3] in the frame of the avatar."""
        return mirrored_matrices(captured) if self._mirror else captured


def _slots(outputs: tuple[str, ...]) -> _Slots:
    slots = _Slots({}, {}, {})
    for row, output in enumerate(outputs):
        kind, _, name = output.partition("/")
        if kind == "joint":
            joint, _, axis = name.rpartition("/")
            slots.joints.setdefault(joint, {})["xyz".index(axis)] = row
        else:
            (slots.expressions if kind == "expression" else slots.eyelids)[name] = row
    return slots


def _weights(values: F64, rows: dict[str, int], ranges: dict[str, Range]) -> dict[str, float]:
    """The weights by name, those with a range limited to it."""
    weights = {name: float(values[row]) for name, row in rows.items()}
    for name, (least, greatest) in ranges.items():
        if name in weights:
            weights[name] = min(max(weights[name], least), greatest)
    return weights


def _matrix_turn(values: F64, rows: dict[int, int]) -> F64:
    """The rotation [3, 3] of the rotation vector that output rows give, in mesh axes."""
    rotvec = np.zeros(3)
    for axis, row in rows.items():
        rotvec[axis] = values[row]
    result: F64 = matrix_from_rotvec(rotvec)
    return result


def _rest_frames(avatar: Avatar) -> dict[str, F64]:
    """joint -> linear part [3, 3] of mesh_from_joint at rest; rest^-1 R rest turns it by R in mesh axes."""
    rig = avatar.rig
    if rig is None:
        return {}
    world: list[F64] = []
    for joint, parent in enumerate(rig.parents):
        local = rig.rest_local[joint, :3, :3].astype(np.float64)
        world.append(local if parent < 0 else world[parent] @ local)
    for name, linear in zip(rig.joint_names, world, strict=True):
        if not np.linalg.cond(linear) < 1e6:
            raise AvatarError(
                "has a singular rest transform, so it cannot rotate", owner=avatar.name, field=f"joint {name}"
            )
    return dict(zip(rig.joint_names, world, strict=True))
