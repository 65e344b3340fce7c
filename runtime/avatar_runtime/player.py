"""Plays an avatar: takes a pose and a camera, gives an image and the time of every stage."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.backends import Backend, make_backend
from avatar_runtime.camera import Camera
from avatar_runtime.checks import arguments
from avatar_runtime.enhance import make_enhance
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.light import Light
from avatar_runtime.pose import Pose, resolve
from avatar_runtime.posed import Clock, Posed, Poser
from avatar_runtime.program.chunks import BUFFER_LIMIT
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.raster import Image

if TYPE_CHECKING:  # needs the extra [gl]
    from avatar_runtime.backends.gl import Context, Shaders

# Values that overflow become infinite and are not drawn, so NumPy need not warn.
ABSURD = np.errstate(over="ignore", invalid="ignore", divide="ignore")


@dataclass(frozen=True)
class Frame:
    """One played frame: the image, and the time that each stage took."""

    image: Image
    milliseconds: Mapping[str, float]  # by stage, wall time

    def rgba8(self) -> npt.NDArray[np.uint8]:
        """[H, W, 4] colour and straight alpha, without a background; the image must have been drawn over black."""
        alpha = 1 - self.image.transmittance
        colour = np.divide(
            self.image.colour,
            alpha[..., None],
            where=alpha[..., None] > 0,
            out=np.zeros_like(self.image.colour),
        )
        return _bytes(np.concatenate([colour, alpha[..., None]], axis=-1))

    def rgb8(self) -> npt.NDArray[np.uint8]:
        """[H, W, 3] display-referred bytes."""
        return _bytes(self.image.colour)


class Player:
    """Plays one avatar on one backend: `reference`, `cpu` or `gl`. The default is the fastest one that needs no GPU.

    `close`, or the end of a `with` block, frees what the backend holds; a player that nothing refers to any more is
    freed, too. Backend `gl` plays in the thread that made it. A process that is forked from one that played on `cpu` or
    `gl` cannot play on them: start processes with `spawn` or `forkserver`.
    """

    def __init__(
        self,
        avatar: Avatar,
        backend: str | None = None,
        *,
        level: int | None = None,
        enhance: bool = False,
        threads: int | None = None,
        light: Light | None = None,
        context: Context | None = None,
        es: bool = False,
        buffer_limit: int = BUFFER_LIMIT,
        shaders: Shaders | None = None,
        target: str = "rgba32f",
        order: str = "back_to_front",
        timed: bool = False,
    ) -> None:
        """
        level: level of detail of an avatar from a pack, 0 the finest; None: the avatar as it is.
        enhance: apply the avatar's enhancer to every image.
        light: the light of the scene; None: the avatar is shown in the light of its capture, as trained.
        threads: of backend `cpu`; None: one a core, at most 8.
        context and all that follow: of backend `gl`; `backends.gl.GlBackend` says what they mean.

        Raises AvatarError if a light is given and the avatar does not say in what light it was captured, if a library
        that the backend or the enhancer needs is not installed, if the avatar has no such level, and if `enhance` is
        set but the avatar has no valid enhancer; TypeError and ValueError for arguments of other types, an unknown
        backend, and an option that another backend has.
        """
        if isinstance(avatar, str | PathLike):
            raise arguments.wrong_type("avatar", avatar, "an Avatar, which load(path) gives,")
        arguments.instance("avatar", avatar, Avatar, "an Avatar")
        self._closed = False
        self.avatar = avatar = avatar if level is None else at_level(avatar, level)
        self._enhance = make_enhance(avatar.enhancer) if enhance else None
        self.backend: Backend = make_backend(
            backend,
            avatar,
            threads=threads,
            context=context,
            es=es,
            buffer_limit=buffer_limit,
            shaders=shaders,
            target=target,
            order=order,
            timed=timed,
        )
        self._poser = Poser(avatar)
        self._light: Light | None = None
        self.light = light

    @property
    def light(self) -> Light | None:
        """The light of the scene; None: as trained."""
        return self._light

    @light.setter
    def light(self, light: Light | None) -> None:
        """Raises as the constructor."""
        if light is not None:
            arguments.instance("light", light, Light)
            if self.avatar.relight is None:
                raise AvatarError(
                    "its colours hold an unknown light; make it with `convert --relight` or `pack --relight`",
                    owner=self.avatar.name,
                    field="light",
                )
        self._light = light

    @ABSURD
    def posed(
        self, pose: Pose, *, posed_vertices: npt.NDArray[Any] | None = None, clock: Clock | None = None
    ) -> Posed:
        """Stage `joints`: the input of a backend. Raises as `animate`."""
        if self._closed:
            raise ValueError("this player is closed")
        vertices = None if posed_vertices is None else _mesh_vertices(self.avatar, posed_vertices)
        arrays = resolve(pose, self.avatar)
        return (clock or Clock()).timed("joints", lambda: self._poser.posed(arrays, vertices, self._light))

    @ABSURD
    def animate(
        self,
        pose: Pose,
        milliseconds: dict[str, float] | None = None,
        *,
        posed_vertices: npt.NDArray[Any] | None = None,
    ) -> Splats:
        """Posed, activated Gaussians in world space. Raises AvatarError for a name the avatar lacks, TypeError and
        ValueError for values of other types and shapes, and for a player that is closed.

        `posed_vertices` [V, 3] (mesh space, bundle units; only for binding `surface`) replace the mesh that the rig
        makes of the pose; without a rig and without them the mesh is the canonical one. Under rotation rule
        bary_vertex_lbs the joints of `pose` still rotate the Gaussians: give the pose that the mesh belongs to.
        Raises ValueError for posed_vertices of another shape, or if nothing is bound to a surface.
        """
        kept = arguments.instance("milliseconds", {} if milliseconds is None else milliseconds, dict)
        clock = Clock(kept)
        return self.backend.animate(self.posed(pose, posed_vertices=posed_vertices, clock=clock), clock)

    @ABSURD
    def frame(
        self,
        pose: Pose,
        camera: Camera,
        background: tuple[float, float, float] | None = None,
        profile: str | None = None,
        *,
        posed_vertices: npt.NDArray[Any] | None = None,
    ) -> Frame:
        """An image of `pose` seen by `camera`; `background` defaults to the trainer's, or black.

        `profile` defaults to the first of the backend's. `posed_vertices` as in `animate`. The
        enhancer changes only `colour`, which is over this background. Raises as `animate`, and ValueError for a
        profile that the backend does not draw, an image larger than it can draw, and a background that is not finite.
        """
        arguments.instance("camera", camera, Camera)
        profile = arguments.text(
            "profile", self.backend.profiles[0] if profile is None else profile, self.backend.profiles
        )
        clock = Clock()
        posed = self.posed(pose, posed_vertices=posed_vertices, clock=clock)
        settings = self.avatar.raster
        if background is None:
            background = (0.0, 0.0, 0.0) if isinstance(settings.background, str) else settings.background
        behind = arguments.finite_array("background", background, (3,)).astype(np.float32)
        image = self.backend.frame(posed, camera, behind, profile, clock)
        if self._enhance is not None:
            run, raw = self._enhance, image.colour
            image = replace(image, colour=clock.timed("enhance", lambda: run(raw)))
        return Frame(image, clock.milliseconds)

    @ABSURD
    def mesh(self, pose: Pose) -> F32:
        """Posed vertices [V, 3] of the whole rig, mesh space. Raises AvatarError without a rig."""
        if self.avatar.rig is None:
            raise AvatarError("this avatar has no rig, so there is no mesh to pose", field="rig")
        return self.backend.mesh(self.posed(pose), Clock())

    def close(self) -> None:
        """Frees what the backend holds; nothing can be played afterwards. Closing again does nothing."""
        if not self._closed:
            self._closed = True
            self.backend.release()

    def __enter__(self) -> Player:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()


def at_level(avatar: Avatar, level: int) -> Avatar:
    """`avatar` at a level of detail of its pack, 0 the finest. Raises AvatarError if there is no such level, TypeError
    for a level that is not a whole number.
    """
    level = arguments.whole("level", level)
    if level == 0 and avatar.packed is None:
        return avatar
    levels = 1 if avatar.packed is None else avatar.packed.levels
    if not 0 <= level < levels or avatar.packed is None:
        raise AvatarError(
            f"there is no level {level}; the last one is level {levels - 1}", owner=avatar.name, field="level"
        )
    return avatar if level == avatar.packed.level else avatar.packed.at(level)


def _mesh_vertices(avatar: Avatar, vertices: npt.NDArray[Any]) -> F32:
    if avatar.embedding is None:
        raise ValueError("posed_vertices need Gaussians that are bound to a surface; this avatar has none")
    return arguments.array("posed_vertices", vertices, avatar.embedding.canonical_vertices.shape).astype(
        np.float32
    )


def _bytes(values: F32) -> npt.NDArray[np.uint8]:
    return (np.clip(values, 0, 1) * 255 + 0.5).astype(np.uint8)
