"""Restores the caller's GL state.

moderngl's Scope restores the framebuffer, its viewport and the enabled flags. It can set blend and depth functions
but not read them, so GL is asked for them.
"""

from __future__ import annotations

import ctypes as C
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import moderngl
from _moderngl import DefaultLoader  # type: ignore[import-untyped]

_BLEND_FUNCTION = (0x80C9, 0x80C8, 0x80CB, 0x80CA)  # source and destination of colour, then of alpha
_BLEND_EQUATION = (0x8009, 0x883D)
_DEPTH_FUNCTION = 0x0B74
_COMPARISONS = {
    0x0200: "0",
    0x0201: "<",
    0x0202: "==",
    0x0203: "<=",
    0x0204: ">",
    0x0205: "!=",
    0x0206: ">=",
    0x0207: "1",
}


@contextmanager
def drawing_into(context: moderngl.Context, framebuffer: moderngl.Framebuffer, flags: int) -> Iterator[None]:
    """Inside, `framebuffer` is bound and only `flags` are enabled; afterwards the earlier state is restored."""
    blend: Any = _get(*_BLEND_FUNCTION)
    equation: Any = _get(*_BLEND_EQUATION)
    (depth,) = _get(_DEPTH_FUNCTION)
    scope = context.scope(framebuffer, flags)
    try:
        with scope:
            yield
    finally:
        scope.release()
        context.blend_func = blend
        context.blend_equation = equation
        context.depth_func = _COMPARISONS[depth]


def _get(*names: int) -> tuple[int, ...]:
    address = DefaultLoader().load_opengl_function("glGetIntegerv")
    get = C.CFUNCTYPE(None, C.c_uint, C.c_void_p)(address)
    value = C.c_int(0)
    found = []
    for name in names:
        get(name, C.byref(value))
        found.append(value.value)
    return tuple(found)
