"""Backend `reference`: the NumPy stages, which define the results."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from avatar_runtime.avatar import F32, F64, Avatar, Gaussians
from avatar_runtime.backends import Arrays
from avatar_runtime.camera import Camera
from avatar_runtime.light import SHADOW_SIZE, LightArrays, turned
from avatar_runtime.posed import Clock, Posed
from avatar_runtime.rules import RIGGED_ROTATIONS
from avatar_runtime.stages.activate import Splats, activate
from avatar_runtime.stages.bind import Bound, bind, bind_surface
from avatar_runtime.stages.blend import blend
from avatar_runtime.stages.groups import GroupTransforms
from avatar_runtime.stages.light import casting, light, shadow_map, turned_normals
from avatar_runtime.stages.morph import morph
from avatar_runtime.stages.project import TILE, Projected, project, touched_tiles
from avatar_runtime.stages.raster import PROFILES, Image, raster
from avatar_runtime.stages.skin import skin, vertex_matrices
from avatar_runtime.stages.sort import sort
from avatar_runtime.stages.surface import prepare


def make(avatar: Avatar) -> ReferenceBackend:
    """The reference for `avatar`; it has no options."""
    return ReferenceBackend(avatar)


class ReferenceBackend:
    """Plays one avatar on the NumPy stages."""

    profiles = PROFILES

    def __init__(self, avatar: Avatar) -> None:
        self.avatar = avatar
        e = avatar.embedding
        self._surface = None if e is None else prepare(e, avatar.rules, avatar.training_per_bundle)

    def mesh(self, posed: Posed, clock: Clock) -> F32:
        """Stages morph and skin of the rig."""
        rig = self.avatar.rig
        assert rig is not None
        vertices = clock.timed("morph", lambda: morph(rig, posed.expression_weights, posed.pose_feature))
        return clock.timed("skin", lambda: skin(rig, vertices, posed.skin_matrix, posed.late_weights))

    def animate(self, posed: Posed, clock: Clock) -> Splats:
        """Stages up to activate."""
        avatar = self.avatar
        blended = clock.timed(
            "blend", lambda: blend(avatar.gaussians, avatar.blendshapes, posed.expression_weights)
        )
        vertices = self._vertices(posed, clock)
        bound = clock.timed("bind", lambda: self._bind(blended, posed, vertices))
        return clock.timed("activate", lambda: activate(bound))

    def frame(self, posed: Posed, camera: Camera, background: F32, profile: str, clock: Clock) -> Image:
        """All stages."""
        return _drawn(self.seen(posed, camera, clock), camera, background, profile, clock)

    def draw(self, splats: Splats, camera: Camera, background: F32, profile: str, clock: Clock) -> Image:
        """Stages from `project` on."""
        return _drawn(self._projected(splats, camera, clock), camera, background, profile, clock)

    def seen(self, posed: Posed, camera: Camera, clock: Clock) -> Projected:
        """Stages up to project, or to light where there is one."""
        splats = self.animate(posed, clock)
        given, relight, shadow = posed.light, self.avatar.relight, None
        if given is None or relight is None:
            return self._projected(splats, camera, clock)
        avatar, world, vertices = self.avatar, posed.world_from_avatar, None
        if given.shadow_offset[2] or turned(avatar):
            skinned = self._surface is None and avatar.rig is not None
            vertices = self.mesh(posed, clock) if skinned else self._vertices(posed, clock)
        if given.shadow_offset[2]:
            mesh = casting(avatar, vertices, world)
            shadow = clock.timed("shadow", lambda: shadow_map(splats, given, mesh))
        projected = self._projected(splats, camera, clock)
        facing = clock.timed("light", lambda: self._facing(vertices, world))
        return clock.timed("light", lambda: light(projected, splats, relight, given, shadow, facing))

    def _facing(self, vertices: F32 | None, world_from_avatar: F64) -> F32 | None:
        """Normals where the mesh turns them."""
        avatar, surface = self.avatar, self._surface
        if surface is None or vertices is None or avatar.relight is None or not turned(avatar):
            return None
        return turned_normals(surface, avatar.relight, vertices, world_from_avatar)

    def _projected(self, splats: Splats, camera: Camera, clock: Clock) -> Projected:
        avatar = self.avatar
        return clock.timed("project", lambda: project(splats, camera, avatar.raster, avatar.sh_degree))

    def release(self) -> None:
        """Nothing: arrays go with the backend."""

    def stage(self, name: str, inputs: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
        """One stage alone."""
        return RUN[name](self, inputs, camera, profile)

    def _vertices(self, posed: Posed, clock: Clock) -> F32 | None:
        if self._surface is None:
            return None
        if posed.vertices is not None:
            return posed.vertices
        if self.avatar.rig is not None:
            return self.mesh(posed, clock)
        return self._surface.embedding.canonical_vertices

    def _bind(self, blended: Gaussians, posed: Posed, vertices: F32 | None) -> Bound:
        if self._surface is not None:
            assert vertices is not None
            matrix: F32 | None = None
            if self.avatar.rig is not None and self.avatar.rules.rotation in RIGGED_ROTATIONS:
                matrix = vertex_matrices(self.avatar.rig, posed.skin_matrix)
            return bind_surface(self._surface, blended, vertices, posed.world_from_avatar, matrix)
        return bind(
            self.avatar,
            blended,
            posed.skin_matrix,
            posed.pose_feature,
            posed.late_weights,
            posed.groups,
            posed.world_from_avatar,
        )


def _drawn(projected: Projected, camera: Camera, background: F32, profile: str, clock: Clock) -> Image:
    """Stages sort and raster."""
    order = clock.timed("sort", lambda: sort(projected))
    return clock.timed("raster", lambda: raster(projected, order, camera, background, profile))


def _morph(backend: ReferenceBackend, x: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
    rig = backend.avatar.rig
    assert rig is not None
    return {"vertices": morph(rig, x["expression_weights"], x["pose_feature"])}


def _skin(backend: ReferenceBackend, x: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
    rig = backend.avatar.rig
    assert rig is not None
    return {"posed_vertices": skin(rig, x["vertices"], x["skin_matrix"], x["late_weights"])}


def _blend(backend: ReferenceBackend, x: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
    avatar = backend.avatar
    g = blend(avatar.gaussians, avatar.blendshapes, x["expression_weights"])
    return {name: getattr(g, name) for name in ("mean", "log_scale", "quat_wxyz", "opacity_logit", "sh")}


def _bind_stage(backend: ReferenceBackend, x: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
    own = backend.avatar.gaussians
    blended = Gaussians(x["mean"], x["log_scale"], x["quat_wxyz"], own.opacity_logit, own.sh)
    none = np.zeros(0, np.float32)
    posed = Posed(
        none,
        x.get("late_weights", none),
        x.get("pose_feature", none),
        x.get("skin_matrix", none.reshape(0, 4, 4)),
        GroupTransforms(x["group_matrix"], x["group_rotation"]),
        x["world_from_avatar"],
    )
    bound = backend._bind(blended, posed, x.get("posed_vertices"))
    g = bound.gaussians
    return {
        "mean": g.mean,
        "log_scale": g.log_scale,
        "quat_wxyz": g.quat_wxyz,
        "sh_rotation": bound.rotation,
    }


def _activate(backend: ReferenceBackend, x: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
    own = backend.avatar.gaussians
    still = np.zeros((own.count, 3), np.float32)
    g = Gaussians(still, x["log_scale"], x["quat_wxyz"], x["opacity_logit"], own.sh)
    splats = activate(Bound(g, np.zeros((own.count, 3, 3), np.float32)))
    return {"scale": splats.scale, "quat_wxyz": splats.quat_wxyz, "opacity": splats.opacity}


def _project(backend: ReferenceBackend, x: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
    assert camera is not None
    seen = project(Splats.of(x), camera, backend.avatar.raster, backend.avatar.sh_degree)
    return {name: getattr(seen, name) for name in ("centre", "depth", "conic", "opacity", "rgb", "radius")}


def _sort(backend: ReferenceBackend, x: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
    n = len(x["depth"])
    blank = np.zeros((n, 3), np.float32)
    projected = Projected(
        blank, x["depth"], blank, blank[:, 0], blank, x["radius"], blank, np.zeros((n, 4), np.int32)
    )
    return {"order": sort(projected)}


def _raster(backend: ReferenceBackend, x: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
    assert camera is not None
    radius = x["radius"]
    tiles = touched_tiles(x["centre"], radius.astype(np.float32)[:, None], camera, TILE)
    tiles[radius == 0] = 0
    none = np.zeros(len(radius), np.float32)
    seen = Projected(x["centre"], none, x["conic"], x["opacity"], x["rgb"], radius, none, tiles)
    image = raster(seen, x["order"], camera, x["background"], profile)
    return {"colour": image.colour, "transmittance": image.transmittance}


def _shadow(backend: ReferenceBackend, x: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
    splats = Splats(x["mean"], x["scale"], x["quat_wxyz"], x["opacity"], np.zeros((0, 0, 3), np.float32))
    mesh = casting(backend.avatar, x.get("posed_vertices"), x["world_from_avatar"])
    return {"shadow": shadow_map(splats, LightArrays.of(x), mesh).ravel()}


def _light(backend: ReferenceBackend, x: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
    relight = backend.avatar.relight
    assert relight is not None
    shadow = x["shadow"].reshape(SHADOW_SIZE, SHADOW_SIZE) if "shadow" in x else None
    none = np.zeros(0, np.float32)
    seen = Projected(none, none, none, none, x["rgb"], x["radius"], none, np.zeros((0, 4), np.int32))
    splats = Splats(x["mean"], none, x["quat_wxyz"], none, none)
    facing = backend._facing(x["posed_vertices"], x["world_from_avatar"]) if turned(backend.avatar) else None
    return {"rgb": light(seen, splats, relight, LightArrays.of(x), shadow, facing).rgb}


Run = Callable[[ReferenceBackend, Arrays, "Camera | None", str], dict[str, Any]]
RUN: dict[str, Run] = {
    "morph": _morph,
    "skin": _skin,
    "blend": _blend,
    "bind": _bind_stage,
    "activate": _activate,
    "shadow": _shadow,
    "project": _project,
    "light": _light,
    "sort": _sort,
    "raster": _raster,
}
