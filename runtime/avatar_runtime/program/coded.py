"""The integers in a program by the arrays that they stand for, and some rows of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from avatar_runtime.avatar import I64, Avatar, SparseRows
from avatar_runtime.program.codes import Coded, Codes
from avatar_runtime.program.fields import BASE, EMBEDDED, LIT, MORPH, SKIN, VERTEX_CORRECTIVE, VERTEX_LATE
from avatar_runtime.program.gaussians import SPARSE_PARTS, array_of
from avatar_runtime.program.model import Array, Program
from avatar_runtime.program.sections import Source

MESH_PARTS = {  # entry of a pass -> (its static buffer, {sparse part: (path, kinds)})
    "morph": (
        "MorphStatic",
        {"morph": ("rig.morphs", MORPH), "corrective": ("rig.correctives", VERTEX_CORRECTIVE)},
    ),
    "skin": ("SkinStatic", {"late": ("rig.late_morphs", VERTEX_LATE), "skin": ("rig.skin", SKIN)}),
}


def coded_of(program: Program, level: int, avatar: Avatar) -> Coded:
    """The codes of every array of `avatar`, which plays `level` of `program`; arrays kept as float32 have none."""
    own = program.levels[level]
    rows = [run.count for run in own.chunks]
    found: dict[str, Codes] = {}

    def chunks(kind: str) -> list[Source]:
        return [Source(program.buffers[name], program.constants_of(name)) for name in own.names(kind)]

    _dense(found, chunks("BlendStatic"), rows, BASE, avatar)
    parts = ["geometry", "appearance"]
    _sparse(found, chunks("BlendStatic"), {name: SPARSE_PARTS[name] for name in parts}, avatar)
    if own.light:
        _dense(found, chunks("LightStatic"), rows, LIT, avatar)
    if program.reads_mesh:
        _dense(found, chunks("EmbedStatic"), rows, EMBEDDED, avatar)
        surface = [Source(program.buffers["SurfaceStatic"], program.constants_of("SurfaceStatic"))]
        assert avatar.embedding is not None
        vertices = [len(avatar.embedding.canonical_vertices)]
        _dense(found, surface, vertices, {"canonical": ("embedding.canonical_vertices", "linear")}, avatar)
    else:
        parts = ["corrective", "late", "skin"]
        _sparse(found, chunks("BindStatic"), {name: SPARSE_PARTS[name] for name in parts}, avatar)
    if avatar.rig is not None:
        _mesh(found, program, avatar)
    return found


def _mesh(found: dict[str, Codes], program: Program, avatar: Avatar) -> None:
    for entry, (kind, parts) in MESH_PARTS.items():
        passes = [one for one in program.mesh if one.entry == entry]
        names = [one.buffers[kind] for one in passes]
        sources = [Source(program.buffers[name], program.constants_of(name)) for name in names]
        _sparse(found, sources, parts, avatar)
        if entry == "morph":
            rows = [one.count("count") for one in passes]
            _dense(found, sources, rows, {"template_position": ("rig.vertices", "linear")}, avatar)


def _dense(
    found: dict[str, Codes],
    sources: Sequence[Source],
    rows: Sequence[int],
    fields: Mapping[str, tuple[str, str]],
    avatar: Avatar,
) -> None:
    for section, (path, kind) in fields.items():
        channels = int(np.prod(array_of(avatar, path).shape[1:], dtype=np.int64))
        if not len(array_of(avatar, path)):  # the rule of the avatar reads another array
            found[path] = Codes(kind, None, np.zeros((channels, 2), np.float32))
            continue
        parts = []
        for source, count in zip(sources, rows, strict=True):
            one = source.codes(section, kind, count, channels, 0)
            if one is not None and one.codes is not None:
                one = replace(one, codes=one.codes.reshape(channels, count).T)
            parts.append(one)
        _keep(found, path, parts)


def _sparse(
    found: dict[str, Codes],
    sources: Sequence[Source],
    parts: Mapping[str, tuple[str, Mapping[str, tuple[str, str]]]],
    avatar: Avatar,
) -> None:
    for name, (path, kinds) in parts.items():
        rows: SparseRows = array_of(avatar, path)
        for attribute, (section, kind) in kinds.items():
            channels = int(np.prod(rows.values[attribute].shape[1:], dtype=np.int64))
            entries = [len(source.section(f"{name}_column")) for source in sources]
            coded = [
                source.codes(section, kind, count, channels, rows.columns)
                for source, count in zip(sources, entries, strict=True)
            ]
            _keep(found, f"{path}.{attribute}", coded)


def _keep(found: dict[str, Codes], path: str, parts: Sequence[Codes | None]) -> None:
    kept = [one for one in parts if one is not None]
    if not kept:
        return
    stored = [one.codes for one in kept if one.codes is not None]
    found[path] = replace(kept[0], codes=np.concatenate(stored) if stored else None)


def taken(coded: Coded, avatar: Avatar, rows: I64, vertices: I64) -> Coded:
    """The codes of the Gaussians `rows` and the mesh's `vertices` of `avatar`."""
    found: dict[str, Codes] = {}
    for path, codes in coded.items():
        of = vertices if path.startswith("rig.") or path == "embedding.canonical_vertices" else rows
        owner, _, attribute = path.rpartition(".")
        holder = array_of(avatar, owner)
        if codes.codes is None:
            found[path] = codes
        elif isinstance(holder, SparseRows):
            values: dict[str, Array] = {attribute: codes.codes}
            part = SparseRows(holder.row_ptr, holder.column, values, holder.columns).take(of)
            found[path] = replace(codes, codes=part.values[attribute])
        else:
            found[path] = replace(codes, codes=codes.codes[of])
    return found
