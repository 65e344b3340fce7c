"""OpenGL contexts without a window: desktop 4.3 or OpenGL ES 3.1, through EGL; and which one is current.

moderngl makes desktop contexts itself. For OpenGL ES it takes a foreign context, which this module makes by a few
EGL calls.
"""

from __future__ import annotations

import ctypes as C
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import moderngl

from avatar_runtime.io.errors import AvatarError

DESKTOP, ES = 430, 310  # the lowest versions with compute shaders
NO_GL = (
    "no OpenGL context can be made here ({why}): run on a machine with a GPU driver, or install Mesa's software one "
    "(Debian: apt-get install libegl1 libgl1 libgles2 libegl-mesa0 libgl1-mesa-dri)"
)
FORKED = (
    "this process was forked from one that played on it, and no driver survives that; start processes with "
    "multiprocessing's 'spawn' or 'forkserver'"
)

# Khronos EGL registry
_OPENGL_ES_API, _CONTEXT_MAJOR, _CONTEXT_MINOR, _NONE = 0x30A0, 0x3098, 0x30FB, 0x3038
_PLATFORM_DEVICE, _PLATFORM_SURFACELESS = 0x313F, 0x31DD
_DRAW, _READ = 0x3059, 0x305A
_MOST_DEVICES = 16
_SIGNATURES: dict[str, tuple[Any, tuple[Any, ...]]] = {
    "eglGetProcAddress": (C.c_void_p, (C.c_char_p,)),
    "eglInitialize": (C.c_uint, (C.c_void_p, C.c_void_p, C.c_void_p)),
    "eglBindAPI": (C.c_uint, (C.c_uint,)),
    "eglCreateContext": (C.c_void_p, (C.c_void_p, C.c_void_p, C.c_void_p, C.c_void_p)),
    "eglDestroyContext": (C.c_uint, (C.c_void_p, C.c_void_p)),
    "eglMakeCurrent": (C.c_uint, (C.c_void_p, C.c_void_p, C.c_void_p, C.c_void_p)),
    "eglGetCurrentContext": (C.c_void_p, ()),
    "eglGetCurrentDisplay": (C.c_void_p, ()),
    "eglGetCurrentSurface": (C.c_void_p, (C.c_int,)),
}

_process: int | None = None  # the one that uses contexts


def own_context(es: bool) -> moderngl.Context:
    """A context of our own: OpenGL ES 3.1, or desktop OpenGL 4.3; it becomes current only if no other context was.

    Raises AvatarError, which says what to install, if no context can be made, and in a forked process as `current`.
    """
    _check_process()
    try:
        with kept_current():
            settings: dict[str, Any] = {"require": DESKTOP, "standalone": True}
            if es:
                settings = {"require": ES, "context": EsContext().__enter__()}
            elif sys.platform.startswith("linux"):
                settings["backend"] = "egl"
            return moderngl.create_context(**settings)
    except Exception as error:  # glcontext raises bare Exception, ctypes OSError, moderngl ValueError
        raise AvatarError(NO_GL.format(why=error), field="backend gl") from error


def forked() -> bool:
    """Whether this process was forked from one that had used a context."""
    return _process not in (None, os.getpid())


def _check_process() -> None:
    global _process
    if forked():
        raise AvatarError(FORKED, field="backend gl")
    _process = os.getpid()


def language_of(context: moderngl.Context) -> str:
    """The shader language that a context takes, `glsl430` or `glsl310es`. Raises AvatarError for an older one."""
    es = context.info["GL_VERSION"].startswith("OpenGL ES")
    need = ES if es else DESKTOP
    if context.version_code < need:
        raise AvatarError(
            f"this context is OpenGL{' ES' if es else ''} {context.version_code / 100:.1f}; compute shaders need "
            f"{need / 100:.1f}",
            field="backend gl",
        )
    return "glsl310es" if es else "glsl430"


@contextmanager
def current(context: moderngl.Context) -> Iterator[None]:
    """`context` is current inside; afterwards the one that was current before is current again.

    moderngl's own `with` leaves no context current, which a caller of ours does not expect. Raises AvatarError in a
    process that was forked after a context had been used.
    """
    _check_process()
    with kept_current():
        context.__enter__()  # type: ignore[no-untyped-call]
        yield


