// A stand-in for EGL/egl.h, for tests.
#pragma once
extern "C" void (*eglGetProcAddress(const char* name))(void);
