#if !defined(_WIN32)
#include "egl.h"

#include <EGL/eglext.h>

static bool start(EglContext& egl, EGLDisplay display) {
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, nullptr, nullptr)) return false;
    egl.display = display;
    return true;
}

/// A display without a window: the first device that starts, then Mesa's own, then the default one.
static bool start_headless(EglContext& egl) {
    const auto platform = reinterpret_cast<PFNEGLGETPLATFORMDISPLAYEXTPROC>(eglGetProcAddress("eglGetPlatformDisplayEXT"));
    const auto query = reinterpret_cast<PFNEGLQUERYDEVICESEXTPROC>(eglGetProcAddress("eglQueryDevicesEXT"));
    EGLDeviceEXT devices[16];
    EGLint count = 0;
    if (platform != nullptr && query != nullptr) query(16, devices, &count);
    for (EGLint i = 0; i < count; i++) {
        if (start(egl, platform(EGL_PLATFORM_DEVICE_EXT, devices[i], nullptr))) return true;
    }
    if (platform != nullptr && start(egl, platform(EGL_PLATFORM_SURFACELESS_MESA, nullptr, nullptr))) return true;
    return start(egl, eglGetDisplay(EGL_DEFAULT_DISPLAY));
}

/// The first config for a pbuffer, or for windows of a visual.
static EGLConfig config_of(const EglContext& egl, bool is_es, EGLint surface, EGLint visual) {
    const EGLint alpha = surface == EGL_PBUFFER_BIT ? 8 : 0;
    const EGLint wanted[] = {EGL_SURFACE_TYPE, surface, EGL_RENDERABLE_TYPE, is_es ? EGL_OPENGL_ES3_BIT : EGL_OPENGL_BIT,
                             EGL_RED_SIZE, 8, EGL_GREEN_SIZE, 8, EGL_BLUE_SIZE, 8, EGL_ALPHA_SIZE, alpha, EGL_NONE};
    EGLConfig configs[64];
    EGLint count = 0;
    if (!eglChooseConfig(egl.display, wanted, configs, 64, &count)) return nullptr;
    for (EGLint i = 0; i < count; i++) {
        EGLint found = visual;
        if (surface == EGL_WINDOW_BIT) eglGetConfigAttrib(egl.display, configs[i], EGL_NATIVE_VISUAL_ID, &found);
        if (found == visual) return configs[i];
    }
    return nullptr;
}

static const char* make_context(EglContext& egl, bool is_es, EGLConfig config) {
    const EGLint es[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 1, EGL_NONE};
    const EGLint desktop[] = {EGL_CONTEXT_MAJOR_VERSION, 4, EGL_CONTEXT_MINOR_VERSION, 3,
                              EGL_CONTEXT_OPENGL_PROFILE_MASK, EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    egl.context = eglCreateContext(egl.display, config, EGL_NO_CONTEXT, is_es ? es : desktop);
    if (egl.context == EGL_NO_CONTEXT) {
        return is_es ? "EGL makes no context of OpenGL ES 3.1" : "EGL makes no context of OpenGL 4.3: try --es";
    }
    return eglMakeCurrent(egl.display, egl.surface, egl.surface, egl.context) ? nullptr : "EGL does not make its context current";
}

const char* open_egl(EglContext& made, bool is_es, int width, int height) {
    made = EglContext();
    if (!start_headless(made)) return "EGL has no display: is a GPU driver, or Mesa's software one, installed?";
    eglBindAPI(is_es ? EGL_OPENGL_ES_API : EGL_OPENGL_API);
    const EGLConfig config = config_of(made, is_es, EGL_PBUFFER_BIT, 0);
    const EGLint size[] = {EGL_WIDTH, width, EGL_HEIGHT, height, EGL_NONE};
    made.surface = config == nullptr ? EGL_NO_SURFACE : eglCreatePbufferSurface(made.display, config, size);
    if (made.surface == EGL_NO_SURFACE) return "EGL has no pbuffer of this size for this kind of OpenGL";
    return make_context(made, is_es, config);
}

const char* open_egl_window(EglContext& made, bool is_es, unsigned platform, void* native_display, void* native_window,
                            EGLint visual) {
    made = EglContext();
    if (!start(made, eglGetPlatformDisplay(platform, native_display, nullptr))) return "EGL does not know this display";
    eglBindAPI(is_es ? EGL_OPENGL_ES_API : EGL_OPENGL_API);
    const EGLConfig config = config_of(made, is_es, EGL_WINDOW_BIT, visual);
    made.surface = config == nullptr ? EGL_NO_SURFACE
                                     : eglCreatePlatformWindowSurface(made.display, config, native_window, nullptr);
    if (made.surface == EGL_NO_SURFACE) return "EGL does not draw into this window";
    return make_context(made, is_es, config);
}

void close_egl(EglContext& egl) {
    if (egl.display == EGL_NO_DISPLAY) return;
    eglMakeCurrent(egl.display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (egl.surface != EGL_NO_SURFACE) eglDestroySurface(egl.display, egl.surface);
    if (egl.context != EGL_NO_CONTEXT) eglDestroyContext(egl.display, egl.context);
    eglTerminate(egl.display);
    egl = EglContext();
}

#endif
