#pragma once
#include <EGL/egl.h>

/// A context of OpenGL ES 3.1 or OpenGL 4.3 through EGL. Framebuffer 0 is its surface.
struct EglContext {
    EGLDisplay display = EGL_NO_DISPLAY;
    EGLContext context = EGL_NO_CONTEXT;
    EGLSurface surface = EGL_NO_SURFACE;
};

/// Makes one and makes it current: its surface is a pbuffer, so that it needs no display. Returns NULL, or what is missing.
const char* open_egl(EglContext& made, bool is_es, int width, int height);

/// The same in a window: `platform` is such as EGL_PLATFORM_X11_KHR, whose window is a pointer to a Window, and whose
/// visual is a VisualID.
const char* open_egl_window(EglContext& made, bool is_es, unsigned platform, void* native_display, void* native_window,
                            EGLint visual);

void close_egl(EglContext& egl);
