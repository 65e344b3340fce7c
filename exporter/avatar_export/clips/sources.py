"""Clips of an avatar from whatever holds poses: recordings of a face, glTF and FBX animations, tracked bodies.

One row of SOURCES a kind of file. The way back, from a clip to poses that can be played, is here too.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from avatar_export.asm.bake import bake_clips
from avatar_export.asm.files import is_face, load
from avatar_export.bodies.pose_files import body_clip, is_pose_file, read_poses
from avatar_export.clips import fbx_clip, gltf_clip
from avatar_export.driving import drive, takes
from avatar_export.driving.frames import frame_rate
from avatar_export.formats.fbx.file import open_fbx
from avatar_export.formats.gltf.animation import read_clip
from avatar_export.readers import lam
from avatar_runtime.avatar import Avatar, Blendshapes, Clip, Expression, Gaussians, Rig, Rules, SparseRows
from avatar_runtime.codec import glb
from avatar_runtime.codec.glb import Glb
from avatar_runtime.io.errors import AvatarError, no_such
from avatar_runtime.io.whole_files import read_bytes
from avatar_runtime.pose import Pose, clip_pose, resolve

FPS = 30.0  # where the keys of a glTF clip lie on no even grid
NOTHING = (
    "holds no animation that moves a joint or an expression of this avatar; their names must be the same"
)
RATES = (5.0, 240.0)  # of keys that set the rate of a clip


def clips_from(
    avatar: Avatar, path: Path, name: str | None = None, *, optional: bool = False
) -> tuple[Clip, ...]:
    """The clips in the file `path`, for `avatar`; their names differ from one another and from its own.

    Live Link Face recordings (CSV or packets) through the avatar's driving; every animation of a .glb, of a LAM zip
    or of an .fbx by the names of joints and morph targets, those that move nothing here left out; tracked poses
    of the avatar's body model (`readers.pose_files`); takes of an ASM face by the names of bones. `name`: of the one
    to take from several animations, else what the clip is called instead of the file. glTF clips keep the rate of
    their keys, if it is even.
    Raises AvatarError for a file that is none of these, is damaged, or (unless `optional`) moves nothing here.
    """
    found = _source(path)(avatar, path, name)
    if not found and not optional:
        raise AvatarError(NOTHING, file=path.name)
    taken = {clip.name for clip in avatar.clips}
    unique = []
    for clip in found:
        unique.append(replace(clip, name=unique_name(clip.name, taken)))
        taken.add(unique[-1].name)
    return tuple(unique)


def unmatched(avatar: Avatar, path: Path, name: str) -> list[str]:
    """What a glTF clip of a file moves and `avatar` has no joint or expression for; nothing of other files."""
    document = _gltf(path)
    if document is None or name not in gltf_clip.clips(document):
        return []
    return gltf_clip.unmatched(avatar, document, name)


def clip_from_poses(avatar: Avatar, name: str, fps: float, poses: Sequence[Pose]) -> Clip:
    """`poses`, `fps` a second, as arrays in the order of the avatar's names.

    Raises AvatarError for a name that the avatar lacks, ValueError without poses or for fps that is no positive number.
    """
    if not poses or not (math.isfinite(fps) and fps > 0):
        raise ValueError(f"{len(poses)} poses at {fps} fps are no clip")
    arrays = [resolve(pose, avatar) for pose in poses]
    return Clip(
        name,
        float(fps),
        np.stack([a.expression_weights for a in arrays]),
        np.stack([a.late_weights for a in arrays]),
        np.stack([a.joint_delta for a in arrays]).astype(np.float32),
        np.stack([a.world_from_avatar for a in arrays]).astype(np.float32),
    )


def clip_poses(avatar: Avatar, clip: Clip) -> list[Pose]:
    """The pose of every frame of one of the avatar's clips."""
    return [clip_pose(avatar, clip, frame) for frame in range(clip.frames)]


def first_frame(clip: Clip) -> Clip:
    """The clip's first frame alone."""
    return replace(
        clip,
        expression_weights=clip.expression_weights[:1],
        late_weights=clip.late_weights[:1],
        joint_delta=clip.joint_delta[:1],
        world_from_avatar=clip.world_from_avatar[:1],
    )


def unique_name(name: str, taken: Collection[str]) -> str:
    """`name` as printable text, with _2, _3 ... behind it where it is taken."""
    plain = "".join(c if c.isprintable() else "_" for c in name).strip()[:80] or "clip"
    number, result = 1, plain
    while result in taken:
        number += 1
        result = f"{plain}_{number}"
    return result


def rig_avatar(rig: Rig, expressions: tuple[Expression, ...]) -> Avatar:
    """An avatar of a mesh and its joints alone, for what poses a mesh; it has no Gaussian, so it is no sound one."""
    k, features = len(expressions), 9 * len(rig.corrective_joints)
    return Avatar(
        name="rig",
        gaussians=Gaussians(*(np.zeros((0, *shape), np.float32) for shape in ((3,), (3,), (4,), (), (1, 3)))),
        groups=(),
        rules=Rules(),
        expressions=expressions,
        late_morph_names=(),
        blendshapes=Blendshapes(
            SparseRows.empty(0, k, {"mean": (3,), "quat_wxyz": (4,)}),
            SparseRows.empty(0, k, {"log_scale": (3,), "opacity_logit": (), "sh": (1, 3)}),
            SparseRows.empty(0, features, {"mean": (3,)}),
            SparseRows.empty(0, 0, {"mean": (3,)}),
        ),
        skin=SparseRows.empty(0, rig.joint_count, {"weight": ()}),
        rig=rig,
        sh_degree=0,
    )


