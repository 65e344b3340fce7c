"""`height_px` by Python and by the C interface, held to the vectors of all players; Node and mono have own tests."""

from __future__ import annotations

import ctypes as C
import json
import math
from typing import Any

import numpy as np
import pytest

from avatar_export.measure.height_px import height_px
from avatar_runtime.handedness import HANDEDNESS
from tests.conformance.height_vectors import made
from tests.players.unreal.core import SeenCamera
from tests.players.unreal.sources import library
from tests.players.vectors.height_cases import VECTORS, height_packs

CLOSE = 1e-5  # relative: matrices of cameras are float32
MIRROR = np.diag([-1.0, 1.0, 1.0, 1.0])
NONE_SHOWN = 2**32 - 1


@pytest.fixture(scope="module")
def native() -> C.CDLL:
    """The functions of avatar_player.h."""
    held = C.CDLL(str(library()))
    for name in ("avatar_load", "avatar_instance_open"):
        getattr(held, name).restype = C.c_void_p
    for name in ("avatar_place", "avatar_world_from_avatar"):
        getattr(held, name).restype = C.POINTER(C.c_double)
    held.avatar_height_px.restype = C.c_double
    held.avatar_next_level.restype = held.avatar_level_for.restype = C.c_uint32
    return held


@pytest.fixture(scope="module")
def packs() -> dict[str, bytes]:
    return height_packs()


def opened(native: C.CDLL, file: bytes) -> C.c_void_p:
    return C.c_void_p(native.avatar_load(file, len(file), b"a.avatar", None))


def wanted(case: dict[str, Any]) -> float:
    return math.inf if case["height_px"] is None else case["height_px"]


def test_the_vectors_are_those_of_their_formula() -> None:
    np.testing.assert_equal(json.loads(json.dumps(made())), VECTORS)


@pytest.mark.parametrize("case", VECTORS["heights"], ids=lambda case: case["name"])
def test_python(case: dict[str, Any]) -> None:
    clip, world = (np.reshape(case[name], (4, 4)) for name in ("clip_from_world", "world_from_avatar"))
    found = height_px(VECTORS["framing_whole"], clip, world, case["image_px"][1])
    assert found == pytest.approx(wanted(case), rel=CLOSE)


@pytest.mark.parametrize("hand", HANDEDNESS)
def test_heights_of_the_c_interface(native: C.CDLL, packs: dict[str, bytes], hand: str) -> None:
    pack = opened(native, packs[f"height_{hand}"])
    instance = C.c_void_p(native.avatar_instance_open(pack, 0, None))
    for case in VECTORS["heights"]:
        pose = np.reshape(case["pose"], (4, 4))
        pose = MIRROR @ pose @ MIRROR if hand == "left" else pose  # arrays of a pose are in the pack's frame
        for to, matrix in ((native.avatar_place, case["place"]), (native.avatar_world_from_avatar, pose)):
            C.memmove(to(instance), np.ascontiguousarray(matrix, np.float64).ctypes.data, 128)
        clip, (width, height) = (C.c_float * 16)(*case["clip_from_world"]), case["image_px"]
        camera = SeenCamera(clip_from_world=clip, tan_half_fov=(1, 1), width=width, height=height)
        found = native.avatar_height_px(instance, C.byref(camera))
        assert found == pytest.approx(wanted(case), rel=CLOSE), case["name"]
    assert (
        native.avatar_height_px(instance, None) == native.avatar_height_px(None, C.byref(camera)) == math.inf
    )
    native.avatar_instance_close(instance)
    native.avatar_close(pack)


@pytest.mark.parametrize("index", range(len(VECTORS["sequences"])))
def test_levels_of_the_c_interface(native: C.CDLL, packs: dict[str, bytes], index: int) -> None:
    one = VECTORS["sequences"][index]
    pack, level = opened(native, packs[f"levels_{index}"]), one["shown"]
    level = NONE_SHOWN if level < 0 else level
    for height, want in one["steps"]:
        seen = C.c_double(math.inf if height is None else height)
        level = native.avatar_next_level(pack, seen, C.c_uint32(level))
        assert level == want, (one["name"], height)
    native.avatar_close(pack)
