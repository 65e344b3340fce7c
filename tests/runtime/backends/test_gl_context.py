"""Whose OpenGL context it is: our own, the caller's, several in one process, or none at all."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import moderngl
import numpy as np
import pytest

from avatar_runtime.backends.gl import GlBackend
from avatar_runtime.backends.gl.context import language_of, own_context
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.posed import Clock
from tests.avatars import full_avatar
from tests.runtime.backends.gl_cases import BACKGROUND, SIZE, backend, camera, posed_of, reference_image

AVATAR = full_avatar(3)
WIDTH, HEIGHT = SIZE
BEHIND = tuple(BACKGROUND.tolist())


def current_handle() -> int:
    egl = ctypes.CDLL("libEGL.so.1")
    egl.eglGetCurrentContext.restype = ctypes.c_void_p
    return egl.eglGetCurrentContext() or 0


def frame(gl: GlBackend) -> Any:
    return gl.frame(posed_of(gl), camera(), BACKGROUND, "engine", Clock())


@pytest.fixture(params=[False, True], ids=["desktop", "es"])
def context(request: pytest.FixtureRequest) -> Iterator[moderngl.Context]:
    """A caller's context, current as callers leave it."""
    made = own_context(es=request.param)
    with made:
        yield made
    made.release()


def test_no_context_says_what_to_install() -> None:
    code = (
        "from tests.avatars import full_avatar\n"
        "from avatar_runtime.player import Player\n"
        "from avatar_runtime.io.errors import AvatarError\n"
        "for es in (False, True):\n"
        "    try:\n"
        "        Player(full_avatar(), 'gl', es=es)\n"
        "    except AvatarError as error:\n"
        "        print(error)\n"
    )
    environment = os.environ | {"__EGL_VENDOR_LIBRARY_FILENAMES": "/nonexistent"}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=60, check=True
    )
    lines = done.stdout.splitlines()
    assert len(lines) == 2, done.stderr
    for line in lines:
        assert line.startswith("backend gl: no OpenGL context can be made here (")
        assert "apt-get install libegl1 libgl1 libgles2 libegl-mesa0 libgl1-mesa-dri" in line


def test_the_callers_other_context_is_current_again() -> None:
    mine = own_context(es=False)
    with mine:
        handle = current_handle()
        with backend(AVATAR) as gl:
            frame(gl)
            assert current_handle() == handle
            gl.context.__enter__()  # now the backend's own is current, and stays so
            own = current_handle()
            assert own not in (0, handle)
            frame(gl)
            assert current_handle() == own
        assert current_handle() == 0
    mine.release()


def test_a_callers_context_lives_on(context: moderngl.Context) -> None:
    before = context.buffer(b"kept")
    gl = GlBackend(AVATAR, context)
    handle = current_handle()
    frame(gl)
    assert current_handle() == handle
    gl.release()
    assert before.read() == b"kept"
    before.release()


def test_too_old_a_context(monkeypatch: pytest.MonkeyPatch) -> None:
    made = own_context(es=False)
    monkeypatch.setattr(made, "version_code", 330)
    with pytest.raises(AvatarError, match=r"this context is OpenGL 3\.3; compute shaders need 4\.3"):
        language_of(made)
    made.release()


@pytest.fixture
def scene(context: moderngl.Context) -> Iterator[moderngl.Framebuffer]:
    """A caller's framebuffer with something in it: one colour, and a depth that is nearer on the left."""
    colour = context.texture(SIZE, 4, dtype="f4")
    made = context.framebuffer([colour], context.depth_renderbuffer(SIZE))
    made.clear(0.1, 0.2, 0.3, 0.5)
    yield made
    made.release()
    colour.release()


def read(framebuffer: moderngl.Framebuffer) -> Any:
    """Top row first."""
    raw = np.frombuffer(framebuffer.read(components=4, dtype="f4"), np.float32)
    return raw.reshape(HEIGHT, WIDTH, 4)[::-1]


