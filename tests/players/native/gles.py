"""Compiles what plays on OpenGL and Direct3D 11 in the native player, and asks it for images."""

from __future__ import annotations

import hashlib
import os
import shutil
import struct
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from avatar_runtime.avatar import F32, F64, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.pose import Pose, resolve
from tests.players.native.windows import built, run_windows, windows_program
from tests.players.native.x11 import XLIB_HEADER
from tests.session.native import BUILT, NATIVE, SANITIZED, build
from tests.session.needed import need

EGL_HEADER = Path("/usr/include/EGL/egl.h")
LIMIT_S = 240
STILL = np.eye(4)
KEEP_DRIVERS = "keep_drivers.cpp"
DESK = ("desk.cpp", "refused_scene.cpp")
# A driver keeps what it likes until the process ends.
DRIVERS = (
    "leak:libLLVM\nleak:libEGL\nleak:libGL\nleak:swrast_dri\nleak:_dri.so\nleak:libgallium\nleak:libdrm\n"
)


def need_gl() -> None:
    """clang++, CMake and EGL's header. See `need`."""
    tools = {name: shutil.which(name) for name in ("clang++", "cmake")}
    need({**tools, "EGL/egl.h (libegl-dev)": EGL_HEADER.exists()})


def _unit(name: str, files: Sequence[Path], head: str) -> Path:
    """One file that includes all of them: it compiles faster."""
    text = head + "".join(f'#include "{path}"\n' for path in files)
    hashed = hashlib.sha256(head.encode() + b"".join(path.read_bytes() for path in files)).hexdigest()[:16]
    BUILT.mkdir(parents=True, exist_ok=True)
    made = BUILT / f"unit_{name}_{hashed}.cpp"
    made.write_text(text)
    return made


def desk_program(kind: str = "es", name: str = "desk", flags: Sequence[str] = SANITIZED) -> Path:
    """The program that plays jobs of a kind, with sanitizers or other flags; for d3d11 a program for Windows."""
    if kind == "d3d11":
        return windows_program(name, [NATIVE / "tests" / name for name in (*DESK, "desk_d3d11.cpp")])
    need_gl()
    files = [NATIVE / "tests" / name for name in (*DESK, "desk_gl.cpp", KEEP_DRIVERS)]
    return build(name, [*files, NATIVE / "play" / "egl.cpp"], flags, ["-lEGL"], gles=True)


def play_program(kind: str = "es") -> Path:
    """avatar_play, with sanitizers; with a window where X11 is; for d3d11 a program for Windows."""
    if kind == "d3d11":
        return built() / "avatar_play.exe"
    need_gl()
    files = [NATIVE / "tests" / KEEP_DRIVERS, *sorted((NATIVE / "play").glob("*.cpp"))]
    head, link = ("#define AVATAR_PLAY_X11\n", ["-lX11"]) if XLIB_HEADER.exists() else ("", [])
    return build("avatar_play", [_unit("avatar_play", files, head)], SANITIZED, ["-lEGL", *link], gles=True)


def run_gl(program: Path, words: Sequence[str]) -> subprocess.CompletedProcess[str]:
    """Runs a program that opens a context of OpenGL, or one for Windows. Leaks of the driver are not reported."""
    if program.suffix == ".exe":
        return run_windows(program, words)
    command = [str(program), *words]
    own = {**_environment(program), "DISPLAY": ""}
    return subprocess.run(command, env=own, capture_output=True, text=True, timeout=LIMIT_S, check=False)


def start_gl(program: Path, words: Sequence[str], **environment: str) -> subprocess.Popen[str]:
    """The same; it goes on while the test does."""
    own = {**_environment(program), **environment}
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen([str(program), *words], env=own, text=True, **pipes)


def _environment(program: Path) -> dict[str, str]:
    suppressed = program.with_name("drivers.txt")
    suppressed.write_text(DRIVERS)
    return {
        **os.environ,
        "ASAN_OPTIONS": "detect_leaks=1:quarantine_size_mb=1:thread_local_quarantine_size_kb=64",
        "UBSAN_OPTIONS": "print_stacktrace=1",
        "LSAN_OPTIONS": f"suppressions={suppressed}:print_suppressions=0",
    }


@dataclass
class Job:
    """Commands of tests/desk.cpp, and the files that they name."""

    folder: Path
    lines: list[str] = field(default_factory=list)
    sizes: dict[str, tuple[int, int]] = field(
        default_factory=dict
    )  # of images, by their files: (height, width)
    said: list[list[str]] = field(default_factory=list)  # what a test keeps of `run`
    _files: int = 0
    _size: tuple[int, int] = (0, 0)

    def say(self, *words: object) -> None:
        """A command as it is."""
        self.lines.append(" ".join(map(str, words)))

    def add(self, pack: Path, avatar: Avatar, pose: Pose, level: int = 0, place: F64 = STILL) -> None:
        """An instance in a pose."""
        self.say("add", pack, level, self.pose(avatar, pose, place))

    def pose(self, avatar: Avatar, pose: Pose, place: F64 = STILL) -> Path:
        """The file of a pose."""
        arrays = resolve(pose, avatar)
        floats = np.concatenate([arrays.expression_weights, arrays.late_weights]).astype("<f4").tobytes()
        doubles = [arrays.joint_delta, arrays.world_from_avatar, place]
        return self.file(floats + b"".join(np.asarray(one, "<f8").tobytes() for one in doubles))

    def camera(self, seen: Camera) -> None:
        """The camera of all that follows."""
        floats = [
            seen.camera_from_world,
            seen.clip_from_world,
            seen.centre,
            [seen.tan_half_fov_x, seen.tan_half_fov_y],
        ]
        data = b"".join(np.asarray(one, "<f4").tobytes() for one in floats)
        self._size = seen.height, seen.width
        data = struct.pack("<I", len(data) + 12) + data + struct.pack("<2i", seen.width, seen.height)
        self.say("camera", self.file(data))

    def draw(self, name: str, *words: object) -> None:
        """An image; `words` are a command that writes one."""
        self.sizes[name] = self._size
        self.say(*(words or ("draw",)), self.folder / name)

    def file(self, data: bytes) -> Path:
        """A file of the job."""
        self._files += 1
        path = self.folder / f"input_{self._files}"
        path.write_bytes(data)
        return path

    def run(self, program: Path) -> list[list[str]]:
        """The words of each line that was printed. Fails the test with what failed there."""
        told = self.folder / "job.txt"
        told.write_text("\n".join(self.lines) + "\n")
        done = run_gl(program, [str(told)])
        assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-5000:]
        return [line.split() for line in done.stdout.splitlines()]

    def image(self, name: str) -> F32:
        """[H, W, 4] premultiplied colour and alpha."""
        return np.fromfile(self.folder / name, np.float32).reshape(*self.sizes[name], 4)
