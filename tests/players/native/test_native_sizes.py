"""Structs of the C interface may grow: a program sees what it knows, whichever of it and the library is newer."""

from __future__ import annotations

import ctypes as C
import re
import struct
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from avatar_schema.version import __version__
from tests.players.unreal.sources import library
from tests.session.native import NATIVE

NAMES = ("avatar_player.h", "avatar_light.h", "avatar_conform.h")
HEADERS = [(NATIVE / "include" / name).read_text() for name in NAMES]
OLDER, NEWER = 16, 2048  # bytes that a program of another version says a struct has
REFUSED = (0, 4097)
BYTE = 0xA5  # of memory that nobody has set
READ = {
    "AvatarAllocator",
    "AvatarDirectLight",
    "AvatarFrame",
    "AvatarLight",
    "AvatarSceneChunk",
    "AvatarStageRunner",
}
Call = Callable[[Any], object]


def of_size(size: int, content: bytes = b"", fill: int = 0) -> Any:
    """A struct that says it has so many bytes, in memory of more."""
    return (C.c_ubyte * (2 * NEWER)).from_buffer_copy(
        (struct.pack("<I", size) + content).ljust(2 * NEWER, bytes([fill]))
    )


@pytest.fixture(scope="module")
def native() -> C.CDLL:
    held = C.CDLL(str(library()))
    for name in re.findall(r"AVATAR_API [^;(]*\*\s?(avatar_\w+)\(", "".join(HEADERS)):
        getattr(held, name).restype = C.c_char_p if name.endswith("_error") else C.c_void_p
    return held


@pytest.fixture(scope="module")
def pack(native: C.CDLL, unity_cases: Path) -> C.c_void_p:
    return loaded(native, (unity_cases / "joints" / "pack.avatar").read_bytes(), None)


def loaded(native: C.CDLL, file: bytes, allocator: Any) -> C.c_void_p:
    return C.c_void_p(native.avatar_load(file, C.c_size_t(len(file)), b"a.avatar", allocator))


def fills(native: C.CDLL, pack: C.c_void_p, cases: Path) -> dict[str, Call]:
    """{struct: what fills it, and returns whether it could}."""
    text = (cases / "recording.csv").read_bytes()
    told, vectors = ((cases / "joints" / f"driving.{kind}").read_bytes() for kind in ("json", "safetensors"))
    sizes = C.c_size_t(len(told)), C.c_size_t(len(vectors))
    take = C.c_void_p(native.avatar_recording_open(text, C.c_size_t(len(text)), b"take.csv", None))
    report = C.c_void_p(native.avatar_conform(pack, told, sizes[0], vectors, sizes[1], None, None))
    passes = C.c_void_p(native.avatar_passes_open(pack, 0, 2, None))
    sort = C.c_void_p(native.avatar_sort_open(None, 0, None))
    target, angles = (C.c_double * 3)(), [C.c_double(number) for number in (1, 0, 0, 0.8)]
    return {
        "AvatarFacts": partial(native.avatar_facts, pack),
        **{
            f"Avatar{name}": partial(getattr(native, f"avatar_{name.lower()}"), pack, 0)
            for name in ("Group", "Clip", "Level", "Buffer")
        },
        "AvatarChunk": partial(native.avatar_chunk, pack, 0, 0),
        "AvatarDispatch": partial(native.avatar_dispatch, passes, 0),
        "AvatarBinding": partial(native.avatar_binding, passes, 0, 0),
        "AvatarConstant": partial(native.avatar_constant, passes, 0, 0),
        "AvatarSceneBuffer": partial(native.avatar_sort_buffer, sort, 3),
        "AvatarRecordingFacts": partial(native.avatar_recording_facts, take),
        "AvatarFrame": partial(native.avatar_recording_sample, take, C.c_double(0)),
        "AvatarReportRow": partial(native.avatar_report_row, report, 0),
        "AvatarCamera": lambda out: native.avatar_camera_orbit(out, target, *angles, 64, 48) is None,
    }