@contextmanager
def kept_current() -> Iterator[None]:
    """Afterwards the context that is current now is current again; if none is, nothing is changed back."""
    before = _current()
    try:
        yield
    finally:
        _make_current(before)


def let_go(context: moderngl.Context) -> None:
    """Releases a context that we made; if it was current, no context is current afterwards."""
    before = _current()
    context.__enter__()  # type: ignore[no-untyped-call]
    own = _current()
    context.__exit__(None, None, None)  # type: ignore[no-untyped-call]
    if before != own:
        _make_current(before)
    context.release()


class EsContext:
    """OpenGL ES 3.1 without a surface, as moderngl takes a foreign context."""

    def __init__(self) -> None:
        """Raises OSError if libEGL is missing or gives no such context."""
        egl = _egl()
        if egl is None:
            raise OSError("libEGL.so.1 is missing")
        egl.eglBindAPI(_OPENGL_ES_API)
        wanted = (C.c_int * 5)(_CONTEXT_MAJOR, 3, _CONTEXT_MINOR, 1, _NONE)
        for display in _displays(egl):
            if egl.eglInitialize(display, None, None):
                handle = egl.eglCreateContext(display, None, None, wanted)
                if handle:
                    self._egl, self._display, self._handle = egl, display, handle
                    return
        raise OSError("EGL has no display with OpenGL ES 3.1")

    def load_opengl_function(self, name: str) -> int:
        """The address of a GL function; 0 if there is none."""
        return self._egl.eglGetProcAddress(name.encode()) or 0

    def __enter__(self) -> EsContext:
        self._egl.eglMakeCurrent(self._display, None, None, self._handle)
        return self

    def __exit__(self, *error: object) -> None:
        self._egl.eglMakeCurrent(self._display, None, None, None)

    def release(self) -> None:
        """Gives the context back to EGL."""
        self._egl.eglDestroyContext(self._display, self._handle)


def _current() -> tuple[int | None, ...] | None:
    """(display, draw surface, read surface, context) that EGL has current; None if nothing is, or without EGL."""
    egl = _egl() if sys.platform.startswith("linux") else None
    if egl is None or not egl.eglGetCurrentContext():
        return None
    surfaces = egl.eglGetCurrentSurface(_DRAW), egl.eglGetCurrentSurface(_READ)
    return egl.eglGetCurrentDisplay(), *surfaces, egl.eglGetCurrentContext()


def _make_current(held: tuple[int | None, ...] | None) -> None:
    egl = _egl()
    if egl is not None and held is not None:
        egl.eglMakeCurrent(*held)


def _displays(egl: Any) -> Iterator[int]:
    """Displays without a window: those of devices, as moderngl takes them, then Mesa's own."""
    display = _extension(egl, "eglGetPlatformDisplayEXT", C.c_void_p, C.c_uint, C.c_void_p, C.c_void_p)
    query = _extension(egl, "eglQueryDevicesEXT", C.c_uint, C.c_int, C.c_void_p, C.c_void_p)
    devices, count = (C.c_void_p * _MOST_DEVICES)(), C.c_int(0)
    if query is not None:
        query(_MOST_DEVICES, devices, C.byref(count))
    if display is not None:
        for device in devices[: count.value]:
            yield display(_PLATFORM_DEVICE, device, None)
        yield display(_PLATFORM_SURFACELESS, None, None)


def _extension(egl: Any, name: str, result: Any, *arguments: Any) -> Any:
    address = egl.eglGetProcAddress(name.encode())
    return C.CFUNCTYPE(result, *arguments)(address) if address else None


def _egl() -> Any:
    """libEGL with its signatures; None if it is missing."""
    try:
        egl = C.CDLL("libEGL.so.1")
    except OSError:
        return None
    for name, (result, arguments) in _SIGNATURES.items():
        function = getattr(egl, name)
        function.restype, function.argtypes = result, arguments
    return egl
