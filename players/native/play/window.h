#pragma once
#include "egl.h"

/// A window of X11, in programs that were built with it.
struct PlayWindow;

/// Opens one with a context that is current. Returns NULL, or what is missing.
const char* open_window(PlayWindow*& made, EglContext& egl, bool is_es, int width, int height);

/// Takes what has happened to it. False: it was closed, or Escape was pressed.
bool window_is_open(PlayWindow* window);

/// NULL is taken.
void close_window(PlayWindow* window);
