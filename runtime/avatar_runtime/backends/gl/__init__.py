"""Backend `gl`: the generated shaders on OpenGL 4.3 or OpenGL ES 3.1, with a window or without one."""

from __future__ import annotations

from avatar_runtime.backends.gl.backend import GlBackend, make, make_scene
from avatar_runtime.backends.gl.scene import Scene

__all__ = ["GlBackend", "Scene", "make", "make_scene"]
