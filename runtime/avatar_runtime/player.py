"""Plays an avatar: pose and camera in, picture out, every stage timed."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, Avatar, Rig, SparseRows
from avatar_runtime.camera import Camera
from avatar_runtime.errors import AvatarError
from avatar_runtime.pose import Pose, PoseArrays, resolve
from avatar_runtime.stages.activate import Splats, activate
from avatar_runtime.stages.bind import bind, bind_surface
from avatar_runtime.stages.blend import blend
from avatar_runtime.stages.joints import Joints, joints
from avatar_runtime.stages.morph import morph
from avatar_runtime.stages.project import project
from avatar_runtime.stages.raster import Picture, raster
from avatar_runtime.stages.skin import skin
from avatar_runtime.stages.sort import sort
from avatar_runtime.stages.surface import prepare

T = TypeVar("T")
# Absurd numbers become infinite, and what is infinite is not drawn: no news for standard error.
ABSURD = np.errstate(over="ignore", invalid="ignore")


@dataclass(frozen=True)
class Frame:
    """One played frame."""

    picture: Picture
    splats: Splats
    milliseconds: Mapping[str, float]  # by stage, wall time

    def rgba8(self) -> npt.NDArray[np.uint8]:
        """[H, W, 4] straight alpha over nothing; the picture must have been drawn over black."""
        alpha = 1 - self.picture.transmittance
        colour = np.divide(
            self.picture.colour,
            alpha[..., None],
            where=alpha[..., None] > 0,
            out=np.zeros_like(self.picture.colour),
        )
        return _bytes(np.concatenate([colour, alpha[..., None]], axis=-1))

    def rgb8(self) -> npt.NDArray[np.uint8]:
        """[H, W, 3] display-referred bytes."""
        return _bytes(self.picture.colour)


class Player:
    """Plays one avatar on the NumPy reference stages."""

    def __init__(self, avatar: Avatar) -> None:
        self.avatar = avatar
        self._anchors = _anchor_rig(avatar)
        e = avatar.embedding
        self._surface = None if e is None else prepare(e, avatar.rules, avatar.training_per_bundle)

    @ABSURD
    def animate(
        self,
        pose: Pose,
        milliseconds: dict[str, float] | None = None,
        *,
        posed_vertices: npt.NDArray[Any] | None = None,
    ) -> Splats:
        """Posed, activated Gaussians in world space. Raises AvatarError for a name the avatar lacks.

        `posed_vertices` [V, 3] (mesh space, bundle units; for binding `surface` only) stand in place of what the
        rig makes of the pose; without a rig and without them the mesh is the canonical one.
        Raises ValueError for posed_vertices of another shape, or where nothing is bound to a surface.
        """
        timed = _timer(milliseconds)
        avatar, arrays = self.avatar, resolve(pose, self.avatar)
        if posed_vertices is not None:
            posed_vertices = _mesh_vertices(avatar, posed_vertices)
        state: Joints | None = None
        anchors: F32 | None = None
        if avatar.rig is not None:
            rig = avatar.rig
            state = timed("joints", lambda: joints(rig, arrays))
        if self._anchors is not None and state is not None:
            anchors = self._anchor_vertices(self._anchors, arrays, state, timed)
        blended = timed(
            "blend", lambda: blend(avatar.gaussians, avatar.blendshapes, arrays.expression_weights)
        )
        surface = self._surface
        if surface is not None:
            vertices = posed_vertices
            if vertices is None and avatar.rig is not None and state is not None:
                vertices = _posed(avatar.rig, arrays, state, timed)
            if vertices is None:
                vertices = surface.embedding.canonical_vertices
            bound = timed("bind", lambda: bind_surface(surface, blended, vertices, arrays.world_from_avatar))
        else:
            late, world = arrays.late_weights, arrays.world_from_avatar
            bound = timed("bind", lambda: bind(avatar, blended, state, late, anchors, world))
        return timed("activate", lambda: activate(bound))

    @ABSURD
    def frame(
        self,
        pose: Pose,
        camera: Camera,
        background: tuple[float, float, float] | None = None,
        profile: str = "trainer",
        *,
        posed_vertices: npt.NDArray[Any] | None = None,
    ) -> Frame:
        """A picture of `pose` seen by `camera`; `background` defaults to the trainer's, or black.

        `posed_vertices` as in `animate`.
        """
        milliseconds: dict[str, float] = {}
        timed = _timer(milliseconds)
        splats = self.animate(pose, milliseconds, posed_vertices=posed_vertices)
        settings = self.avatar.raster
        if background is None:
            background = (0.0, 0.0, 0.0) if isinstance(settings.background, str) else settings.background
        colour = np.array(background, np.float32)
        projected = timed("project", lambda: project(splats, camera, settings, self.avatar.sh_degree))
        order = timed("sort", lambda: sort(projected))
        picture = timed("raster", lambda: raster(projected, order, camera, colour, profile))
        return Frame(picture, splats, milliseconds)

    @ABSURD
    def mesh(self, pose: Pose) -> F32:
        """Posed vertices [V, 3] of the whole rig, mesh space. Raises AvatarError without a rig."""
        rig = self.avatar.rig
        if rig is None:
            raise AvatarError("this avatar has no rig, so there is no mesh to pose", field="rig")
        arrays = resolve(pose, self.avatar)
        state = joints(rig, arrays)
        return _posed(rig, arrays, state, _timer(None))

    def _anchor_vertices(
        self,
        anchors: tuple[Rig, npt.NDArray[Any]],
        arrays: PoseArrays,
        state: Joints,
        timed: Callable[..., Any],
    ) -> F32:
        rig, repeats = anchors
        vertices = _posed(rig, arrays, state, timed)
        result: F32 = vertices[repeats]
        return result


def _mesh_vertices(avatar: Avatar, vertices: npt.NDArray[Any]) -> F32:
    if avatar.embedding is None:
        raise ValueError("posed_vertices go with Gaussians that are bound to a surface; this avatar has none")
    want = avatar.embedding.canonical_vertices.shape
    if np.shape(vertices) != want:
        raise ValueError(f"posed_vertices are {np.shape(vertices)}, the embedding's mesh has {want}")
    return np.asarray(vertices, np.float32)


def _posed(rig: Rig, arrays: PoseArrays, state: Joints, timed: Callable[..., Any]) -> F32:
    vertices = timed("morph", lambda: morph(rig, arrays.expression_weights, state.pose_feature))
    posed: F32 = timed("skin", lambda: skin(rig, vertices, state.skin_matrix, arrays.late_weights))
    return posed


def _anchor_rig(avatar: Avatar) -> tuple[Rig, npt.NDArray[Any]] | None:
    """The rig's anchor vertices alone, and their order with repeats; None where no group needs them."""
    rig = avatar.rig
    if rig is None or all(group.binding != "anchor" for group in avatar.groups):
        return None
    unique, repeats = np.unique(rig.anchor_vertices, return_inverse=True)
    part = replace(
        rig,
        vertices=rig.vertices[unique],
        morphs=take_rows(rig.morphs, unique),
        correctives=take_rows(rig.correctives, unique),
        late_morphs=take_rows(rig.late_morphs, unique),
        skin=take_rows(rig.skin, unique),
    )
    return part, repeats


def take_rows(sparse: SparseRows, rows: npt.NDArray[Any]) -> SparseRows:
    """The rows named by `rows`, in that order."""
    begin = sparse.row_ptr[rows].astype(np.int64)
    count = sparse.row_ptr[rows + 1].astype(np.int64) - begin
    ptr = np.concatenate([[0], np.cumsum(count)])
    entry = np.arange(ptr[-1]) + np.repeat(begin - ptr[:-1], count)
    values = {name: value[entry] for name, value in sparse.values.items()}
    return SparseRows(ptr.astype(np.uint32), sparse.column[entry], values, sparse.columns)


def _timer(milliseconds: dict[str, float] | None) -> Callable[[str, Callable[[], T]], T]:
    def timed(stage: str, run: Callable[[], T]) -> T:
        start = time.perf_counter()
        result = run()
        if milliseconds is not None:
            milliseconds[stage] = milliseconds.get(stage, 0.0) + 1e3 * (time.perf_counter() - start)
        return result

    return timed


def _bytes(values: F32) -> npt.NDArray[np.uint8]:
    return (np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)
