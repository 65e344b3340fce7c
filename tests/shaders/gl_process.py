"""Runs GLSL on an OpenGL context of a process of its own, so that no other test's context is disturbed.

Requests and answers are pickles of this test run alone.
"""

from __future__ import annotations

import ctypes as C
import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from types import MappingProxyType
from typing import Any

import moderngl
import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
CONSTANTS = 8  # binding of every uniform block


def refusals(*asked: Any) -> list[str]:
    """What the driver says against each program, {"compute"} or {"vertex", "fragment"}: text; "" for none."""
    return _ask(_refusals, *asked)


def compute(*asked: Any) -> list[Array]:
    """The storage buffers (binding 0, 1, ...) after one dispatch."""
    return _ask(_compute, "glsl430", *asked)


def image(*asked: Any) -> Array:
    """[H, W, 4] of the float image at binding 0 after one dispatch; it begins with zeros."""
    return _ask(_image, "glsl430", *asked)


def draw(*asked: Any, **more: Any) -> Array:
    """[H, W, 5] colour, alpha and depth, first row first in memory, of strips of 4 vertices blended back to front.

    `attributes` is [instances, 12]: quad0, quad1, quad2. With `indices` an instance is triangles of these vertices.
    `textures` are [H, W, C] by the name of the sampler in the text. Depth is that of the last splat, 1 where there is
    none.
    """
    return _ask(_draw, "glsl430", *asked, **more)


def _ask(task: Callable[..., Any], language: str, *asked: Any, **more: Any) -> Any:
    environment = {**os.environ, "MESA_GLES_VERSION_OVERRIDE": "3.1"}  # the least that GLES has to be
    request = pickle.dumps((task.__name__, language, asked, more))
    done = subprocess.run([sys.executable, __file__], input=request, capture_output=True, env=environment)
    assert done.returncode == 0, done.stderr.decode()
    return pickle.loads(done.stdout)


class _GlesContext:
    """Surfaceless OpenGL ES 3.1 through EGL, in the shape that moderngl takes from outside."""

    def __init__(self) -> None:
        egl = self._egl = C.CDLL("libEGL.so.1")
        for name in ("eglGetProcAddress", "eglCreateContext"):
            getattr(egl, name).restype = C.c_void_p
        platform = C.CFUNCTYPE(C.c_void_p, C.c_uint, C.c_void_p, C.c_void_p)
        display = platform(egl.eglGetProcAddress(b"eglGetPlatformDisplayEXT"))(
            0x31DD, None, None
        )  # surfaceless
        egl.eglInitialize(C.c_void_p(display), None, None)
        egl.eglBindAPI(0x30A0)  # OpenGL ES
        version = (C.c_int * 5)(0x3098, 3, 0x30FB, 1, 0x3038)  # major, minor
        context = egl.eglCreateContext(C.c_void_p(display), None, None, version)
        assert context, "no OpenGL ES 3.1"
        egl.eglMakeCurrent(C.c_void_p(display), None, None, C.c_void_p(context))

    def load_opengl_function(self, name: str) -> int:
        return self._egl.eglGetProcAddress(name.encode()) or 0

    def __enter__(self) -> _GlesContext:
        return self

    def __exit__(self, *error: object) -> None:
        pass

    def release(self) -> None:
        pass


def _context(language: str) -> moderngl.Context:
    if language == "glsl310es":
        return moderngl.create_context(context=_GlesContext(), require=310)
    return moderngl.create_context(standalone=True, backend="egl", require=430)


def _refusals(context: moderngl.Context, programs: list[dict[str, str]]) -> list[str]:
    said = []
    for program in programs:
        try:
            if "compute" in program:
                context.compute_shader(program["compute"])
            else:
                context.program(vertex_shader=program["vertex"], fragment_shader=program["fragment"])
            said.append("")
        except moderngl.Error as error:
            said.append(str(error))
    return said


def _bind(context: moderngl.Context, storage: list[Array], constants: bytes) -> list[moderngl.Buffer]:
    buffers = [context.buffer(np.ascontiguousarray(array).tobytes()) for array in storage]
    for binding, buffer in enumerate(buffers):
        buffer.bind_to_storage_buffer(binding)
    context.buffer(constants).bind_to_uniform_block(CONSTANTS)
    return buffers


def _compute(
    context: moderngl.Context, text: str, storage: list[Array], constants: bytes, groups: int
) -> list[Array]:
    shader = context.compute_shader(text)
    buffers = _bind(context, storage, constants)
    shader.run(groups)
    return [np.frombuffer(b.read(), a.dtype).reshape(a.shape) for a, b in zip(storage, buffers, strict=True)]


def _image(
    context: moderngl.Context,
    text: str,
    storage: list[Array],
    constants: bytes,
    groups: int,
    size: tuple[int, int],
) -> Array:
    shader = context.compute_shader(text)
    _bind(context, storage, constants)
    texture = context.texture(size, 4, bytes(16 * size[0] * size[1]), dtype="f4")
    texture.bind_to_image(0, read=False, write=True)
    shader.run(groups)
    context.memory_barrier()
    return np.frombuffer(texture.read(), np.float32).reshape(size[1], size[0], 4)


def _draw(
    context: moderngl.Context,
    vertex: str,
    fragment: str,
    constants: bytes,
    size: tuple[int, int],
    instances: int,
    storage: Sequence[Array] = (),
    attributes: Array | None = None,
    indices: Array | None = None,
    textures: Mapping[str, Array] = MappingProxyType({}),
) -> Array:
    program = context.program(vertex_shader=vertex, fragment_shader=fragment)
    _bind(context, list(storage), constants)
    for unit, (name, texels) in enumerate(textures.items()):
        height, width, components = texels.shape
        context.texture((width, height), components, texels.tobytes(), dtype="f4").use(unit)
        program[name] = unit
    content = []
    if attributes is not None:
        buffer = context.buffer(np.ascontiguousarray(attributes, np.float32).tobytes())
        content = [(buffer, "4f 4f 4f/i", "quad0", "quad1", "quad2")]
    depth = context.depth_texture(size)
    target = context.framebuffer([context.texture(size, 4, dtype="f4")], depth)
    target.use()
    target.clear(depth=1.0)
    context.enable(moderngl.BLEND | moderngl.DEPTH_TEST)
    context.depth_func = "1"  # always
    context.blend_func = moderngl.ONE, moderngl.ONE_MINUS_SRC_ALPHA
    elements = None if indices is None else context.buffer(indices.astype(np.uint32).tobytes())
    drawn = context.vertex_array(program, content, elements)
    if indices is None:
        drawn.render(moderngl.TRIANGLE_STRIP, vertices=4, instances=instances)
    else:
        drawn.render(moderngl.TRIANGLES, vertices=len(indices), instances=instances)
    colour = np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(size[1], size[0], 4)
    return np.dstack([colour, np.frombuffer(depth.read(), np.float32).reshape(size[1], size[0])])


def main() -> None:
    """Answer the request on standard input."""
    task, language, asked, more = pickle.load(sys.stdin.buffer)
    sys.stdout.buffer.write(pickle.dumps(globals()[task](_context(language), *asked, **more)))


if __name__ == "__main__":
    main()
