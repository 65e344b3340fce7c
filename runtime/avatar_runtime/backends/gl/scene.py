"""Several avatars in one image: each is deformed, then all of them are sorted and drawn as one."""

from __future__ import annotations

from collections.abc import Sequence

import moderngl
import numpy as np

from avatar_runtime.avatar import F32
from avatar_runtime.backends.gl.composite import Composite
from avatar_runtime.backends.gl.draw import Depth, Drawing, over
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.backends.gl.interpreter import Interpreter
from avatar_runtime.backends.gl.programs import Programs
from avatar_runtime.backends.gl.steps import Steps, clocked
from avatar_runtime.backends.gl.target import Target
from avatar_runtime.camera import Camera
from avatar_runtime.posed import Clock, Posed
from avatar_runtime.stages.raster import Image

BLACK = np.zeros(3, np.float32)


class Scene:
    """Avatars of one context in one scene; `make_scene` makes one of several backends."""

    def __init__(
        self,
        gpu: Gpu,
        programs: Programs,
        avatars: Sequence[Interpreter],
        *,
        target: str,
        order: str,
        timed: bool,
    ) -> None:
        """The context is current. Options as for `GlBackend`; raises as that does."""
        self._gpu, self._avatars, self._timed = gpu, avatars, timed
        chunks = [chunk for avatar in avatars for chunk in avatar.chunks]
        self.drawing = Drawing(gpu, programs, chunks, target, order)
        self._composite = Composite(gpu, programs)

    def image(
        self,
        posed: Sequence[Posed],
        camera: Camera,
        background: F32 = BLACK,
        *,
        depth: Depth | None = None,
        clock: Clock | None = None,
    ) -> Image:
        """The image over `background` [3], one pose an avatar; `last` and `evaluations` are None.

        depth: of the other objects in the scene, in 0..1 as the camera's clip_from_world gives z / w: an array [H, W]
            whose first row is the image's top, or a moderngl depth texture as GL draws it, first row at the bottom.
            A Gaussian whose mean lies behind is hidden at that pixel.

        Raises ValueError for a depth of another size, or if the numbers of poses and avatars differ.
        """
        with self._gpu.current():
            accumulated = clocked(
                self._gpu.context,
                clock or Clock(),
                self._timed,
                lambda steps: self._accumulate(posed, camera, depth, steps).read(),
            )
        return over(accumulated, background)

    def draw_into(
        self,
        framebuffer: moderngl.Framebuffer,
        posed: Sequence[Posed],
        camera: Camera,
        *,
        background: tuple[float, float, float] | None = None,
        linear: bool = False,
        depth: Depth | None = None,
    ) -> None:
        """Draws onto a framebuffer of this context, of the camera's size, its first row at the bottom as GL has it.

        background: display-referred rgb that replaces the framebuffer's content; None: the image is drawn over it.
        linear: the framebuffer holds linear light; the finished colour is converted after compositing.
        depth: as in `image`; the framebuffer's own depth texture will do.

        Bound framebuffer, viewport, enabled flags, blend and depth functions are restored afterwards; programs,
        vertex arrays and the bindings of buffers and textures are not. Raises ValueError for another size, or if
        the numbers of poses and avatars differ.
        """
        if tuple(framebuffer.size) != (camera.width, camera.height):
            raise ValueError(
                f"the framebuffer is {framebuffer.size}, the camera {camera.width, camera.height}"
            )
        with self._gpu.current():
            target = self._accumulate(posed, camera, depth, Steps(self._gpu.context, None))
            self._composite.onto(framebuffer, target, background, linear)

    def _accumulate(
        self, posed: Sequence[Posed], camera: Camera, depth: Depth | None, steps: Steps
    ) -> Target:
        if len(posed) != len(self._avatars):
            raise ValueError(f"{len(posed)} poses for {len(self._avatars)} avatars")
        for avatar, own in zip(self._avatars, posed, strict=True):
            avatar.deform(own, steps)
        for avatar in self._avatars:
            avatar.project(camera, steps)
        steps.run("sort", self.drawing.sort.run)
        return steps.run("raster", lambda: self.drawing.raster(camera, depth))
