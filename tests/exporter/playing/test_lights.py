"""Lights by name and from files: presets, JSON, environment maps."""

from __future__ import annotations

import importlib.util
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from avatar_export.playing.environment import ambient, environment_light
from avatar_export.playing.lights import presets, scene_light
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.light import sh_bases
from tests.golden import Array

WAYS = {
    "+x": (1, 0, 0),
    "-x": (-1, 0, 0),
    "+y": (0, 1, 0),
    "-y": (0, -1, 0),
    "+z": (0, 0, 1),
    "-z": (0, 0, -1),
}


def on(rows: Array, way: str) -> Array:
    """[3] what a white matt surface that faces a way reflects."""
    return sh_bases(np.array(WAYS[way], np.float64)) @ rows


def written(folder: Path, radiance: Array) -> Path:
    path = folder / "map.hdr"
    assert cv2.imwrite(str(path), radiance[..., ::-1].astype(np.float32))
    return path


def test_presets_are_lights() -> None:
    assert set(presets()) == {"studio", "left", "rim"}
    assert all(scene_light(name).lights for name in presets())
    assert scene_light("left").lights[0].place[0] < 0 and scene_light("left").shadow


@pytest.mark.parametrize("size", [16, 300])
def test_a_map_of_even_light_is_ambient_light(size: int, tmp_path: Path) -> None:
    rows = environment_light(written(tmp_path, np.tile(np.array([0.5, 1, 2]), (size, 2 * size, 1)))).ambient
    np.testing.assert_allclose([on(rows, way) for way in WAYS], np.tile([0.5, 1, 2], (6, 1)), rtol=5e-3)


def test_a_linear_map_is_what_one_can_integrate() -> None:
    """Radiance 1 + w . a gives irradiance over pi of 1 + 2/3 n . a."""
    size, a = 128, np.array([0.3, -0.2, 0.5])
    polar, turn = np.meshgrid(
        (np.arange(size) + 0.5) / size * np.pi,
        ((np.arange(2 * size) + 0.5) / size - 1) * np.pi,
        indexing="ij",
    )
    way = np.stack([np.sin(polar) * np.cos(turn), np.cos(polar), np.sin(polar) * np.sin(turn)], axis=-1)
    rows = ambient(np.repeat((1 + way @ a)[..., None], 3, axis=2).astype(np.float32))
    for name, n in WAYS.items():
        np.testing.assert_allclose(on(rows, name), 1 + 2 / 3 * np.dot(n, a), atol=2e-3)


@pytest.mark.parametrize(("column", "way"), [(0.5, "+x"), (0.75, "+z"), (0.25, "-z"), (0.0, "-x")])
def test_the_middle_is_x_and_a_quarter_to_its_right_is_where_a_face_looks(
    column: float, way: str, tmp_path: Path
) -> None:
    picture = np.zeros((64, 128, 3))
    picture[30:34, (np.arange(-2, 2) + int(column * 128)) % 128] = 50
    rows = environment_light(written(tmp_path, picture)).ambient
    assert max(WAYS, key=lambda one: on(rows, one).sum()) == way


def test_the_upper_edge_is_above(tmp_path: Path) -> None:
    picture = np.zeros((64, 128, 3))
    picture[:4] = 5
    rows = environment_light(written(tmp_path, picture)).ambient
    assert max(WAYS, key=lambda one: on(rows, one).sum()) == "+y"


BAD = {
    "other.hdr": (b"\x89PNG\r\n\x1a\n" + bytes(100), "is no Radiance picture"),
    "empty.hdr": (b"", "is no Radiance picture"),
    "square.hdr": (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 64 +X 64\n", "twice as wide as high"),
    "huge.hdr": (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 90000 +X 180000\n", "twice as wide as high"),
    "short.hdr": (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 64 +X 128\n\x02\x02", "is damaged"),
    "bright.hdr": (
        b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\n" + bytes([255] * 128),
        "times white; 1e[+]08 is the most",
    ),
    "turned.hdr": (b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n+X 128 -Y 64\n", "is no Radiance picture"),
    "nan.json": (b'{"ambient": [NaN, 1, 1]}', "ambient"),
    "many.json": (
        json.dumps({"lights": [{"direction": [0, 0, 1], "colour": [1, 1, 1]}] * 5}).encode(),
        "lights",
    ),
    "none.json": (b"{", "is not valid JSON"),
    "picture.png": (b"\x89PNG\r\n\x1a\n", "is not valid JSON"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_is_no_light_is_refused_in_one_line(
    name: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    data, message = BAD[name]
    (tmp_path / name).write_bytes(data)
    with pytest.raises(AvatarError, match=message) as refused:
        scene_light(str(tmp_path / name))
    assert "\n" not in str(refused.value) and name in str(refused.value)
    assert capfd.readouterr().err == ""


def test_an_unknown_name_lists_the_presets() -> None:
    with pytest.raises(AvatarError, match="studio, left, rim"):
        scene_light("moonshine")


def test_a_missing_library_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = written(tmp_path, np.ones((16, 32, 3)))
    monkeypatch.setattr(importlib.util, "find_spec", lambda _: None)
    with pytest.raises(AvatarError, match=r"needs the extra \[hdr\]"):
        environment_light(path)
