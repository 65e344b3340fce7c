"""The buffers and passes of one level's Gaussians: stages blend, bind, activate and project."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from avatar_runtime.avatar import Avatar, Group, Relight
from avatar_runtime.light import MOST_LIGHTS, turned
from avatar_runtime.program.chunks import Cost, runs
from avatar_runtime.program.codes import Coded, Codes
from avatar_runtime.program.fields import APPEARANCE, BASE, CORRECTIVE, EMBEDDED, GEOMETRY, LATE, LIT, SKIN
from avatar_runtime.program.model import WORD, Buffer, Constant, Level, Pass, Run
from avatar_runtime.program.passes import make_pass
from avatar_runtime.program.sections import Building, Pick, part, sparse
from avatar_runtime.rules import code
from avatar_schema import constants

SHADOW_TEXELS = int(constants()["shadow_size"]) ** 2
SHADOW_ROWS = {f"shadow_row{k}": f"shadow_row{k}" for k in range(4)}
SPLAT_PLANES, PROJECTED_PLANES = 5, 3  # of float4
FLOAT4 = 16
WORLD = {name: name for name in ("world_row0", "world_row1", "world_row2", "world_quat_wxyz")}
CAMERA = {
    name: name
    for name in (
        *(f"camera_row{i}" for i in range(3)),
        *(f"clip_row{i}" for i in range(4)),
        *("eye", "tan_half_fov", "image_size"),
    )
}
SPARSE_PARTS = {
    "geometry": ("blendshapes.geometry", GEOMETRY),
    "appearance": ("blendshapes.appearance", APPEARANCE),
    "corrective": ("blendshapes.correctives", CORRECTIVE),
    "late": ("blendshapes.late_morphs", LATE),
    "skin": ("skin", SKIN),
}


def bake_level(
    avatar: Avatar,
    coded: Coded,
    prefix: str,
    turns: tuple[Pass, ...],
    casting: tuple[Pass, ...],
    pose: Mapping[str, int],
    limit: int,
    buffers: dict[str, Buffer],
) -> Level:
    """The level of `avatar`; its buffers join `buffers`. `turns` are the passes that turn the mesh under it, `casting`
    those by which the rig casts shadows.
    """
    chunks = gaussian_runs(avatar, coded, limit)
    made = [_Chunk(avatar, coded, prefix, index, run, pose) for index, run in enumerate(chunks)]
    for chunk in made:
        buffers.update({buffer.name: buffer for buffer in chunk.buffers})
    deform = [chunk.blend for chunk in made]
    deform += turns
    deform += [one for chunk in made for one in chunk.bind]
    deform += [chunk.activate for chunk in made]
    shadow: list[Pass] = []
    if avatar.relight is not None:
        buffers["Shadow"] = Buffer("Shadow", WORD * SHADOW_TEXELS)
        shadow = [make_pass("shadow_clear", SHADOW_TEXELS, {"Shadow": "Shadow"}, {"texels": SHADOW_TEXELS})]
        shadow += casting
        shadow += [chunk.shadow for chunk in made]
    light = tuple(one for chunk in made for one in chunk.light)
    return Level(prefix, chunks, tuple(deform), tuple(c.project for c in made), tuple(shadow), light)


def splat_planes(avatar: Avatar) -> int:
    """Planes of buffer Splats: the last one holds normals that the mesh turns."""
    return SPLAT_PLANES + (avatar.relight is not None and turned(avatar))


def gaussian_runs(avatar: Avatar, coded: Coded, limit: int) -> tuple[Run, ...]:
    """Chunks of Gaussians, in which every buffer with one row per Gaussian is within `limit`."""
    sh = 3 * avatar.gaussians.sh.shape[1]
    costs = [Cost(FLOAT4 * splat_planes(avatar)), Cost(WORD * sh), Cost(FLOAT4 * PROJECTED_PLANES)]
    costs.append(_cost(avatar, coded, BASE, ("geometry", "appearance")))
    if avatar.embedding is None:
        costs.append(_cost(avatar, coded, {}, ("corrective", "late", "skin")))
    else:
        costs.append(_cost(avatar, coded, EMBEDDED, (), WORD))
    if avatar.relight is not None:
        costs.append(_cost(avatar, coded, LIT, ()))
    return runs("Gaussian", avatar.gaussians.count, costs, limit)


def _cost(
    avatar: Avatar, coded: Coded, dense: Mapping[str, tuple[str, str]], parts: Sequence[str], row: int = 0
) -> Cost:
    """What `dense` sections and sparse `parts` take, each section rounded up to a word."""
    fixed, entries = 0, []
    for path, _ in dense.values():
        values = array_of(avatar, path)
        codes = coded.get(path)
        row += int(np.prod(values.shape[1:], dtype=np.int64)) * _bytes(codes)
        fixed += WORD * (codes is not None) + (0 if codes is None else codes.scale.nbytes)
    for name in parts:
        path, kinds = SPARSE_PARTS[name]
        rows, size = array_of(avatar, path), 1 if array_of(avatar, path).columns <= 256 else 2
        fixed += 2 * WORD
        row += WORD
        for attribute in kinds:
            codes = coded.get(f"{path}.{attribute}")
            size += int(np.prod(rows.values[attribute].shape[1:], dtype=np.int64)) * _bytes(codes)
            fixed += WORD * (codes is not None) + (0 if codes is None else codes.scale.nbytes)
        entries.append((rows.row_ptr, size))
    return Cost(row, fixed, tuple(entries))


def _bytes(codes: Codes | None) -> int:
    return WORD if codes is None else codes.width // 8


def array_of(avatar: Avatar, path: str) -> Any:
    """The attribute of `avatar` at a path with dots."""
    found: Any = avatar
    for name in path.split("."):
        found = getattr(found, name)
    return found


class _Chunk:
    """A run of Gaussians: its buffers, and the kernels that go over it."""

    def __init__(
        self,
        avatar: Avatar,
        coded: Coded,
        prefix: str,
        index: int,
        run: Run,
        pose: Mapping[str, int],
    ) -> None:
        self.avatar, self.coded, self.run, self.pose = avatar, coded, run, pose
        self._prefix, self._index = prefix, index
        terms, names = avatar.gaussians.sh.shape[1], ("Splats", "Sh", "Projected")
        self.bound = {"Pose": "Pose", **{kind: self.name(kind) for kind in names}}
        planes = splat_planes(avatar)
        sizes = (FLOAT4 * planes, WORD * 3 * terms, FLOAT4 * PROJECTED_PLANES)
        self.buffers = [Buffer(self.name(k), size * run.count) for k, size in zip(names, sizes, strict=True)]
        self.blend = self._blend(terms)
        self.bind = self._skinned() if avatar.embedding is None else (self._embedded(),)
        self.activate = self._pass("activate", {})
        self.project = self._pass(
            "project",
            {
                "sh_degree": avatar.sh_degree,
                "near_z": float(np.float32(avatar.raster.near)),
                "low_pass": float(np.float32(avatar.raster.low_pass)),
                **CAMERA,
            },
        )

        self.shadow = self._pass("shadow", SHADOW_ROWS)
        self.light = () if avatar.relight is None else self._light(avatar.relight)

    def name(self, kind: str) -> str:
        """The chunk's buffer of one kind."""
        return f"{self._prefix}{kind}.{self._index}"

    def _pass(
        self,
        entry: str,
        values: Mapping[str, Constant],
        static: Mapping[str, str] | None = None,
        rows: int | None = None,
    ) -> Pass:
        shared = {name: name for name in ("Mesh", "Triangles", "Shadow")}
        bound = {**self.bound, **(static or {}), **shared}
        count = self.run.count
        return make_pass(entry, count if rows is None else rows, bound, {"count": count, **values})

    def _take(self, building: Building, kind: str) -> tuple[dict[str, str], dict[str, Constant]]:
        buffer, values = building.done()
        self.buffers.append(buffer)
        return {kind: buffer.name}, values

    def _dense(self, into: Building, fields: Mapping[str, tuple[str, str]]) -> None:
        rows = slice(self.run.first, self.run.first + self.run.count)
        for section, (path, kind) in fields.items():
            values, codes = array_of(self.avatar, path)[rows], self.coded.get(path)
            count = int(np.prod(values.shape[1:], dtype=np.int64))
            into.coded(
                section,
                kind,
                values.reshape(len(values), count),
                None if codes is None else part(codes, rows),
                by_plane=True,
            )

    def _sparse(self, into: Building, name: str) -> None:
        path, kinds = SPARSE_PARTS[name]
        sparse(into, name, array_of(self.avatar, path), kinds, self.run, picked(self.coded, path))

    def _blend(self, terms: int) -> Pass:
        building = Building(self.name("BlendStatic"))
        self._dense(building, BASE)
        for name in ("geometry", "appearance"):
            self._sparse(building, name)
        static, values = self._take(building, "BlendStatic")
        own = {"sh_terms": terms, "weights": self.pose["weights"]}
        return self._pass("blend", {**own, **values}, static)

    def _light(self, relight: Relight) -> tuple[Pass, ...]:
        building = Building(self.name("LightStatic"))
        self._dense(building, LIT)
        static, values = self._take(building, "LightStatic")
        own: dict[str, Constant] = {
            "turned": int(turned(self.avatar)),
            "shadow_offset": "shadow_offset",
            **{f"turn_row{k}": f"light_turn_row{k}" for k in range(3)},
            **{f"capture_ambient{k}": (*map(float, row), 0.0) for k, row in enumerate(relight.ambient)},
            **{f"scene_ambient{k}": f"light_ambient{k}" for k in range(len(relight.ambient))},
            **{f"{what}{k}": f"light_{what}{k}" for what in ("place", "colour") for k in range(MOST_LIGHTS)},
            **SHADOW_ROWS,
        }
        lit = self._pass("light", {**own, **values}, static)
        if not turned(self.avatar):
            return (lit,)
        bound = {"EmbedStatic": self.name("EmbedStatic"), **static}
        return self._pass("light_normals", {**self.bind[0].constants, **values}, bound), lit

    def _embedded(self) -> Pass:
        avatar, e = self.avatar, self.avatar.embedding
        assert e is not None
        building = Building(self.name("EmbedStatic"))
        rows = slice(self.run.first, self.run.first + self.run.count)
        building.indices("triangle_ids", e.triangle[rows], len(e.triangles), "planes")
        self._dense(building, EMBEDDED)
        static, values = self._take(building, "EmbedStatic")
        unit, rules = avatar.training_per_bundle, avatar.rules
        own: dict[str, Constant] = {
            "vertices": len(e.canonical_vertices),
            "triangles": len(e.triangles),
            "position_rule": code("position", rules.position),
            "rotation_rule": code("rotation", rules.rotation),
            "scale_rule": code("scale", rules.scale),
            "sh_direction": code("sh_direction", rules.sh_direction),
            "area_damping": float(np.float32(constants()["area_damping"] / unit**2)),
            "log_training_per_bundle": float(np.float32(np.log(unit))),
            **WORLD,
        }
        return self._pass("bind_surface", {**own, **values}, static)

    def _skinned(self) -> tuple[Pass, ...]:
        """Kernel bind_skin, once for each group that has rows in the chunk."""
        rules, building = self.avatar.rules, Building(self.name("BindStatic"))
        for name in ("corrective", "late", "skin"):
            self._sparse(building, name)
        static, values = self._take(building, "BindStatic")
        made = []
        for index, group in enumerate(self.avatar.groups):
            first, rows = overlap(group, self.run)
            if rows == 0:
                continue
            own: dict[str, Constant] = {
                "first": first,
                "rows": rows,
                "features": self.pose["features"],
                "late": self.pose["late"],
                "joints": self.pose["joints"],
                "binding_rule": code("binding", group.binding),
                "rotation_rule": code("rotation", rules.rotation),
                "sh_direction": code("sh_direction", rules.sh_direction),
                **{
                    f"group_{what}_row{i}": f"group_{what}_row{i}[{index}]"
                    for what in ("matrix", "rotation")
                    for i in range(3)
                },
                **WORLD,
            }
            made.append(self._pass("bind_skin", {**own, **values}, static, rows))
        return tuple(made)


def picked(coded: Coded, path: str) -> Pick:
    """The codes of each attribute of the sparse rows at a path."""
    return lambda attribute: coded.get(f"{path}.{attribute}")


def overlap(group: Group, run: Run) -> tuple[int, int]:
    """(first, count) of a group's rows inside a chunk, counted from the chunk's first."""
    first = max(group.first, run.first)
    end = min(group.first + group.count, run.first + run.count)
    return first - run.first, max(end - first, 0)
