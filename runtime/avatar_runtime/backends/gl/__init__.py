"""Backend `gl`: the generated shaders on OpenGL 4.3 or OpenGL ES 3.1, with a window or without one."""

from __future__ import annotations

from moderngl import Context

from avatar_runtime.backends.gl.backend import GlBackend, make_scene
from avatar_runtime.backends.gl.programs import Shaders
from avatar_runtime.backends.gl.scene import Scene

make = GlBackend

__all__ = ["Context", "GlBackend", "Scene", "Shaders", "make", "make_scene"]
