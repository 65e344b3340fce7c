#if !defined(_WIN32)
#include "window.h"

#if defined(AVATAR_PLAY_X11)

#include <EGL/eglext.h>
#include <X11/Xlib.h>
#include <X11/Xutil.h>
#include <X11/keysym.h>

struct PlayWindow {
    Display* display;
    Window handle;
    Atom deletion;
};

const char* open_window(PlayWindow*& made, EglContext& egl, bool is_es, int width, int height) {
    Display* display = XOpenDisplay(nullptr);
    if (display == nullptr) return "--window: there is no X11 display";
    const int screen = DefaultScreen(display);
    made = new PlayWindow{display, 0, XInternAtom(display, "WM_DELETE_WINDOW", False)};
    made->handle = XCreateSimpleWindow(display, RootWindow(display, screen), 0, 0, static_cast<unsigned>(width),
                                       static_cast<unsigned>(height), 0, 0, BlackPixel(display, screen));
    XSizeHints fixed = {};
    fixed.flags = PMinSize | PMaxSize;
    fixed.min_width = fixed.max_width = width;
    fixed.min_height = fixed.max_height = height;
    XSetWMNormalHints(display, made->handle, &fixed);
    XSetWMProtocols(display, made->handle, &made->deletion, 1);
    XSelectInput(display, made->handle, KeyPressMask);
    XStoreName(display, made->handle, "avatar_play");
    XMapWindow(display, made->handle);
    const EGLint visual = static_cast<EGLint>(XVisualIDFromVisual(DefaultVisual(display, screen)));
    return open_egl_window(egl, is_es, EGL_PLATFORM_X11_KHR, display, &made->handle, visual);
}

bool window_is_open(PlayWindow* window) {
    while (XPending(window->display) > 0) {
        XEvent event;
        XNextEvent(window->display, &event);
        if (event.type == KeyPress && XLookupKeysym(&event.xkey, 0) == XK_Escape) return false;
        if (event.type == ClientMessage && static_cast<Atom>(event.xclient.data.l[0]) == window->deletion) return false;
    }
    return true;
}

void close_window(PlayWindow* window) {
    if (window == nullptr) return;
    XDestroyWindow(window->display, window->handle);
    XCloseDisplay(window->display);
    delete window;
}

#else

struct PlayWindow {};

const char* open_window(PlayWindow*&, EglContext&, bool, int, int) {
    return "--window: this avatar_play was built without X11";
}

bool window_is_open(PlayWindow*) { return false; }

void close_window(PlayWindow*) {}

#endif

#endif
