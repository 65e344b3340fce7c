"""The engine-free part of the Unreal plugin by ctypes. What it asks of a GPU, parts of backend `gl` do."""

from __future__ import annotations

import ctypes as C
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32, F64
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.program.chunks import BUFFER_LIMIT
from tests.players.unity_play.desk import Desk

Words = npt.NDArray[np.uint32]
_MAKE = C.CFUNCTYPE(None, C.c_uint32, C.c_uint32, C.c_uint32, C.c_void_p)
_PUT = C.CFUNCTYPE(None, C.c_uint32, C.c_uint32, C.c_void_p, C.c_uint32)
_GO = C.CFUNCTYPE(None, C.c_char_p, C.c_uint32, C.c_void_p, C.POINTER(C.c_uint32), C.c_uint32)
_GONE = C.CFUNCTYPE(None, C.c_uint32)
KEYS, SCRIPT = range(2)  # PoseLayers::Source
EXPRESSION, EYELID, JOINT, CLEAR = range(4)  # kinds of probe_set


class SeenCamera(C.Structure):
    """AvatarCamera."""

    _fields_ = (
        ("struct_size", C.c_uint32),
        ("camera_from_world", C.c_float * 16),
        ("clip_from_world", C.c_float * 16),
        ("centre", C.c_float * 3),
        ("tan_half_fov", C.c_float * 2),
        ("width", C.c_int32),
        ("height", C.c_int32),
    )

    def __init__(self, **given: Any) -> None:
        super().__init__(struct_size=C.sizeof(self), **given)


class Face(C.Structure):
    """AvatarFrame."""

    _fields_ = (
        ("struct_size", C.c_uint32),
        ("weights", C.c_float * 52),
        ("head", C.c_double * 3),
        ("left_eye", C.c_double * 3),
        ("right_eye", C.c_double * 3),
    )

    def __init__(self) -> None:
        super().__init__(struct_size=C.sizeof(self))


def doubles(values: Any) -> Any:
    """Numbers in row-major order, as C takes them."""
    flat = np.ascontiguousarray(values, np.float64).ravel()
    return (C.c_double * len(flat))(*flat)


class Core:
    """The library."""

    def __init__(self, path: Path) -> None:
        self.c = C.CDLL(str(path))
        self.c.probe_open.restype = C.c_void_p
        for name in ("probe_add", "probe_set", "probe_mix", "probe_error", "probe_names", "probe_news"):
            getattr(self.c, name).restype = C.c_char_p

    def place(self, component: F64, eye: F64) -> F64:
        """[4, 4] scene from the person. `component` [4, 4] is an FMatrix."""
        into = (C.c_double * 16)()
        self.c.place(doubles(component), doubles(eye), into)
        return np.array(into).reshape(4, 4)

    def rotation(self, xyzw: F64) -> F64:
        """[3] in the person's frame. `xyzw` [4] is an FQuat."""
        into = (C.c_double * 3)()
        self.c.rotation(doubles(xyzw), into)
        return np.array(into)

    def box(self, low: F64, high: F64) -> tuple[F64, F64]:
        """Corners in the component's frame."""
        a, b = (C.c_double * 3)(), (C.c_double * 3)()
        self.c.box(doubles(low), doubles(high), a, b)
        return np.array(a), np.array(b)

    def camera(self, view: F64, projection: F64, width: int, height: int) -> SeenCamera | None:
        """The camera of FMatrix `view` and `projection`, or None."""
        into = SeenCamera()
        seen = self.c.camera(doubles(view), doubles(projection), width, height, C.byref(into))
        return into if seen else None


