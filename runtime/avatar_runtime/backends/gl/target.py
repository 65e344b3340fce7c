"""The render target: an image of floats or bytes, and the depth of objects in front of the splats."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.backends.gl.state import drawing_into
from avatar_runtime.io.errors import AvatarError

TARGETS = {"rgba32f": "f4", "rgba16f": "f2", "rgba8": "f1"}  # and moderngl's names of their components

_HEADERS = {"glsl430": "#version 430\n", "glsl310es": "#version 310 es\nprecision highp float;\n"}
_CORNERS = """
void main() {
    gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0);
}
"""
# Not a stage: OpenGL ES cannot upload depth values, so they are drawn.
_DEPTHS = """
uniform highp sampler2D given;
uniform int flip;
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy);
    if (flip != 0) { at.y = textureSize(given, 0).y - 1 - at.y; }
    gl_FragDepth = texelFetch(given, at, 0).r;
}
"""


class Target:
    """An image of one size; its first row is the top one."""

    def __init__(self, gpu: Gpu, size: tuple[int, int], kind: str) -> None:
        """`size` is (width, height), which `check_size` accepts. Raises AvatarError if the context cannot draw into
        that kind, or has no memory left for it; then nothing is held.
        """
        self._gpu, self.size, self._dtype = gpu, size, TARGETS[kind]
        self._made: list[Any] = []
        self._depth_program: moderngl.Program | None = None
        try:
            self._make(gpu.context)
        except moderngl.Error as error:
            self.release()
            said = f"this context cannot draw {size[0]}x{size[1]} pixels into {kind}: {error}"
            raise AvatarError(said, field="backend gl") from error

    def _make(self, context: moderngl.Context) -> None:
        self.texture = self._hold(context.texture(self.size, 4, dtype=self._dtype))
        # On OpenGL ES floats need not be filterable, and a filtered texture of such a format reads as black.
        self.texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
        self._depth = self._hold(context.depth_renderbuffer(self.size))
        self.framebuffer = self._hold(context.framebuffer([self.texture], self._depth))
        self.framebuffer.depth_mask = False  # splats do not hide each other
        self._depth_alone = self._hold(context.framebuffer([], self._depth))

    def _hold(self, made: Any) -> Any:
        self._made.append(self._gpu.hold(made))
        return made

    def clear(self, depth: npt.NDArray[Any] | moderngl.Texture | None) -> None:
        """Clears it; splats behind `depth` [H, W] are hidden. None: nothing hides them."""
        self.framebuffer.clear(0, 0, 0, 0)
        if depth is not None:
            self._draw_depth(depth)

    def read(self) -> F32:
        """[H, W, 4] premultiplied colour and alpha."""
        dtype = "f1" if self._dtype == "f1" else "f4"
        raw = self.framebuffer.read(components=4, dtype=dtype)
        shape = (self.size[1], self.size[0], 4)
        if dtype == "f1":
            return np.frombuffer(raw, np.uint8).reshape(shape).astype(np.float32) / np.float32(255)
        return np.frombuffer(raw, np.float32).reshape(shape).copy()

    def release(self) -> None:
        """Frees the target before its context is released."""
        while self._made:
            self._gpu.drop(self._made.pop())

    def _draw_depth(self, depth: npt.NDArray[Any] | moderngl.Texture) -> None:
        """An array's first row is the image's top one, a texture's the bottom one, as GL draws."""
        context = self._gpu.context
        if isinstance(depth, moderngl.Texture):
            texture, own = depth, None
        else:
            values = np.ascontiguousarray(depth, np.float32)
            texture = own = context.texture(self.size, 1, values.tobytes(), dtype="f4")
        program = self._filler()
        program["flip"] = int(own is None)
        sampler = context.sampler(filter=(moderngl.NEAREST, moderngl.NEAREST))
        texture.use(0)
        sampler.use(0)
        with drawing_into(context, self._depth_alone, moderngl.DEPTH_TEST):
            context.depth_func = "1"  # always
            self._vertices.render(moderngl.TRIANGLES, vertices=3)
        sampler.clear(0)
        sampler.release()
        if own is not None:
            own.release()

    def _filler(self) -> moderngl.Program:
        if self._depth_program is None:
            header = _HEADERS[self._gpu.language]
            self._depth_program = self._hold(self._gpu.context.program(header + _CORNERS, header + _DEPTHS))
            self._vertices = self._hold(self._gpu.context.vertex_array(self._depth_program, []))
        return self._depth_program


def check_size(context: moderngl.Context, size: tuple[int, int]) -> None:
    """Raises ValueError for an image (width, height) that is larger than `context` draws."""
    info = context.info
    side = min(info["GL_MAX_TEXTURE_SIZE"], info["GL_MAX_RENDERBUFFER_SIZE"])
    most = [min(side, viewport) for viewport in info["GL_MAX_VIEWPORT_DIMS"]]
    if size[0] > most[0] or size[1] > most[1]:
        raise ValueError(
            f"an image of {size[0]}x{size[1]} pixels is larger than this context draws: {most[0]}x{most[1]}"
        )


def check_depth(depth: npt.NDArray[Any] | moderngl.Texture | None, size: tuple[int, int]) -> None:
    """Raises ValueError for a depth of another size than the image (width, height)."""
    if depth is None:
        return
    found = depth.size if isinstance(depth, moderngl.Texture) else np.shape(depth)[::-1]
    if tuple(found) != size:
        raise ValueError(f"the depth is {found}, the image {size} (width, height)")