def test_structs_that_are_filled_may_grow(native: C.CDLL, pack: C.c_void_p, unity_cases: Path) -> None:
    made = fills(native, pack, unity_cases)
    assert made.keys() | READ == set(re.findall(r"^\} (Avatar\w+);", "".join(HEADERS), re.MULTILINE))
    for name, call in made.items():
        older, newer = of_size(OLDER, fill=BYTE), of_size(NEWER, fill=BYTE)
        assert call(older) and call(newer), name
        assert bytes(older[4:OLDER]) == bytes(newer[4:OLDER]) and any(newer[4:NEWER]), name
        assert not any(newer[NEWER // 2 : NEWER]), f"{name}: fields that the library does not know are not 0"
        for one, size in ((older, OLDER), (newer, NEWER)):
            assert set(one[size:]) == {BYTE}, f"{name}: written beyond its end"
        for size in REFUSED:
            refused = of_size(size, fill=BYTE)
            assert not call(refused) and set(refused[4:]) == {BYTE}, name


def test_structs_that_are_read_may_grow(native: C.CDLL, pack: C.c_void_p, unity_cases: Path) -> None:
    """Fields that a program does not have are 0: no splats of a chunk, no image of a camera."""
    instance = C.c_void_p(native.avatar_instance_open(pack, 0, None))
    native.avatar_enable_driving(instance, 1)
    weights = struct.pack("<52f", *(0.5 if at == 17 else 0 for at in range(52)))
    camera = of_size(NEWER)
    native.avatar_camera_orbit(camera, (C.c_double * 3)(), *map(C.c_double, (1, 0, 0, 0.8)), 64, 48)
    file = (unity_cases / "joints" / "pack.avatar").read_bytes()

    def counted(size: int) -> int:
        """Splats of two chunks, one behind the other."""
        both = b"".join(
            (struct.pack("<I4xQ", size, C.addressof(name)) + struct.pack("<Q", count))[:size].ljust(
                size, b"\0"
            )
            for name, count in ((buffers[0], 3), (buffers[1], 4))
        )
        sort = C.c_void_p(native.avatar_sort_open(both or None, 2, None))
        return -1 if native.avatar_sort_error(sort) is not None else native.avatar_sort_count(sort)

    def asked(size: int) -> bool:
        """Whether a runner without functions is asked for them."""
        empty = C.c_size_t(0)
        report = native.avatar_conform(pack, b"{}", C.c_size_t(2), b"", empty, of_size(size), None)
        return b"a function of it is NULL" in native.avatar_report_error(C.c_void_p(report))

    lit = loaded(native, (unity_cases / "light_right.avatar").read_bytes(), None)
    shown = C.c_void_p(native.avatar_instance_open(lit, 0, None))
    buffers = [C.create_string_buffer(name) for name in (b"a", b"b")]
    for size, splats in ((OLDER, 0), (24, 7), (64, 7)):
        assert counted(size) == splats, size
    assert native.avatar_update_camera(instance, camera) and asked(OLDER) and asked(NEWER)
    assert native.avatar_set_light(shown, of_size(OLDER)) and native.avatar_set_light(shown, of_size(NEWER))
    for size in (4 + len(weights), NEWER):
        assert native.avatar_drive(instance, of_size(size, weights)), size
    assert not native.avatar_update_camera(instance, of_size(OLDER, bytes(camera[4:])))
    for size in REFUSED:
        assert not native.avatar_drive(instance, of_size(size, weights)) and not asked(size), size
        assert not native.avatar_update_camera(instance, of_size(size, bytes(camera[4:]))), size
        assert not native.avatar_set_light(shown, of_size(size)), size
        assert loaded(native, file, of_size(size)).value is None, size


def test_the_header_has_the_version_of_the_library() -> None:
    parts = [
        re.findall(rf"AVATAR_PLAYER_VERSION_{part} (\d+)", HEADERS[0]) for part in ("MAJOR", "MINOR", "PATCH")
    ]
    assert [".".join(part for (part,) in parts)] == re.findall(r"^[\d.]+\d", __version__)