class _Source(NamedTuple):
    """A kind of file: how it is told, and its clips by (avatar, path, name)."""

    matches: Callable[[Path], bool]
    read: Callable[[Avatar, Path, str | None], list[Clip]]


def _source(path: Path) -> Callable[[Avatar, Path, str | None], list[Clip]]:
    return next(source.read for source in SOURCES if source.matches(path))


def _recorded(avatar: Avatar, path: Path, name: str | None) -> list[Clip]:
    take = takes.read_take(path)
    return [clip_from_poses(avatar, name or path.stem, take.fps, drive.poses(avatar, take))]


def _tracked(avatar: Avatar, path: Path, name: str | None) -> list[Clip]:
    if avatar.rig is None:
        raise AvatarError("poses a body model, but this avatar has no rig", file=path.name)
    return [body_clip(avatar.rig, read_poses(path), name or path.stem)]


def _asm(avatar: Avatar, path: Path, name: str | None) -> list[Clip]:
    """The takes of an ASM face on the bones of the same names; its deltas begin in its own neutral."""
    face = load(path)
    own = avatar.rig.joint_names if avatar.rig is not None else ()
    at = {bone: row for row, bone in enumerate(face.template.bone_names)}
    if not set(own) & set(at):
        return []
    clips = {clip.name: clip for clip in bake_clips(face)}
    return [
        _on_joints(avatar, clips[take], [at.get(joint) for joint in own])
        for take in _chosen([*clips], name, path.name)
    ]


def _on_joints(avatar: Avatar, clip: Clip, rows: Sequence[int | None]) -> Clip:
    """`clip` for `avatar`, whose joint k is its joint rows[k], or rests."""
    delta = np.tile(np.eye(4, dtype=np.float32), (clip.frames, len(rows), 1, 1))
    for joint, row in enumerate(rows):
        if row is not None:
            delta[:, joint] = clip.joint_delta[:, row]
    return replace(
        clip,
        expression_weights=np.zeros((clip.frames, len(avatar.expressions)), np.float32),
        late_weights=np.zeros((clip.frames, len(avatar.late_morph_names)), np.float32),
        joint_delta=delta,
    )


def _gltf(path: Path) -> Glb | None:
    """The glTF that holds a file's clips: a .glb itself, or what lies in a LAM zip; None for other files."""
    if path.suffix.lower() == ".glb":
        return glb.decode(read_bytes(path, gltf_clip.MAX_FILE_BYTES), path.name)
    data = lam.clip_source(path) if lam.detect(path) else None
    return None if data is None else glb.decode(data, lam.CLIPS)


def _gltf_clips(avatar: Avatar, path: Path, name: str | None) -> list[Clip]:
    document = _gltf(path)
    if document is None:
        return []

    def read(clip: str) -> Clip:
        fps = _rate(document, clip)
        return clip_from_poses(avatar, clip, fps, gltf_clip.clip_poses(avatar, document, clip, fps))

    known = gltf_clip.clips(document)
    moving = [clip for clip in known if clip == name or _moves(avatar, document, clip)]
    return [read(clip) for clip in _chosen(moving, name, document.file)]


def _moves(avatar: Avatar, document: Glb, name: str) -> bool:
    """Whether the clip moves a joint or an expression of the avatar."""
    clip = read_clip(document, name)
    moved = sum(
        bool(set(channels) - {"weights"}) + ("weights" in channels) * len(clip.nodes[node].targets)
        for node, channels in clip.channels.items()
    )
    return moved > len(gltf_clip.unmatched(avatar, document, name))


def _rate(document: Glb, name: str) -> float:
    """Frames a second of the sampler with most keys, if they are even; else FPS."""
    samplers = [s for moved in read_clip(document, name).channels.values() for s in moved.values()]
    times = max((s.times for s in samplers), key=len, default=np.zeros(1))
    rate = frame_rate(times)
    frames = times * rate
    even = np.abs(frames - np.round(frames)).max() < 0.01 and RATES[0] <= rate <= RATES[1]
    return rate if even and len(times) > 2 else FPS


def _fbx(avatar: Avatar, path: Path, name: str | None) -> list[Clip]:
    file = open_fbx(path)
    known = {unique_name(clip.name, ()): clip for clip in file.clips if fbx_clip.moves(clip)}
    known = {key: clip for key, clip in known.items() if key == name or fbx_clip.concerns(avatar, file, clip)}
    return [fbx_clip.clip_of(avatar, file, known[clip], clip) for clip in _chosen([*known], name, path.name)]


def _chosen(known: Sequence[str], name: str | None, file: object) -> Sequence[str]:
    """`name`, which must be among `known`; or all of them."""
    if name is not None and name not in known:
        raise no_such("clip of this file", name, known, file=file)
    return known if name is None else [name]


def _suffix(suffix: str) -> Callable[[Path], bool]:
    return lambda path: path.suffix.lower() == suffix


SOURCES: tuple[_Source, ...] = (
    _Source(_suffix(".glb"), _gltf_clips),
    _Source(_suffix(".fbx"), _fbx),
    _Source(lam.detect, _gltf_clips),
    _Source(is_face, _asm),
    _Source(is_pose_file, _tracked),
    _Source(lambda path: True, _recorded),
)
