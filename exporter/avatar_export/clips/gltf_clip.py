"""Plays the clips of a .glb on an avatar: nodes to joints, morph targets to expressions, by name.

A joint takes delta = rest_local^-1 parent_from_joint, where parent_from_joint is the clip's transform of the
node of that name up to the node of the joint's parent (for a root joint: up to the scene), nodes in between
included. A joint that the clip does not move stays at rest. Clips of another skeleton are not retargeted.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from avatar_export.formats.gltf.animation import Clip, read_clip
from avatar_export.formats.gltf.sampler import Sampler, evaluate
from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.codec.glb import Glb
from avatar_runtime.driving.arkit import canonical, first_canonical
from avatar_runtime.io.errors import AvatarError, no_such
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_quat

MAX_FRAMES = 100_000
MAX_MATRICES = 4_000_000  # 512 MB of joint deltas


class Match(NamedTuple):
    """Which parts of a clip move which parts of an avatar."""

    joints: dict[str, int]  # joint -> node
    expressions: dict[str, Sampler]  # one column
    unmatched: list[str]  # moved nodes and morph targets that the avatar has no name for


def unmatched(avatar: Avatar, document: Glb, clip: str) -> list[str]:
    """The nodes and morph targets that the clip moves and that this avatar has no joint or expression for."""
    return _match(avatar, read_clip(document, clip)).unmatched


def clip_poses(avatar: Avatar, document: Glb, clip: str, fps: float) -> list[Pose]:
    """The poses of one clip at 0, 1/fps, ... seconds up to its end.

    Raises AvatarError for a damaged file, a clip that does not exist, or one that moves nothing of this avatar;
    ValueError unless fps is a positive number.
    """
    if not (math.isfinite(fps) and fps > 0):
        raise ValueError(f"fps must be a positive number, not {fps}")
    source, field = document.file, " ".join(clip.split())
    found = read_clip(document, clip)
    match = _match(avatar, found)
    if not match.joints and not match.expressions:
        known = (*(avatar.rig.joint_names if avatar.rig else ()), *avatar.expression_names)
        moved = ", ".join(match.unmatched[:4])
        raise no_such("joint or expression of this avatar", moved, known, file=source, field=field)
    if found.duration * fps > min(MAX_FRAMES, MAX_MATRICES / max(1, len(match.joints))):
        raise AvatarError(f"{found.duration:g} s at {fps:g} fps is too long", file=source, field=field)
    at = np.arange(math.floor(found.duration * fps + 1e-6) + 1) / fps
    with np.errstate(all="ignore"):
        deltas = _deltas(avatar, found, match, at)
        weights = {name: evaluate(sampler, at)[:, 0] for name, sampler in match.expressions.items()}
    for name, values in (*deltas.items(), *weights.items()):
        if not np.isfinite(values).all():
            raise AvatarError(f"moves {name} out of the range of float32", file=source, field=field)
    return [
        Pose(
            {name: float(values[frame]) for name, values in weights.items()},
            {joint: values[frame] for joint, values in deltas.items()},
        )
        for frame in range(len(at))
    ]


def _match(avatar: Avatar, clip: Clip) -> Match:
    joints: dict[str, int] = {}
    expressions: dict[str, Sampler] = {}
    strangers: list[str] = []
    known = set(avatar.rig.joint_names) if avatar.rig else set()
    for index, channels in clip.channels.items():
        node = clip.nodes[index]
        if set(channels) - {"weights"}:
            if node.name in known:
                joints.setdefault(node.name, index)
            else:
                strangers.append(node.name)
        if "weights" in channels:
            for column, target in enumerate(node.targets):
                names = _expressions(avatar, target)
                for name in names:
                    # Only this column: a file may name thousands of targets that the avatar lacks.
                    sampler = channels["weights"]
                    expressions.setdefault(name, replace(sampler, values=sampler.values[..., [column]]))
                if not names:
                    strangers.append(target or f"morph target {column} of {node.name}")
    return Match(joints, expressions, strangers)


def _expressions(avatar: Avatar, target: str) -> list[str]:
    """The expressions of that name or alias, else those with the same ARKit name in any spelling."""
    same = [e.name for e in avatar.expressions if target and target in (e.name, *e.aliases)]
    arkit = canonical(target)
    if same or arkit is None:
        return same
    return [e.name for e in avatar.expressions if first_canonical((e.name, *e.aliases)) == arkit]


def _deltas(avatar: Avatar, clip: Clip, match: Match, at: F64) -> dict[str, F64]:
    """joint -> delta [F, 4, 4]."""
    rig = avatar.rig
    if rig is None:
        return {}
    deltas = {}
    for joint, index in match.joints.items():
        row = rig.joint_names.index(joint)
        parent = rig.joint_names[rig.parents[row]] if rig.parents[row] >= 0 else None
        rest = rig.rest_local[row].astype(np.float64)
        if not np.linalg.cond(rest[:3, :3]) < 1e6:
            raise AvatarError("has a singular rest transform", owner=avatar.name, field=f"joint {joint}")
        deltas[joint] = np.linalg.inv(rest) @ _parent_from_node(clip, index, parent, at)
    return deltas


def _parent_from_node(clip: Clip, index: int, parent: str | None, at: F64) -> F64:
    """Transforms [F, 4, 4] from a node to the node named `parent`, or to the scene for None.

    If no node above has that name (another cut of the skeleton), only the node's own transform.
    """
    own = result = _local(clip, index, at)
    above = clip.nodes[index].parent
    while above >= 0 and clip.nodes[above].name != parent:
        result = _local(clip, above, at) @ result
        above = clip.nodes[above].parent
    return own if above < 0 and parent is not None else result


def _local(clip: Clip, index: int, at: F64) -> F64:
    """parent_from_node [F, 4, 4]: translation, rotation, scale, each animated or as in the file."""
    node, channels = clip.nodes[index], clip.channels.get(index, {})
    if node.matrix is not None:
        return np.broadcast_to(node.matrix, (len(at), 4, 4))
    part = {
        path: evaluate(channels[path], at)
        if path in channels
        else np.broadcast_to(rest, (len(at), len(rest)))
        for path, rest in node.rest.items()
    }
    turn = matrix_from_quat(np.roll(part["rotation"], 1, axis=-1))  # xyzw -> wxyz
    result: F64 = homogeneous(turn * part["scale"][:, None, :], part["translation"])
    return result
