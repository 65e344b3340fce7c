"""A display of X11 in memory: what it shows, and a user who closes the windows on it."""

from __future__ import annotations

import ctypes
import os
import shutil
import struct
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from tests.session.needed import need

XLIB_HEADER = Path("/usr/include/X11/Xlib.h")
CLIENT_MESSAGE = 33
EVENT_BYTES = 192  # of an XEvent on machines of 64 bits
NCOLORS = 19  # place of a field in the header of an XWD file


@dataclass(frozen=True)
class Screen:
    """One display."""

    name: str  # for DISPLAY
    image: Path  # what it shows, as an XWD file

    def pixels(self, width: int, height: int) -> npt.NDArray[np.uint8]:
        """[height, width, 3] colours at its top left."""
        data = self.image.read_bytes()
        head = struct.unpack_from(">25I", data)
        begin, line = head[0] + 12 * head[NCOLORS], head[12]
        rows = np.frombuffer(data, np.uint8, line * head[5], begin).reshape(head[5], line)
        return rows[:height].reshape(height, -1, 4)[:, :width, 2::-1]

    def close_windows(self) -> None:
        """Asks every window to close, as a click on its cross does."""
        xlib = _xlib()
        display = xlib.XOpenDisplay(self.name.encode())
        protocols = xlib.XInternAtom(display, b"WM_PROTOCOLS", 0)
        deletion = xlib.XInternAtom(display, b"WM_DELETE_WINDOW", 0)
        for window in _windows(xlib, display):
            head = struct.pack("<i4xQi4xQ", CLIENT_MESSAGE, 0, 1, 0)
            event = head + struct.pack("<QQi4x5q", window, protocols, 32, deletion, 0, 0, 0, 0)
            xlib.XSendEvent(display, window, 0, 0, event.ljust(EVENT_BYTES, b"\0"))
        xlib.XCloseDisplay(display)


def _xlib() -> Any:
    xlib = ctypes.CDLL("libX11.so.6")
    handle, number = ctypes.c_void_p, ctypes.c_ulong
    xlib.XOpenDisplay.restype = handle
    xlib.XOpenDisplay.argtypes = [ctypes.c_char_p]
    xlib.XCloseDisplay.argtypes = [handle]
    xlib.XInternAtom.restype = xlib.XDefaultRootWindow.restype = number
    xlib.XInternAtom.argtypes = [handle, ctypes.c_char_p, ctypes.c_int]
    xlib.XDefaultRootWindow.argtypes = [handle]
    xlib.XQueryTree.argtypes = [handle, number, *[handle] * 4]
    xlib.XSendEvent.argtypes = [handle, number, ctypes.c_int, ctypes.c_long, ctypes.c_char_p]
    return xlib


def _windows(xlib: Any, display: int) -> list[int]:
    root, parent, count = ctypes.c_ulong(), ctypes.c_ulong(), ctypes.c_uint()
    found = ctypes.POINTER(ctypes.c_ulong)()
    told = (ctypes.byref(one) for one in (root, parent, found, count))
    xlib.XQueryTree(display, xlib.XDefaultRootWindow(display), *told)
    return [int(found[at]) for at in range(count.value)]


@contextmanager
def screen(folder: Path, width: int = 640, height: int = 480) -> Iterator[Screen]:
    """A display whose image lies in `folder`. See `need`."""
    need({"Xvfb (xvfb)": shutil.which("Xvfb"), "X11/Xlib.h (libx11-dev)": XLIB_HEADER.exists()})
    read, wrote = os.pipe()
    words = ["-displayfd", str(wrote), "-screen", "0", f"{width}x{height}x24", "-fbdir", str(folder)]
    server = subprocess.Popen(
        ["Xvfb", *words, "-nolisten", "tcp"], pass_fds=[wrote], stderr=subprocess.DEVNULL
    )
    os.close(wrote)
    try:
        number = os.read(read, 16).decode().strip()
        assert number, "Xvfb did not start"
        yield Screen(f":{number}", folder / "Xvfb_screen0")
    finally:
        os.close(read)
        server.terminate()
        server.wait()
