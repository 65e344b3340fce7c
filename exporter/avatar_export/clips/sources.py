"""Clips of an avatar from every kind of file that holds poses: one row of SOURCES a kind."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from avatar_export.asm.bake import bake_clips
from avatar_export.asm.files import is_face, load
from avatar_export.bodies.pose_files import body_clip, is_pose_file, read_poses
from avatar_export.clips import doubts, fbx_clip, gltf_files, other_avatar
from avatar_export.clips.poses import clip_from_poses
from avatar_export.driving import drive, takes
from avatar_export.driving.frames import DrivingTake
from avatar_export.formats.fbx.file import open_fbx
from avatar_export.formats.gltf.animation import clip_names
from avatar_export.notes.note import Note
from avatar_runtime.avatar import Avatar, Clip
from avatar_runtime.io.errors import AvatarError

BASIS = 2.0  # the end of a range from which on an expression is no shape of which 1 is the whole
NOTHING = "has no animation that moves a joint or an expression of this avatar; their names must be the same"


class Found(NamedTuple):
    """The clips of a file for an avatar, and what a user should know of them."""

    clips: Sequence[Clip]
    notes: Sequence[Note]


def clips_from(avatar: Avatar, path: Path, *, optional: bool = False) -> tuple[Clip, ...]:
    """The clips of `read_clips`."""
    return tuple(read_clips(avatar, path, optional=optional).clips)


def read_clips(avatar: Avatar, path: Path, *, optional: bool = False) -> Found:
    """The clips in the file `path`, for `avatar`; their names differ from one another and from its own.

    - Live Link Face recordings (CSV or packets) and bsData.json, alone or in a LAM zip, go through the driving.
    - Animations of a .glb, an .fbx or a LAM zip are matched by the names of joints and morph targets; those that move
      nothing of this avatar are left out. glTF clips keep the rate of their keys, if it is even.
    - Tracked poses of the avatar's body model (`bodies.pose_files`).
    - Takes of an ASM face are matched by the names of bones.
    - OTHER_BUNDLE:NAME is a clip of another avatar (`clips.other_avatar`).

    A file with one unnamed clip gives it the file's name.
    Raises AvatarError for any other file, a damaged one, and (unless `optional`) one that moves nothing here.
    """
    found = next(source.read for source in SOURCES if source.matches(path))(avatar, path)
    if not found.clips and not optional:
        raise AvatarError(NOTHING, file=path.name)
    taken = {clip.name for clip in avatar.clips}
    unique = []
    for clip in found.clips:
        unique.append(replace(clip, name=unique_name(clip.name, taken)))
        taken.add(unique[-1].name)
    return Found(unique, found.notes)


def unique_name(name: str, taken: Collection[str]) -> str:
    """`name` as printable text, with _2, _3 ... appended if it is in `taken`."""
    plain = "".join(c if c.isprintable() else "_" for c in name).strip()[:80] or "clip"
    number, result = 1, plain
    while result in taken:
        number += 1
        result = f"{plain}_{number}"
    return result


class _Source(NamedTuple):
    """A kind of file: how it is recognised, and its clips for an avatar."""

    matches: Callable[[Path], bool]
    read: Callable[[Avatar, Path], Found]


def _judged(avatar: Avatar, path: Path, clips: Sequence[Clip], notes: Sequence[Note] = ()) -> Found:
    """The clips, whose weights were stored as such."""
    usual = [at for at, one in enumerate(avatar.expressions) if max(map(abs, one.range)) < BASIS]
    names = [avatar.expression_names[at] for at in usual]
    judged = [
        note
        for clip in clips
        for note in doubts.too_far(
            "percent",
            doubts.PERCENT,
            f"clip {clip.name!r} of {path.name}",
            names,
            clip.expression_weights[:, usual],
        )
    ]
    return Found(clips, [*judged, *notes])


def _other(avatar: Avatar, path: Path) -> Found:
    found = other_avatar.borrowed(avatar, path)
    return _judged(avatar, path, [found.clip], found.notes)


def _recorded(avatar: Avatar, path: Path) -> Found:
    return _driven(avatar, takes.read_take(path), path.stem)


def _driven(avatar: Avatar, take: DrivingTake, name: str) -> Found:
    clip = clip_from_poses(avatar, name, take.fps, drive.poses(avatar, take))
    return Found([clip], doubts.take_notes(avatar, take))


def _tracked(avatar: Avatar, path: Path) -> Found:
    if avatar.rig is None:
        raise AvatarError("poses a body model, but this avatar has no rig", file=path.name)
    return Found([body_clip(avatar.rig, read_poses(path), path.stem)], ())


def _asm(avatar: Avatar, path: Path) -> Found:
    """The takes of an ASM face on joints of the same names; deltas are relative to the face's own neutral."""
    face = load(path)
    own = avatar.rig.joint_names if avatar.rig is not None else ()
    at = {bone: row for row, bone in enumerate(face.template.bone_names)}
    if not set(own) & set(at):
        return Found((), ())
    return Found(
        [_on_joints(avatar, clip, [at.get(joint) for joint in own]) for clip in bake_clips(face)], ()
    )


def _on_joints(avatar: Avatar, clip: Clip, rows: Sequence[int | None]) -> Clip:
    """`clip` for `avatar`: joint k of the avatar is joint rows[k] of the clip, or stays at rest."""
    delta = np.tile(np.eye(4, dtype=np.float32), (clip.frames, len(rows), 1, 1))
    for joint, row in enumerate(rows):
        if row is not None:
            delta[:, joint] = clip.joint_delta[:, row]
    return replace(
        clip,
        expression_weights=np.zeros((clip.frames, len(avatar.expressions)), np.float32),
        late_weights=np.zeros((clip.frames, len(avatar.eyelids)), np.float32),
        joint_delta=delta,
    )


def _gltf(avatar: Avatar, path: Path) -> Found:
    """The animations; then, if ARKit names drive the avatar, the expressions of a LAM zip."""
    document, expressions = gltf_files.gltf_of(path), gltf_files.expressions_of(path)
    names = () if document is None else clip_names(document)
    clips = [
        gltf_files.clip_named(avatar, document, name)
        for name in names
        if document is not None and gltf_files.moves(avatar, document, name)
    ]
    found = _judged(avatar, path, clips)
    if expressions is None or avatar.driving.mode == "none":
        return found
    take = takes.take_of(expressions, gltf_files.EXPRESSIONS)
    driven = _driven(avatar, take, Path(gltf_files.EXPRESSIONS).stem)
    return Found([*found.clips, *driven.clips], [*found.notes, *driven.notes])


def _fbx(avatar: Avatar, path: Path) -> Found:
    file = open_fbx(path)
    moving = {unique_name(clip.name, ()): clip for clip in file.clips if fbx_clip.moves(clip)}
    clips = [
        fbx_clip.clip_of(avatar, file, clip, name)
        for name, clip in moving.items()
        if fbx_clip.concerns(avatar, file, clip)
    ]
    return _judged(avatar, path, clips)


SOURCES: tuple[_Source, ...] = (
    _Source(lambda path: other_avatar.parts_of(path) is not None, _other),
    _Source(gltf_files.holds_gltf, _gltf),
    _Source(lambda path: path.suffix.lower() == ".fbx", _fbx),
    _Source(is_face, _asm),
    _Source(takes.is_json_take, _recorded),
    _Source(is_pose_file, _tracked),
    _Source(lambda path: True, _recorded),
)
