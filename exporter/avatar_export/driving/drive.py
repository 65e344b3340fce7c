"""ARKit frames to poses of one avatar: names -> matrix -> weights, joint rotations, eyelids.

`Driving.mode` "names" is a matrix of zeros and ones (each input drives the expressions and eyelids whose name
or alias spells it), so both modes use the same code. Measured rotations are added: that of the head to
`head_joint`, else to the whole avatar about `head_pivot`; that of an eye to its joint. If matrix outputs drive
an eye joint too, the measured rotation replaces them, so that the eye is not rotated twice. If the frame has no
measured rotation and no output drives the joint, the eye follows its eyeLook weights.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from avatar_export.driving import axes
from avatar_export.driving.arkit import ARKIT_NAMES, first_canonical
from avatar_export.driving.frames import DrivingFrame, DrivingTake
from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec, translation_matrix

NO_DRIVING = (
    "ARKit weights cannot drive this avatar: its expressions are a basis of their own (such as FLAME's) and "
    "no matrix from the 52 ARKit names to it is known; fit one to faces that have both, write it as JSON "
    '{"inputs": [ARKit names], "outputs": ["expression/NAME", "eyelid/NAME", "joint/NAME/x|y|z"], "matrix": '
    "[[one number per input] per output]} and pass it with --driving FILE"
)


NOTHING_TO_DRIVE = (
    "has no expression, eyelid or jaw that ARKit weights could drive; an avatar that is embedded in a mesh gets "
    "them with its rig: convert it again with --rig or --body-model"
)


@dataclass(frozen=True)
class LinearMap:
    """outputs = matrix @ inputs, for either mode."""

    inputs: tuple[str, ...]  # [I] ARKit names
    outputs: tuple[str, ...]  # [O]
    matrix: F64  # [O, I]


def pose_from_frame(avatar: Avatar, frame: DrivingFrame) -> Pose:
    """The pose of one frame. Raises AvatarError if ARKit cannot drive this avatar."""
    return _driver(avatar)(frame)


def poses(avatar: Avatar, take: DrivingTake) -> list[Pose]:
    """The pose of every frame. Raises AvatarError if ARKit cannot drive this avatar."""
    drive = _driver(avatar)
    return [drive(take.frame(row)) for row in range(len(take))]


def driving_notes(avatar: Avatar) -> list[str]:
    """What a user should know about ARKit driving of an avatar; [] if there is nothing to say."""
    if not avatar.expressions and not avatar.late_morph_names:
        return []
    if avatar.driving.mode == "none":
        return ["ARKit cannot drive this avatar yet; pass --driving FILE with a matrix from the ARKit names"]
    joints = {name.lower(): name for name in (avatar.rig.joint_names if avatar.rig else ())}
    outputs = {output.split("/")[1] for output in linear_map(avatar).outputs if output.startswith("joint/")}
    if "jaw" in joints and joints["jaw"] not in outputs:
        return [
            f"the jaw is a joint ({joints['jaw']}), which ARKit names cannot rotate without a driving matrix, so "
            "jawOpen only moves the skin; "
            "pass --driving FILE with rows joint/jaw/x if this avatar was trained with a rotating jaw"
        ]
    return []


def unreached(avatar: Avatar) -> list[str]:
    """The ARKit names that move nothing of this avatar, except its head and eye joints."""
    linear = linear_map(avatar)
    used = {name for name, column in zip(linear.inputs, linear.matrix.T, strict=True) if column.any()}
    return [name for name in ARKIT_NAMES if name not in used]


def linear_map(avatar: Avatar) -> LinearMap:
    """The linear map from ARKit names to the outputs of `avatar`. Raises AvatarError for driving mode "none"."""
    maps: dict[str, Callable[[Avatar], LinearMap]] = {"names": _map_by_name, "matrix": _map_by_matrix}
    if avatar.driving.mode not in maps:
        message = NO_DRIVING if avatar.expressions or avatar.late_morph_names else NOTHING_TO_DRIVE
        raise AvatarError(message, owner=avatar.name, field="driving")
    return maps[avatar.driving.mode](avatar)


def _map_by_name(avatar: Avatar) -> LinearMap:
    targets = [(f"expression/{e.name}", (e.name, *e.aliases)) for e in avatar.expressions]
    targets += [(f"eyelid/{name}", (name,)) for name in avatar.late_morph_names]
    rows = [(output, first_canonical(names)) for output, names in targets]
    reached = [(output, name) for output, name in rows if name is not None]
    matrix = np.array([[float(name == column) for column in ARKIT_NAMES] for _, name in reached])
    return LinearMap(
        ARKIT_NAMES, tuple(output for output, _ in reached), matrix.reshape(-1, len(ARKIT_NAMES))
    )


def _map_by_matrix(avatar: Avatar) -> LinearMap:
    driving = avatar.driving
    if driving.matrix is None:
        raise AvatarError("mode 'matrix' without a matrix", owner=avatar.name, field="driving")
    return LinearMap(driving.inputs, driving.outputs, driving.matrix.astype(np.float64))


class _Slots(NamedTuple):
    """The output row that drives each expression, eyelid and joint axis."""

    expressions: dict[str, int]
    eyelids: dict[str, int]
    joints: dict[str, dict[int, int]]  # joint -> axis -> row


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


def _driver(avatar: Avatar) -> Callable[[DrivingFrame], Pose]:
    """A function from frames to poses; everything that is the same for all frames is computed once."""
    linear = linear_map(avatar)
    slots = _slots(linear.outputs)
    driving = avatar.driving
    rest = _rest_frames(avatar)
    to_pivot = translation_matrix(np.array(driving.head_pivot, np.float64))
    eyes = {"Left": driving.left_eye_joint, "Right": driving.right_eye_joint}

    def drive(frame: DrivingFrame) -> Pose:
        values = linear.matrix @ np.array([frame.weights.get(name, 0.0) for name in linear.inputs])
        turns = {joint: _matrix_turn(values, rows) for joint, rows in slots.joints.items()}
        _turn_eyes(turns, eyes, frame)
        head, whole = axes.head_rotation(frame), np.eye(4)
        if driving.head_joint is not None:
            turns[driving.head_joint] = head @ turns.get(driving.head_joint, np.eye(3))
        else:
            whole = to_pivot @ homogeneous(head) @ np.linalg.inv(to_pivot)
        return Pose(
            {name: float(values[row]) for name, row in slots.expressions.items()},
            {
                joint: homogeneous(np.linalg.solve(rest[joint], turn @ rest[joint]))
                for joint, turn in turns.items()
            },
            {name: float(values[row]) for name, row in slots.eyelids.items()},
            whole,
        )

    return drive


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


def _turn_eyes(turns: dict[str, F64], eyes: dict[str, str | None], frame: DrivingFrame) -> None:
    """Adds the rotations of the eye joints to `turns`; measured ones replace those of the matrix."""
    for side, joint in eyes.items():
        if joint is None:
            continue
        measured = axes.eye_rotation(frame, side)
        if measured is not None:
            turns[joint] = measured
        elif joint not in turns:
            turns[joint] = axes.eye_rotation_from_weights(frame.weights, side)
