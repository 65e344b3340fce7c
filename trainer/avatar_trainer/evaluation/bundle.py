"""A bundle, whoever trained it, against the frames of a capture."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
import torch

from avatar_runtime import Avatar, AvatarError, Player, Pose
from avatar_trainer.captures.model import Capture, Frame
from avatar_trainer.captures.targets import Target
from avatar_trainer.evaluation.evaluate import Score, measured, score, summary
from avatar_trainer.evaluation.lpips import Lpips

PROFILE = "trainer"  # of the raster: as the released trainers draw
LISTED = 6  # names in a note
TURNED = 1e-6  # entry of a joint's delta from which it moves


def evaluate_bundle(
    avatar: Avatar,
    capture: Capture,
    backend: str | None = None,
    lpips: Lpips | None = None,
    progress: Callable[[int], None] = lambda count: None,
) -> dict[str, Any]:
    """As `evaluate.evaluate`, of a bundle in the tracked poses and cameras of `capture`, by a backend of the runtime.

    Names that the avatar lacks are left out; `notes` says which. Raises AvatarError for an avatar that tracked poses
    cannot move, and for a rendering that is not finite.
    """
    if avatar.rig is None and (avatar.embedding is not None or not avatar.expressions):
        raise AvatarError("has no rig and no expressions: tracked poses cannot move it", file=avatar.name)
    player, done = Player(avatar, backend), 0

    def of(frame: Frame, target: Target) -> Score:
        nonlocal done
        image = player.frame(pose_of(capture, avatar, frame), frame.camera, (0.0, 0.0, 0.0), PROFILE).image
        if not np.isfinite(image.colour).all():
            raise AvatarError(f"frame {frame.name}: the avatar's rendering is not finite", file=avatar.name)
        done += 1
        progress(done)
        return score(torch.tensor(image.colour), frame, target, lpips)

    found = summary("bundle", avatar.gaussians.count, capture, measured(capture, of))
    return {**found, "bundle": avatar.name, "notes": left_out(capture, avatar)}


def pose_of(capture: Capture, avatar: Avatar, frame: Frame) -> Pose:
    """A tracked pose by names; only names that `avatar` has."""
    pose, known = frame.pose, _joints(avatar)
    expressions = dict(zip(capture.expression_names, pose.expression_weights.tolist(), strict=True))
    eyelids = dict(zip(capture.eyelids, pose.late_weights.tolist(), strict=True))
    joints = zip(capture.rig.joint_names, pose.joint_delta, strict=True)
    return Pose(
        {name: weight for name, weight in expressions.items() if name in avatar.expression_names},
        {name: delta for name, delta in joints if name in known},
        {name: weight for name, weight in eyelids.items() if name in avatar.eyelids},
        pose.world_from_avatar,
    )


def left_out(capture: Capture, avatar: Avatar) -> list[str]:
    """What the capture moves and the avatar lacks, in words."""
    poses = [frame.pose for frame in capture.frames]
    used = np.any([pose.expression_weights for pose in poses], axis=0)
    lids = np.any([pose.late_weights for pose in poses], axis=0)
    turned = np.any(
        [np.abs(pose.joint_delta - np.eye(4)).max(axis=(1, 2)) > TURNED for pose in poses], axis=0
    )
    parts: Iterable[tuple[str, Sequence[str], Any, Iterable[str]]] = (
        ("expressions", capture.expression_names, used, avatar.expression_names),
        ("eyelids", capture.eyelids, lids, avatar.eyelids),
        ("joints", capture.rig.joint_names, turned, _joints(avatar)),
    )
    notes = []
    for what, names, moves, known in parts:
        moving = [name for name, moved in zip(names, moves, strict=True) if moved]
        missing = [name for name in moving if name not in known]
        if missing:
            more = f" and {len(missing) - LISTED} more" if len(missing) > LISTED else ""
            notes.append(
                f"{len(missing)} of the {len(moving)} {what} that the capture moves are not in the bundle, and rest: "
                f"{', '.join(missing[:LISTED])}{more}"
            )
    return notes


def _joints(avatar: Avatar) -> tuple[str, ...]:
    return () if avatar.rig is None else avatar.rig.joint_names
