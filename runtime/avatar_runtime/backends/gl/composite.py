"""Composites the finished image onto a framebuffer; converts display-referred colour for a linear framebuffer."""

from __future__ import annotations

import moderngl

from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.backends.gl.programs import Programs
from avatar_runtime.backends.gl.state import drawing_into
from avatar_runtime.backends.gl.target import Target


class Composite:
    """A full-screen pass."""

    def __init__(self, gpu: Gpu, programs: Programs) -> None:
        self._context = gpu.context
        self._program = programs.draw("composite_vertex", "composite_pixel")
        self._unit = programs.table["composite_pixel"]["textures"][0]["binding"]
        still = {"background": (0, 0, 0, 0), "linear_target": 0, "flip_rows": 1, "image_size": (1, 1)}
        self._constants = programs.constants("composite_pixel", still)
        self._vertices = gpu.hold(gpu.context.vertex_array(self._program, []))

    def onto(
        self,
        framebuffer: moderngl.Framebuffer,
        target: Target,
        background: tuple[float, float, float] | None,
        linear: bool,
    ) -> None:
        """`target` over `background`; if that is None, over the content of `framebuffer`."""
        colour = (0, 0, 0, 0) if background is None else (*background, 1)
        self._constants.set({"background": colour, "linear_target": linear, "image_size": target.size})
        viewport = framebuffer.viewport
        framebuffer.viewport = (0, 0, *target.size)
        with drawing_into(self._context, framebuffer, moderngl.BLEND):
            self._context.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
            self._context.blend_equation = moderngl.FUNC_ADD, moderngl.FUNC_ADD
            target.texture.use(self._unit)
            self._constants.bind()
            self._vertices.render(moderngl.TRIANGLES, vertices=3)
        framebuffer.viewport = viewport
