"""What a distilled avatar must reach to be written, and the doubts about one that falls short."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_export.distill.dumps.folder import OWNER
from avatar_export.distill.measure import Errors
from avatar_export.notes.note import Note, doubt
from avatar_export.notes.text import text
from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation

REFUSED_DB, WARNED_DB = 25.0, 36.0  # of the foreground on held-out frames
REFUSED_SHARE = 0.01  # RMS of positions over the figure's height
FACTORS = (1.0, 1.5, 2.0, 3.0)  # of the ranges that were seen
POSES = 4  # of each factor
SEED = 11


@dataclass(frozen=True)
class Sweep:
    """How far the Gaussians go when drivers and joints go beyond what was seen."""

    factor: F64  # [S] times the range
    reach: F64  # [S] largest distance from rest, in heights of the figure
    scale: F64  # [S] largest growth of a scale, times


def sweep(avatar: Avatar, turns: F64, height: float) -> Sweep:
    """Random poses at and beyond the ranges; `turns` [J] is the largest rotation of each joint, radians.

    Raises AvatarError where a position, scale or opacity is no longer a finite number.
    """
    rng, player = np.random.default_rng(SEED), Player(avatar)
    rest = player.animate(Pose())
    joints = () if avatar.rig is None else avatar.rig.joint_names
    reach, growth = [], []
    for factor in FACTORS:
        far, grown = 0.0, 1.0
        for _ in range(POSES):
            weights = {
                e.name: float(factor * rng.choice(np.array([0.0, e.range[0], e.range[1]])))
                for e in avatar.expressions
            }
            turned = {
                name: joint_rotation(factor * turn * _axis(rng))
                for name, turn in zip(joints, turns, strict=True)
                if turn
            }
            splats = player.animate(Pose(weights, turned))
            for name in ("mean", "scale", "opacity", "quat_wxyz"):
                if not np.isfinite(getattr(splats, name)).all():
                    raise AvatarError(
                        f"is not finite at {factor:g} times the range that was seen: the dumps do not say enough of "
                        "their drivers; dump more random poses",
                        field=name,
                        owner=OWNER,
                    )
            far = max(far, float(np.linalg.norm(splats.mean - rest.mean, axis=1).max()))
            grown = max(grown, float((splats.scale / np.maximum(rest.scale, 1e-12)).max()))
        reach.append(far / max(height, 1e-9))
        growth.append(grown)
    return Sweep(np.array(FACTORS), np.array(reach), np.array(growth))


def _axis(rng: np.random.Generator) -> F64:
    axis = rng.normal(size=3)
    return np.asarray(axis / np.linalg.norm(axis), np.float64)


def refuse(errors: Errors, accept: bool) -> list[Note]:
    """What is doubtful about the errors on held-out frames.

    Raises AvatarError for errors that nobody wants unknowingly, unless `accept` is set.
    """
    share = 1e-3 * errors.seen / max(errors.height, 1e-9)
    found = []
    if errors.decibels < REFUSED_DB:
        found.append(doubt("foreground_off", db=errors.decibels, least=REFUSED_DB))
    if share > REFUSED_SHARE:
        found.append(doubt("positions_off", mm=errors.seen, share=100 * share, most=100 * REFUSED_SHARE))
    if found and not accept:
        said = " and ".join(map(text, found))
        raise AvatarError(f"{said}; see the report, dump more poses, or pass --accept-error", owner=OWNER)
    if not found and errors.decibels < WARNED_DB:
        found.append(doubt("foreground_off", db=errors.decibels, least=WARNED_DB))
    return found
