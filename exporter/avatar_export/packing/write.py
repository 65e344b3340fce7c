"""Makes a pack: integers, program, document, file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import avatar_shaders
from avatar_export.ops.bounds import bounds_of_levels
from avatar_export.packing.quantise import quantised
from avatar_export.packing.steps import CLIP_STEPS, Fineness
from avatar_export.version import GENERATOR
from avatar_runtime.avatar import Avatar
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.codec import manifest as codec
from avatar_runtime.codec.pack import PackFile, encode
from avatar_runtime.driving.linear_map import linear_map
from avatar_runtime.handedness import mirrored, mirrored_boxes
from avatar_runtime.packs import RIG_ARRAYS, clip_arrays, placed, with_program
from avatar_runtime.program.bake import bake_levels
from avatar_runtime.program.codes import Coded
from avatar_runtime.program.model import Program

FORMAT = "avatar-pack"


@dataclass(frozen=True)
class Packing:
    """What one way to pack an avatar gives."""

    avatar: Avatar  # as the pack plays it, finest level
    file: bytes
    sizes: Mapping[str, int]  # tensor -> deflated bytes; "document": the JSON


@dataclass(frozen=True)
class Prepared:
    """An avatar at its levels as integers, and the program that plays them; not yet a file."""

    levels: tuple[Avatar, ...]  # as the pack plays them
    program: Program
    exact: bool


def pack(
    levels: Sequence[Avatar],
    fine: Fineness | None,
    facts: Mapping[str, Any] | None = None,
    preview: bytes | None = None,
) -> Packing:
    """`write` of `prepare`."""
    return write(prepare(levels, fine), facts, preview)


def driving_facts(avatar: Avatar) -> dict[str, Any]:
    """What a document says of how ARKit drives `avatar`, which stands in the pack's frame; nothing where none does."""
    if avatar.driving.mode == "none":
        return {}
    linear = linear_map(avatar)
    matrix = [[float(value) for value in row] for row in linear.matrix]
    return {"driving": {"inputs": list(linear.inputs), "outputs": list(linear.outputs), "matrix": matrix}}


def prepare(levels: Sequence[Avatar], fine: Fineness | None) -> Prepared:
    """An avatar at its levels, finest first; `fine` None keeps float32 throughout.

    Raises AvatarError for an avatar that is not sound, or has a part that no buffer can hold.
    """
    for avatar in levels:
        check_avatar(avatar)
    coded: list[tuple[Avatar, Coded]] = [
        (avatar, {}) if fine is None else quantised(avatar, fine) for avatar in levels
    ]
    coded = [coded[0], *(_sharing(coded[0], level) for level in coded[1:])]
    program = bake_levels(coded)
    decoded = [level for level, _ in coded]

    def at(level: int) -> Avatar:
        return with_program(decoded[level], program, level, at)

    return Prepared(tuple(at(level) for level in range(len(levels))), program, fine is None)


def write(
    prepared: Prepared,
    facts: Mapping[str, Any] | None = None,
    preview: bytes | None = None,
    handedness: str = "right",
) -> Packing:
    """The file of `prepared`. `facts` are further keys of the document; `handedness` is the frame of its avatar."""
    first = prepared.levels[0]
    steps = None if prepared.exact else CLIP_STEPS
    arrays = {f"rig.{name}": getattr(first.rig, name) for name in RIG_ARRAYS} if first.rig else {}
    if first.rig is not None and first.embedding is None:
        arrays["rig.triangles"] = np.ascontiguousarray(first.rig.triangles.T)
    if preview is not None:
        arrays["preview"] = np.frombuffer(preview, np.uint8)
    order = tuple(arrays)
    arrays |= clip_arrays(first.clips, steps)
    document = merged(document_of(first, prepared.levels, handedness), facts or {})
    file, sizes = encode(PackFile(document, prepared.program, arrays), order)
    return Packing(first, file, sizes)


def merged(document: Mapping[str, Any], facts: Mapping[str, Any]) -> dict[str, Any]:
    """`document` with `facts`; facts of levels join each level's own."""
    levels = [{**own, **more} for own, more in zip(document["levels"], facts.get("levels", []), strict=False)]
    return {**document, **facts, "levels": levels or document["levels"]}


def _sharing(finest: tuple[Avatar, Coded], level: tuple[Avatar, Coded]) -> tuple[Avatar, Coded]:
    """A level that uses the finest one's rig and mesh."""
    avatar, coded = level
    shared = {path: codes for path, codes in finest[1].items() if path.startswith("rig.")}
    avatar = replace(avatar, rig=finest[0].rig, clips=finest[0].clips)
    if avatar.embedding is not None and finest[0].embedding is not None:
        mesh = finest[0].embedding.canonical_vertices
        avatar = replace(avatar, embedding=replace(avatar.embedding, canonical_vertices=mesh))
    return avatar, {**coded, **shared}


def document_of(avatar: Avatar, levels: Sequence[Avatar], handedness: str) -> dict[str, Any]:
    """The document of a pack but for its program and arrays."""
    boxes = bounds_of_levels([placed(mirrored(one) if handedness == "left" else one) for one in levels])
    boxes = mirrored_boxes(boxes) if handedness == "left" else boxes
    manifest = codec.encode(avatar, [], boxes, GENERATOR, handedness=handedness)
    for unneeded in ("files", "engine", "reference", "enhancer"):
        manifest.pop(unneeded, None)
    return {
        "format": FORMAT,
        "asset": manifest.pop("asset"),
        "shaders": avatar_shaders.VERSION,
        "avatar": manifest,
        "levels": [
            {"count": level.gaussians.count, "groups": [_group(group) for group in level.groups]}
            for level in levels
        ],
    }


def _group(group: Any) -> dict[str, Any]:
    entry = {"name": group.name, "first": group.first, "count": group.count, "binding": group.binding}
    return entry | ({"joint_mix": dict(group.joint_mix)} if group.joint_mix else {})
