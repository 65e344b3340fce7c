"""The numbers of a light by the C interface, held to Python's; mono has an own test."""

from __future__ import annotations

import ctypes as C
from typing import Any

import numpy as np
import pytest

from avatar_runtime.handedness import HANDEDNESS
from tests.avatars import full_avatar
from tests.players.unreal.sources import library
from tests.players.vectors.light_cases import HEAD, light_cases, light_packs, packed

MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
CLOSE = 1e-5  # of the largest number of a row
SHADOW, LIGHT = 3, 4  # lists of passes
CONSTANTS = [*(f"scene_ambient{k}" for k in range(9)), *(f"place{k}" for k in range(4))]
CONSTANTS += [*(f"colour{k}" for k in range(4)), *(f"turn_row{k}" for k in range(3))]
CONSTANTS += [*(f"shadow_row{k}" for k in range(4)), "shadow_offset"]


class Direct(C.Structure):
    _fields_ = (("place", C.c_double * 3), ("colour", C.c_double * 3), ("point", C.c_int32))


class Light(C.Structure):
    _fields_ = (
        ("struct_size", C.c_uint32),
        ("count", C.c_uint32),
        ("shadow", C.c_int32),
        ("ambient", C.c_double * 27),
        ("lights", Direct * 4),
    )


class Constant(C.Structure):
    _fields_ = (
        ("struct_size", C.c_uint32),
        ("name", C.c_char_p),
        ("type", C.c_uint32),
        ("offset", C.c_uint32),
    )


@pytest.fixture(scope="module")
def native() -> C.CDLL:
    held = C.CDLL(str(library()))
    for name in ("avatar_load", "avatar_instance_open", "avatar_passes_open", "avatar_passes_blocks"):
        getattr(held, name).restype = C.c_void_p
    for name in ("avatar_place", "avatar_world_from_avatar"):
        getattr(held, name).restype = C.POINTER(C.c_double)
    held.avatar_instance_error.restype = C.c_char_p
    return held


def opened(native: C.CDLL, file: bytes) -> tuple[C.c_void_p, C.c_void_p]:
    pack = C.c_void_p(native.avatar_load(file, len(file), b"a.avatar", None))
    return pack, C.c_void_p(native.avatar_instance_open(pack, 0, None))


def light_of(case: dict[str, Any]) -> Light:
    made = Light(C.sizeof(Light), len(case["lights"]), case["shadow"])
    made.ambient[:] = np.ravel(case["ambient"]).tolist()
    for at, (place, colour, point) in enumerate(case["lights"]):
        made.lights[at] = Direct((C.c_double * 3)(*place), (C.c_double * 3)(*colour), point)
    return made


def constants(native: C.CDLL, passes: C.c_void_p, dispatch: int) -> dict[str, Any]:
    """{name: four floats} of a dispatch of a list, of constants that have four."""
    size, found, one = C.c_size_t(), {}, Constant(C.sizeof(Constant))
    begin = 256 * dispatch  # no block before it is longer
    blocks = C.string_at(native.avatar_passes_blocks(passes, C.byref(size)), size.value)
    for at in range(100):
        if native.avatar_constant(passes, dispatch, at, C.byref(one)) and one.type == 4:
            found[one.name.decode()] = np.frombuffer(blocks, np.float32, 4, begin + one.offset)
    return found


@pytest.mark.parametrize("hand", HANDEDNESS)
def test_numbers_of_the_c_interface(native: C.CDLL, hand: str) -> None:
    pack, instance = opened(native, light_packs()[hand])
    lists = {at: C.c_void_p(native.avatar_passes_open(pack, 0, at, None)) for at in (SHADOW, LIGHT)}
    for case in light_cases():
        pose = np.reshape(case["pose"], (4, 4))
        pose = MIRROR @ pose @ MIRROR if hand == "left" else pose
        for to, matrix in ((native.avatar_place, case["place"]), (native.avatar_world_from_avatar, pose)):
            C.memmove(to(instance), np.ascontiguousarray(matrix, np.float64).ctypes.data, 128)
        assert native.avatar_set_joint(instance, HEAD.encode(), *map(C.c_double, case["head"]))
        assert native.avatar_set_light(instance, C.byref(light_of(case)))
        assert native.avatar_update_pose(instance), native.avatar_instance_error(instance)
        want = dict(zip(CONSTANTS, np.array(case["rows"][hand]), strict=True))
        assert native.avatar_lighting(instance) == 1 + int(want["shadow_offset"][2])
        for passes in lists.values():
            native.avatar_passes_set(passes, instance)
        found = constants(native, lists[LIGHT], 0)
        for name, row in want.items():
            np.testing.assert_allclose(found[name], row, rtol=0, atol=CLOSE * max(1, np.abs(row).max()))
        shadow = constants(native, lists[SHADOW], 1)
        assert all(
            np.array_equal(shadow[name], found[name]) for name in want if name.startswith("shadow_row")
        )
    assert native.avatar_set_light(instance, None)
    assert native.avatar_lighting(instance) == 0
    for passes in lists.values():
        native.avatar_passes_close(passes)
    native.avatar_instance_close(instance)
    native.avatar_close(pack)


def test_lights_that_are_refused(native: C.CDLL) -> None:
    pack, instance = opened(native, light_packs()["right"])
    case = light_cases()[3]
    assert len(case["lights"]) == 3
    wrong = {
        "ambient": ("ambient", [[np.nan] * 3] * 9),
        "place": ("lights", [[[0, np.inf, 0], [1, 1, 1], True]]),
        "colour": ("lights", [[[0, 1, 0], [1, -1, 1], True]]),
        "no length": ("lights", [[[0, 0, 0], [1, 1, 1], False]]),
    }
    for said, (field, value) in wrong.items():
        assert not native.avatar_set_light(instance, C.byref(light_of({**case, field: value})))
        line = native.avatar_instance_error(instance).decode()
        assert said in line and ": light: " in line, line
    many = light_of(case)
    many.count = 5
    assert not native.avatar_set_light(instance, C.byref(many))
    native.avatar_instance_close(instance)
    native.avatar_close(pack)
    pack, instance = opened(native, packed(full_avatar(3)))
    assert not native.avatar_set_light(instance, C.byref(light_of(case)))
    assert b"pack --relight" in native.avatar_instance_error(instance)
    native.avatar_instance_close(instance)
    native.avatar_close(pack)