class Stage:
    """A scene of avatars whose device is a Desk."""

    def __init__(self, core: Core, desk: Desk) -> None:
        self.core, self.desk = core, desk
        desk.begin({"name": "unreal"}, np.zeros(0, np.uint32))
        self.runs: list[str] = []
        self.released: list[int] = []
        self._kept = (_MAKE(self._make), _PUT(self._put), _GO(self._go), _GONE(self.released.append))
        self.probe = C.c_void_p(core.c.probe_open(*self._kept))

    def add(self, number: int, file: bytes, name: str = "head.avatar") -> str | None:
        """An avatar; the line where it is refused."""
        return _text(self.core.c.probe_add(self.probe, number, file, len(file), name.encode()))

    def remove(self, number: int) -> None:
        """Takes an avatar out."""
        self.core.c.probe_remove(self.probe, number)

    def set(self, number: int, source: int, kind: int, name: str = "", value: Any = (0.0,)) -> str | None:
        """A value of a layer; the line where it is refused."""
        return _text(self.core.c.probe_set(self.probe, number, source, kind, name.encode(), doubles(value)))

    def clip(self, number: int, name: str) -> tuple[int, float]:
        """Index and length of a clip."""
        seconds = C.c_double()
        index: int = self.core.c.probe_clip(self.probe, number, name.encode(), C.byref(seconds))
        return index, seconds.value

    def names(self, number: int) -> list[str]:
        """Expressions, eyelids, joints, clips."""
        return (_text(self.core.c.probe_names(self.probe, number)) or "").splitlines()

    def news(self, number: int) -> str | None:
        """The newest line of an avatar, once."""
        return _text(self.core.c.probe_news(self.probe, number))

    def mix(self, number: int, clip: int = -1, seconds: float = 0.0, face: Face | None = None) -> str | None:
        """Computes the pose."""
        shown = None if face is None else C.byref(face)
        return _text(self.core.c.probe_mix(self.probe, number, clip, C.c_double(seconds), shown))

    def pose(self, number: int) -> tuple[F64, F64, F64, F64]:
        """Expressions, eyelids, joints [J, 4, 4] and root [4, 4]."""
        parts = []
        for part in range(4):
            into = (C.c_double * self.core.c.probe_pose(self.probe, number, part, None))()
            self.core.c.probe_pose(self.probe, number, part, into)
            parts.append(np.array(into))
        return parts[0], parts[1], parts[2].reshape(-1, 4, 4), parts[3].reshape(4, 4)

    def send(self, number: int, component: F64, shown: bool = True) -> None:
        """Pose and place for the next frames."""
        self.core.c.probe_send(self.probe, number, doubles(component), int(shown))

    def draw(self, view: F64, projection: F64, eye: F64, size: tuple[int, int], frame: int) -> F32 | None:
        """[H, W, 4], or None where there is nothing to draw."""
        self.runs.clear()
        quads = (C.c_uint32 * 2)()
        count = self.core.c.probe_draw(
            self.probe, doubles(view), doubles(projection), doubles(eye), *size, frame, quads
        )
        if not count:
            return None
        self.desk._buffers["Quads"] = self.desk._buffers[f"{quads[0]}/{quads[1]}"]
        image = self.desk.draw({"width": size[0], "height": size[1], "quads": count}, np.zeros(0, np.uint32))
        del self.desk._buffers["Quads"]
        return image

    def error(self) -> str | None:
        """The newest line of the scene."""
        return _text(self.core.c.probe_error(self.probe))

    def close(self) -> None:
        """Gives everything back."""
        self.core.c.probe_close(self.probe)

    def _make(self, owner: int, index: int, size: int, content: int | None) -> None:
        words = np.zeros(0, np.uint32) if content is None else _words(content, size)
        self.desk.make({"name": f"{owner}/{index}", "bytes": size}, words)

    def _put(self, owner: int, index: int, address: int, size: int) -> None:
        self.desk.write({"name": f"{owner}/{index}"}, _words(address, size))

    def _go(self, entry: bytes, groups: int, block: int, bindings: Any, count: int) -> None:
        row = self.desk._programs.table[entry.decode()]
        names = {s["binding"]: s["name"] for s in row["storage"]}
        (members,) = row["uniform_blocks"]
        told = _words(block, members["size"])
        constants = {}
        for m in members["members"]:
            length = 1 if m["type"] in ("uint", "float") else int(m["type"][-1])
            constants[m["name"]] = told[m["offset"] // 4 :][:length].tolist()
        bound = {names[bindings[3 * i]]: f"{bindings[3 * i + 1]}/{bindings[3 * i + 2]}" for i in range(count)}
        self.runs.append(entry.decode())
        self.desk.run(
            {"entry": entry.decode(), "groups": groups, "buffers": bound, "constants": constants},
            np.zeros(0, np.uint32),
        )


@contextmanager
def stage(core: Core) -> Iterator[Stage]:
    """A stage on a context of its own."""
    gpu = Gpu(None, False, BUFFER_LIMIT)
    try:
        with gpu.current():
            made = Stage(core, Desk(gpu))
            yield made
            made.close()
    finally:
        gpu.release()


def _words(address: int, size: int) -> Words:
    return np.frombuffer(C.string_at(address, -(-size // 4) * 4), np.uint32).copy()


def _text(said: bytes | None) -> str | None:
    return None if said is None else said.decode()
