"""Plays an animation of an .fbx on an avatar: nodes to joints, blend shapes to expressions, by name.

As in `clips.gltf_clip`: delta = rest_local^-1 parent_from_joint, nodes between two joints included. A joint that the
file lacks stays at rest. Clips of another skeleton are not retargeted.
"""

from __future__ import annotations

import numpy as np

from avatar_export.formats.fbx.file import FPS, FbxClip, FbxFile
from avatar_runtime.avatar import F32, F64, Avatar, Clip, Rig
from avatar_runtime.driving.arkit import canonical, first_canonical
from avatar_runtime.io.errors import AvatarError, no_such

STILL = 1e-6  # of a transform's entries; smaller changes are rounding


def moves(clip: FbxClip) -> bool:
    """Whether anything moves in `clip`; files without an animation often hold a still one."""
    spread = [np.ptp(values, axis=0).max(initial=0) for values in (clip.world, clip.weights)]
    scale = max(1.0, float(np.abs(clip.world).max(initial=0)))
    return bool(max(spread) > STILL * scale)


def concerns(avatar: Avatar, file: FbxFile, clip: FbxClip) -> bool:
    """Whether the file has a joint of the avatar, or the clip moves an expression of it."""
    return bool(_nodes(avatar, file)) or any(_columns(avatar, file, clip).values())


def clip_of(avatar: Avatar, file: FbxFile, clip: FbxClip, name: str) -> Clip:
    """`clip` as a clip of `avatar` called `name`. Raises AvatarError if it has none of the avatar's joints and
    expressions, or moves a joint out of the range of float32.
    """
    columns, rows = _columns(avatar, file, clip), _nodes(avatar, file)
    if not concerns(avatar, file, clip):
        known = (*_joints(avatar), *avatar.expression_names)
        raise no_such("joint or expression of this avatar", file.nodes[-1], known, file=file.name, field=name)
    t = len(clip.world)
    weights = np.zeros((t, len(avatar.expressions)), np.float32)
    for column, expressions in columns.items():
        weights[:, expressions] = clip.weights[:, [column]]
    delta: F64 = np.tile(np.eye(4), (t, len(_joints(avatar)), 1, 1))
    if avatar.rig is not None:
        world = file.in_metres(clip.world)
        for j, joint in enumerate(avatar.rig.joint_names):
            if joint in rows:
                rest = avatar.rig.rest_local[j].astype(np.float64)
                delta[:, j] = _solved(rest, _parent_from(avatar.rig, file, world, rows, j), joint, file)
    with np.errstate(over="ignore"):
        deltas: F32 = delta.astype(np.float32)
    if not np.isfinite(deltas).all():
        raise AvatarError("moves a joint out of the range of float32", file=file.name, field=name)
    world_from_avatar = np.tile(np.eye(4, dtype=np.float32), (t, 1, 1))
    return Clip(name, FPS, weights, np.zeros((t, len(avatar.eyelids)), np.float32), deltas, world_from_avatar)


def _nodes(avatar: Avatar, file: FbxFile) -> dict[str, int]:
    """joint -> node of that name; bones of a skin are preferred."""
    named = {name: node for node, name in reversed([*enumerate(file.nodes)])}
    named |= {file.nodes[c.bone]: c.bone for mesh in file.meshes for c in mesh.clusters}
    return {joint: named[joint] for joint in _joints(avatar) if joint in named}


def _columns(avatar: Avatar, file: FbxFile, clip: FbxClip) -> dict[int, list[int]]:
    """channel that the clip moves -> expressions."""
    moved = np.flatnonzero(clip.weights.any(axis=0))
    return {int(column): _expressions(avatar, file.channels[column]) for column in moved}


def _joints(avatar: Avatar) -> tuple[str, ...]:
    return avatar.rig.joint_names if avatar.rig else ()


def _parent_from(rig: Rig, file: FbxFile, world: F64, rows: dict[str, int], joint: int) -> F64:
    """parent_from_joint [T, 4, 4] of a joint of the rig; from the scene for a root.

    If the file has no node of the parent's name (another cut of the skeleton), from the node above.
    """
    node = rows[rig.joint_names[joint]]
    if rig.parents[joint] < 0:
        return world[:, node]
    above = rows.get(rig.joint_names[rig.parents[joint]], int(file.parents[node]))
    if above < 0:
        return world[:, node]
    return _solved(world[:, above], world[:, node], file.nodes[above], file)


def _solved(matrices: F64, values: F64, joint: str, file: FbxFile) -> F64:
    if not (np.linalg.cond(matrices[..., :3, :3]) < 1e8).all():
        raise AvatarError(
            "has a singular transform, so the joints below it are undefined",
            file=file.name,
            field=f"joint {joint!a}",
        )
    return np.linalg.solve(matrices, values).astype(np.float64)


def _expressions(avatar: Avatar, channel: str) -> list[int]:
    """The expressions of that name or alias, else those with the same ARKit name in any spelling."""
    same = [i for i, e in enumerate(avatar.expressions) if channel in (e.name, *e.aliases)]
    arkit = canonical(channel)
    if same or arkit is None:
        return same
    return [i for i, e in enumerate(avatar.expressions) if first_canonical((e.name, *e.aliases)) == arkit]
