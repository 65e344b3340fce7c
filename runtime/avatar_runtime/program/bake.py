"""Avatar to program: how rows lie in packed buffers, and which kernels run over which rows with which constants."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from avatar_runtime.avatar import Avatar, Rig
from avatar_runtime.program.chunks import BUFFER_LIMIT
from avatar_runtime.program.codes import NOTHING_CODED, Coded, Codes
from avatar_runtime.program.gaussians import SPARSE_PARTS, array_of, bake_level
from avatar_runtime.program.mesh import bake_casting, bake_mesh, bake_surface
from avatar_runtime.program.model import POSE_SECTIONS, WORD, Buffer, Level, Pass, Program


def bake(avatar: Avatar, coded: Coded = NOTHING_CODED, limit: int = BUFFER_LIMIT) -> Program:
    """The program of `avatar`; arrays that `coded` holds by their path are stored as those integers.

    `limit` is the largest buffer in bytes; larger ones are split by rows. Raises AvatarError for a part that
    exceeds the limit and cannot be split.
    """
    return bake_levels([(avatar, coded)], limit)


def bake_levels(levels: list[tuple[Avatar, Coded]], limit: int = BUFFER_LIMIT) -> Program:
    """The program of an avatar at several levels of detail, finest first; they share the rig and its mesh."""
    avatar, coded = levels[0]
    pose, floats = pose_layout(avatar)
    buffers: dict[str, Buffer] = {"Pose": Buffer("Pose", WORD * floats)}
    mesh: tuple[Pass, ...] = ()
    turns: tuple[Pass, ...] = ()
    if avatar.rig is not None or avatar.embedding is not None:
        mesh = bake_mesh(avatar, coded, pose, limit, buffers)
    if avatar.embedding is not None:
        turns = bake_surface(avatar, coded, pose, limit, buffers)
    casting: tuple[Pass, ...] = ()
    if avatar.relight is not None and mesh:
        casting = bake_casting(avatar, limit, buffers)
    found: list[Level] = []
    for index, (level, codes) in reversed(
        [*enumerate(levels)]
    ):  # buffers lie in loading order: coarse ones first
        prefix = f"level{index}/" if index else ""
        found.insert(0, bake_level(level, codes, prefix, turns, casting, pose, limit, buffers))
    return Program(buffers, mesh, tuple(found), pose, floats, avatar.embedding is not None)


def program_of(avatar: Avatar, limit: int) -> tuple[Program, int]:
    """(program, level) that plays `avatar`: its pack's, or one that is baked now. Raises AvatarError as `bake`."""
    packed = avatar.packed
    if packed is not None and packed.fits(avatar):
        program: Program = packed.program
        return program, packed.level
    return bake(avatar, nothing_stored(avatar), limit), 0


def nothing_stored(avatar: Avatar) -> Coded:
    """The sparse deltas of which every number is 0, at width 0: kernels then read none of them."""
    found: dict[str, Codes] = {}
    for path, kinds in SPARSE_PARTS.values():
        rows = array_of(avatar, path)
        for attribute, (_, kind) in kinds.items():
            values = rows.values[attribute]
            if kind == "signed" and not values.any():
                channels = int(np.prod(values.shape[1:], dtype=np.int64))
                found[f"{path}.{attribute}"] = Codes(
                    kind, None, np.zeros((rows.columns, channels), np.float32)
                )
    return found


def pose_layout(avatar: Avatar) -> tuple[Mapping[str, int], int]:
    """({section of Pose: its first float}, floats in all)."""
    rig: Rig | None = avatar.rig
    sizes = (
        len(avatar.expressions),
        avatar.blendshapes.correctives.columns,
        len(avatar.eyelids),
        12 * (0 if rig is None else rig.joint_count),
    )
    ends = np.cumsum(sizes).tolist()
    return dict(zip(POSE_SECTIONS, [0, *ends[:-1]], strict=True)), ends[-1]