def test_draw_into_over_what_is_there(context: moderngl.Context, scene: moderngl.Framebuffer) -> None:
    """All of the image is drawn, and the viewport is afterwards the caller's."""
    scene.viewport = (10, 20, 30, 40)
    want = reference_image(AVATAR, camera())
    bare = want.colour - want.transmittance[..., None] * BACKGROUND
    with backend(AVATAR, context=context) as gl:
        gl.draw_into(scene, posed_of(gl), camera())
        left = want.transmittance[..., None]
        assert np.abs(read(scene)[..., :3] - (bare + left * np.float32([0.1, 0.2, 0.3]))).max() <= 1 / 255
        assert np.abs(read(scene)[..., 3] - (1 - want.transmittance * 0.5)).max() <= 1 / 255
        gl.draw_into(scene, posed_of(gl), camera(), background=BEHIND)
        assert np.abs(read(scene)[..., :3] - want.colour).max() <= 1 / 255
        assert (read(scene)[..., 3] == 1).all() and scene.viewport == (10, 20, 30, 40)
        with pytest.raises(ValueError, match=r"the framebuffer is \(4, 4\), the camera \(200, 160\)"):
            gl.draw_into(context.simple_framebuffer((4, 4)), posed_of(gl), camera())


def test_draw_into_linear_light(context: moderngl.Context, scene: moderngl.Framebuffer) -> None:
    """The finished colour is converted: over an opaque background, the curve of the display-referred image."""
    want = reference_image(AVATAR, camera()).colour.astype(np.float64)
    linear = np.where(want <= 0.04045, want / 12.92, ((want + 0.055) / 1.055) ** 2.4)
    with backend(AVATAR, context=context) as gl:
        gl.draw_into(scene, posed_of(gl), camera(), background=BEHIND, linear=True)
    assert np.abs(read(scene)[..., :3] - linear).max() <= 1 / 255


def test_draw_into_a_scene_with_depth() -> None:
    """The framebuffer's own depth texture, first row at the bottom, hides what an array does, first row on top."""
    context = own_context(es=False)
    depth = np.ones((HEIGHT, WIDTH), np.float32)
    depth[: HEIGHT // 2] = 0.9837  # the upper half of the image
    with context, backend(AVATAR, context=context) as gl:
        texture = context.depth_texture(SIZE, np.ascontiguousarray(depth[::-1]).tobytes())
        framebuffer = context.framebuffer([context.texture(SIZE, 4, dtype="f4")], texture)
        whole = gl.scene.image([posed_of(gl)], camera(), BACKGROUND)
        want = gl.scene.image([posed_of(gl)], camera(), BACKGROUND, depth=depth)
        changed = np.abs(whole.colour - want.colour).max(axis=2) > 0.01
        assert changed[: HEIGHT // 2].any() and not changed[HEIGHT // 2 :].any()
        gl.draw_into(framebuffer, posed_of(gl), camera(), background=BEHIND, depth=texture)
        assert np.abs(read(framebuffer)[..., :3] - want.colour).max() <= 1e-6
        assert texture.compare_func == "<="
    context.release()


def test_the_callers_state_is_as_it_was(context: moderngl.Context, scene: moderngl.Framebuffer) -> None:
    """Seen by what the caller draws next: same framebuffer, viewport, flags, blend and depth functions."""
    es = language_of(context) == "glsl310es"
    header = "#version 310 es\nprecision highp float;\n" if es else "#version 430\n"
    program = context.program(
        header
        + "void main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0,"
        " 0.25, 1.0); }",
        header + "out vec4 colour; void main() { colour = vec4(0.5, 0.25, 1.0, 0.75); }",
    )
    triangle = context.vertex_array(program, [])

    def callers_frame(between: Any) -> Any:
        scene.clear(0.25, 0.5, 0.75, 0.5)
        scene.use()
        context.viewport = (10, 20, 100, 60)
        context.enable_only(moderngl.BLEND | moderngl.DEPTH_TEST)
        context.blend_func = (moderngl.DST_COLOR, moderngl.ZERO, moderngl.ONE, moderngl.ONE)
        context.blend_equation = moderngl.FUNC_ADD, moderngl.FUNC_SUBTRACT
        context.depth_func = "1"
        triangle.render(moderngl.TRIANGLES, vertices=3)
        context.depth_func = "!="
        between()
        triangle.render(moderngl.TRIANGLES, vertices=3)  # hidden, by the depth that it has itself
        context.depth_func = "1"
        triangle.render(moderngl.TRIANGLES, vertices=3)
        assert context.fbo is scene and context.viewport == (10, 20, 100, 60)
        context.disable(moderngl.BLEND)
        return read(scene)

    want = callers_frame(lambda: None)
    other = context.framebuffer([context.texture(SIZE, 4, dtype="f4")])
    with backend(AVATAR, context=context) as gl:
        np.testing.assert_array_equal(callers_frame(lambda: frame(gl)), want)
        np.testing.assert_array_equal(
            callers_frame(lambda: gl.draw_into(other, posed_of(gl), camera())), want
        )
    assert read(other).any()
    assert not np.array_equal(want[100, 50], want[0, 0])
