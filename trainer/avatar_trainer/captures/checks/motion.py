"""Numbers of tracked poses that no body makes: angles, weights and sizes, checked in every frame."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from avatar_runtime import F64, I64, SparseRows
from avatar_trainer.captures.bodies import FLAME_JOINTS
from avatar_trainer.captures.model import Capture, Frame

# Degrees from rest beyond which no joint of a face turns: jaws open to some 35, eyes turn by some 45, necks by some 80.
FARTHEST = {"neck": 120.0, "jaw": 70.0, "leftEye": 80.0, "rightEye": 80.0}
# Of the mesh's size by which expressions may move a vertex: an open jaw moves the chin of a head by 0.15.
LARGEST_MOTION = 0.6
HUMAN = (0.15, 2.5)  # metres of the diagonal of a body model: an infant's face, a tall man with spread arms
MILLIMETRES, CENTIMETRES = 1000, 100


def impossible(capture: Capture) -> Iterator[tuple[str, str]]:
    """(field, what is wrong with it): angles and weights that no face can have, the worst frame of each."""
    if capture.rig.joint_names == FLAME_JOINTS:
        yield from _angles(capture)
    for part, names, morphs in (
        ("expression", capture.expression_names, capture.rig.morphs),
        ("eyelids", capture.eyelids, capture.rig.late_morphs),
    ):
        if names:
            yield from _weights(capture, part, names, morphs)


def size(capture: Capture) -> str | None:
    """What is odd about the size of a body model, in words; None for a rig of another kind, and for human sizes."""
    if "body_model" not in capture.export_inputs:
        return None
    across = diagonal(capture)
    if HUMAN[0] <= across <= HUMAN[1]:
        return None
    for unit, factor in (("millimetres", MILLIMETRES), ("centimetres", CENTIMETRES)):
        if HUMAN[0] <= across / factor <= HUMAN[1]:
            return f"is {across:.3g} m across: its lengths seem to be {unit}, and metres are needed"
    return f"is {across:.3g} m across, which no person is; lengths are metres"


def diagonal(capture: Capture) -> float:
    """Of the box of the mesh at rest, metres."""
    return float(np.linalg.norm(np.ptp(capture.rig.vertices.astype(np.float64), axis=0)))


def _angles(capture: Capture) -> Iterator[tuple[str, str]]:
    deltas = np.stack([frame.pose.joint_delta for frame in capture.frames])[:, :, :3, :3]
    cosine = (np.trace(deltas, axis1=-2, axis2=-1) - 1) / 2
    degrees = np.degrees(np.arccos(np.clip(cosine, -1, 1)))  # [T, J]
    for joint, most in FARTHEST.items():
        of = degrees[:, FLAME_JOINTS.index(joint)]
        frame, count = int(np.argmax(of)), int((of > most).sum())
        if count:
            yield (
                "joints",
                f"{joint} turns by {of[frame]:.0f} degrees in frame {capture.frames[frame].name} and by more than "
                f"{most:.0f} in {count} of {len(of)}: were the angles written in degrees? They are radians",
            )


def _weights(
    capture: Capture, part: str, names: Sequence[str], morphs: SparseRows
) -> Iterator[tuple[str, str]]:
    weights = np.stack([_row(frame, part) for frame in capture.frames]).astype(np.float64)  # [T, K]
    moved = np.abs(weights) * _reach(morphs, len(names))  # metres, each morph alone
    frame, column = divmod(int(np.argmax(moved)), moved.shape[1])
    most = LARGEST_MOTION * diagonal(capture)
    if moved[frame, column] <= most:
        return
    percent = (moved / 100 <= most).all() and np.abs(weights).max() >= 10
    hint = "are they percent? 1 is the whole morph" if percent else "do they belong to another body model?"
    yield (
        part,
        f"{names[column]} is {weights[frame, column]:.3g} in frame {capture.frames[frame].name}, which moves the mesh "
        f"by {moved[frame, column]:.2g} m: {hint}",
    )


def _row(frame: Frame, part: str) -> F64:
    pose = frame.pose
    row: F64 = (pose.expression_weights if part == "expression" else pose.late_weights).astype(np.float64)
    return row


def _reach(morphs: SparseRows, count: int) -> F64:
    """[count] metres by which each morph moves a vertex at most."""
    lengths = np.linalg.norm(morphs.values["position"].astype(np.float64), axis=-1)
    columns: I64 = morphs.column.astype(np.int64)
    reach = np.zeros(count)
    np.maximum.at(reach, columns, lengths)
    return reach
