"""No bytes give the LAM reader anything but an avatar or an AvatarError."""

from __future__ import annotations

import io
import json
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from avatar_export.clips.gltf_files import gltf_of
from avatar_export.options import ReadOptions
from avatar_export.readers import lam
from tests.exporter.readers import lam_files
from tests.hostile import MANGLING, VALUES, mangled, only_avatar_errors

OFFSET, SKIN = lam_files.offset_ply(), lam_files.skin_glb()


def _zip(offset: bytes = OFFSET, skin: bytes = SKIN) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("a/offset.ply", offset)
        archive.writestr("a/skin.glb", skin)
    return stream.getvalue()


def _read(data: bytes, folder: Path) -> None:
    path = folder / "a.zip"
    path.write_bytes(data)
    assert lam.detect(path) in (True, False)
    only_avatar_errors(lambda: lam.read(path, ReadOptions()))
    only_avatar_errors(lambda: gltf_of(path))


@MANGLING
@given(mangled(_zip()))
def test_mangled_zip(tmp_path_factory: Any, data: bytes) -> None:
    _read(data, tmp_path_factory.getbasetemp())


@MANGLING
@given(mangled(OFFSET))
def test_mangled_offsets(tmp_path_factory: Any, data: bytes) -> None:
    _read(_zip(offset=data), tmp_path_factory.getbasetemp())


@MANGLING
@given(mangled(SKIN))
def test_mangled_skin(tmp_path_factory: Any, data: bytes) -> None:
    _read(_zip(skin=data), tmp_path_factory.getbasetemp())


def _places(value: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """The path to every value in a JSON document."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [path, *(place for key, item in inner for place in _places(item, (*path, key)))]


def _document() -> Any:
    length = struct.unpack_from("<I", SKIN, 12)[0]
    return json.loads(SKIN[20 : 20 + length])


PLACES = [place for place in _places(_document()) if place]
HOSTILE = VALUES | st.sampled_from(
    ["head", "\ud800", "\x1b[2J", 10**400, 1e308, -1, [0, 0, 0, 0], [1e29] * 3]
)


def _set(place: tuple[Any, ...], value: Any) -> Callable[[dict[str, Any]], None]:
    def change(document: dict[str, Any]) -> None:
        owner: Any = document
        for key in place[:-1]:
            owner = owner[key]
        owner[place[-1]] = value

    return change


@MANGLING
@given(st.sampled_from(PLACES), HOSTILE)
def test_any_value_anywhere_in_the_skin(tmp_path_factory: Any, place: tuple[Any, ...], value: Any) -> None:
    _read(_zip(skin=lam_files.edited(SKIN, _set(place, value))), tmp_path_factory.getbasetemp())
