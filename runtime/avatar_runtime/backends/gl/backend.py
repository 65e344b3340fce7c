"""The backend itself: one avatar in one context."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import moderngl

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.backends import Arrays
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.backends.gl.interpreter import Interpreter
from avatar_runtime.backends.gl.programs import Programs, Shaders
from avatar_runtime.backends.gl.scene import Scene
from avatar_runtime.backends.gl.stage import run_stage
from avatar_runtime.backends.gl.steps import Steps, clocked
from avatar_runtime.backends.gl.transfer import take_sh, take_splats
from avatar_runtime.camera import Camera
from avatar_runtime.posed import Clock, Posed
from avatar_runtime.program.bake import program_of
from avatar_runtime.program.chunks import BUFFER_LIMIT
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.raster import Image


class GlBackend:
    """Plays one avatar on the GPU: static buffers are uploaded once, a pose and a camera each frame.

    Images have profile `engine`. `release`, or the end of a `with` block, frees the GPU's memory; nothing can be
    played afterwards. A context, and everything that plays in it, belongs to the thread that made it.
    """

    profiles: tuple[str, ...] = ("engine",)

    def __init__(
        self,
        avatar: Avatar,
        context: moderngl.Context | None = None,
        *,
        es: bool = False,
        buffer_limit: int = BUFFER_LIMIT,
        shaders: Shaders | None = None,
        target: str = "rgba32f",
        order: str = "back_to_front",
        timed: bool = False,
    ) -> None:
        """
        context: moderngl context to use, OpenGL 4.3 or OpenGL ES 3.1 or later; None makes one without a window.
        es: the context made is OpenGL ES; only with context None.
        buffer_limit: bytes of the largest buffer; larger ones are split.
        shaders: where the shader text comes from; None: package avatar_shaders.
        target: rgba32f, in which conformance is stated, or rgba16f or rgba8, which round at every splat.
        order: back_to_front, or front_to_back for targets with alpha.
        timed: wait for the GPU after every stage, so that the clock has an entry for each; else it has one entry, `gl`.

        Raises AvatarError if no context can be made, a shader does not compile, or a part of the avatar that cannot
        be split exceeds the limit; ValueError for an unknown target or order, a limit out of range, or `es` together
        with a context.
        """
        self.avatar, self._timed = avatar, timed
        self.gpu = Gpu(context, es, buffer_limit)
        try:
            with self.gpu.current():
                self.programs = Programs(self.gpu, shaders)
                self.interpreter = Interpreter(self.gpu, self.programs, *program_of(avatar, buffer_limit))
                self.scene = Scene(
                    self.gpu, self.programs, [self.interpreter], target=target, order=order, timed=timed
                )
        except BaseException:
            self.gpu.release()
            raise

    @property
    def context(self) -> moderngl.Context:
        """The moderngl context, for other avatars that share a scene with this one."""
        return self.gpu.context

    def mesh(self, posed: Posed, clock: Clock) -> F32:
        """Stages morph and skin of the rig: [V, 3], mesh space."""

        def run(steps: Steps) -> F32:
            self.interpreter.set_pose(posed)
            self.interpreter.mesh.run(steps)
            return self.interpreter.download_mesh()

        with self.gpu.current():
            return clocked(self.context, clock, self._timed, run)

    def animate(self, posed: Posed, clock: Clock) -> Splats:
        """Stages up to activate, downloaded."""

        def run(steps: Steps) -> Splats:
            self.interpreter.deform(posed, steps)
            chunks = self.interpreter.chunks
            found = take_splats(chunks)
            sh = take_sh(chunks, self.interpreter.sh_terms)
            return Splats.of({**found, "sh": sh})

        with self.gpu.current():
            return clocked(self.context, clock, self._timed, run)

    def frame(self, posed: Posed, camera: Camera, background: F32, profile: str, clock: Clock) -> Image:
        """All stages, downloaded; with a depth buffer, or several avatars: `scene.image`, `make_scene`."""
        return self.scene.image([posed], camera, background, clock=clock)

    def draw_into(
        self, framebuffer: moderngl.Framebuffer, posed: Posed, camera: Camera, **options: Any
    ) -> None:
        """Draws onto a framebuffer of this context: `Scene.draw_into` with one pose."""
        self.scene.draw_into(framebuffer, [posed], camera, **options)

    def stage(self, name: str, inputs: Arrays, camera: Camera | None, profile: str) -> dict[str, Any]:
        """One stage alone."""
        with self.gpu.current():
            return run_stage(name, self.interpreter, self.scene.drawing, inputs, camera)

    def release(self) -> None:
        """Frees buffers, programs and images, and the context if this backend made it."""
        self.gpu.release()

    def __enter__(self) -> GlBackend:
        return self

    def __exit__(self, *error: object) -> None:
        self.release()


def make_scene(
    backends: Sequence[GlBackend],
    *,
    target: str = "rgba32f",
    order: str = "back_to_front",
    timed: bool = False,
) -> Scene:
    """The avatars of `backends` in one scene: each is deformed, then all are sorted and drawn as one.

    They share a context (`GlBackend(avatar, context=first.context)`); releasing the first also releases the scene.
    Raises ValueError for no backends, or if their contexts differ; AvatarError as `GlBackend`.
    """
    contexts = {id(backend.context) for backend in backends}
    if len(contexts) != 1:
        raise ValueError(f"{len(backends)} backends in {len(contexts)} contexts cannot share a scene")
    first = backends[0]
    with first.gpu.current():
        return Scene(
            first.gpu,
            first.programs,
            [backend.interpreter for backend in backends],
            target=target,
            order=order,
            timed=timed,
        )
