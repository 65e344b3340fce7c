"""Normals and the light of a capture in bundles and packs: what is written is read, and who has none pays nothing."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import load_file

from avatar_export.checks.bundle import validate
from avatar_export.checks.pack import validate_pack
from avatar_export.packing.choices import Choices
from avatar_export.packing.make import make_pack
from avatar_export.packing.write import pack
from avatar_export.writers.bundle import write_bundle
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import load
from avatar_runtime.packs import decode_pack
from avatar_runtime.subset import subset
from tests import bundles
from tests.avatars import assert_same
from tests.conformance.avatars import AVATARS
from tests.exporter.packing.cases import COARSE, closed, levels_of, opened

PLAIN = {"preview": False, "engine_files": False, "reference": False}
LIT = {name: AVATARS[name]() for name in ("lit_head", "lit_world")}
ROUNDED = 1 / 80 + 1e-6  # half a step of a normal
WITHOUT = {"clips": (), "packed": None, "enhancer": None}


def normals(avatar: Avatar) -> np.ndarray:
    assert avatar.relight is not None
    return avatar.relight.normal


@pytest.mark.parametrize("name", LIT)
@pytest.mark.parametrize("handedness", ["right", "left"])
@pytest.mark.parametrize("out", ["bundle", "bundle.avatar.zip"])
def test_a_bundle_keeps_them(name: str, handedness: str, out: str, tmp_path: Path) -> None:
    write_bundle(LIT[name], tmp_path / out, handedness=handedness, **PLAIN)
    assert_same(load(tmp_path / out), LIT[name])
    assert [problem for problem in validate(tmp_path / out) if "light" in str(problem)] == []
    if not out.endswith("zip"):
        stored = load_file(tmp_path / out / "light.safetensors")["normal"]
        np.testing.assert_array_equal(stored, normals(LIT[name]) * (-1 if handedness == "left" else 1, 1, 1))


@pytest.mark.parametrize("name", LIT)
def test_an_exact_pack_keeps_every_bit(name: str) -> None:
    got = decode_pack(pack([LIT[name]], None).file, "x").avatar
    assert got.relight is not None and LIT[name].relight is not None
    assert_same(replace(got, packed=None, extras={}), replace(LIT[name], enhancer=None, extras={}))


@pytest.mark.parametrize("name", LIT)
def test_each_level_of_a_pack_has_its_own_in_a_byte_a_channel(name: str) -> None:
    levels = levels_of(LIT[name])
    made = pack(levels, COARSE)
    got = decode_pack(made.file, "x").avatar
    assert got.packed is not None
    for index, level in enumerate(levels):
        played = got.packed.at(index)
        assert np.abs(normals(played) - normals(level)).max() <= ROUNDED
        assert played.relight is not None and level.relight is not None
        assert_same(played.relight, replace(level.relight, normal=normals(played)))
    header, *_ = opened(made.file)
    kinds = {
        name: said["dtype"]
        for name, said in header.items()
        if "LightStatic" in name and name.endswith("normal")
    }
    assert len(kinds) == 2 and set(kinds.values()) == {"U8"}
    assert_same(replace(got, **WITHOUT), replace(made.avatar, **WITHOUT))


@pytest.mark.parametrize("name", LIT)
def test_a_left_handed_pack_is_sound_and_says_the_same(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("avatar_export.packing.make.SIZE", 64)
    make_pack(LIT[name], tmp_path / "x.avatar", Choices(handedness="left", preview=False))
    assert np.abs(normals(load(tmp_path / "x.avatar")) - normals(LIT[name])).max() <= ROUNDED
    assert [problem for problem in validate_pack(tmp_path / "x.avatar") if not problem.warning] == []


@pytest.mark.parametrize("name", LIT)
def test_without_them_files_are_what_they_were(name: str, tmp_path: Path) -> None:
    """No key, array or pass of light; and with them no other array changes."""
    plain = replace(LIT[name], relight=None)
    (header, document, data), (more, _, lit) = (
        opened(pack([one], COARSE).file) for one in (plain, LIT[name])
    )
    text = json.dumps([header, document]).lower()
    assert "light" not in text and "shadow" not in text
    for key, said in header.items():
        (a, b), (c, d) = said["data_offsets"], more[key]["data_offsets"]
        assert data[a:b] == lit[c:d], key
    write_bundle(plain, tmp_path / "plain", **PLAIN)
    write_bundle(LIT[name], tmp_path / "lit", **PLAIN)
    files, others = (bundles.contents(tmp_path / one) for one in ("plain", "lit"))
    assert others.keys() - files.keys() == {"light.safetensors"}
    assert [file for file in files if files[file] != others[file]] == ["avatar.json"]
    assert "relight" not in bundles.manifest(tmp_path / "plain")


def test_rows_of_an_avatar_keep_theirs() -> None:
    rows = np.array([1, 4, 9])
    part = subset(LIT["lit_head"], rows, np.arange(3)).avatar
    np.testing.assert_array_equal(normals(part), normals(LIT["lit_head"])[rows])


def test_validate_names_a_normal_that_is_no_direction(tmp_path: Path) -> None:
    avatar = LIT["lit_head"]
    assert avatar.relight is not None
    normal = normals(avatar).copy()
    normal[7] *= np.float32(1.2)
    write_bundle(replace(avatar, relight=replace(avatar.relight, normal=normal)), tmp_path / "x", **PLAIN)
    found = [str(problem) for problem in validate(tmp_path / "x") if not problem.warning]
    assert len(found) == 1 and "light.safetensors: normal[7]" in found[0]


def test_validate_bakes_the_passes_of_light_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("avatar_export.packing.make.SIZE", 64)
    make_pack(LIT["lit_head"], tmp_path / "x.avatar", Choices(exact=True, preview=False))
    header, document, data = opened((tmp_path / "x.avatar").read_bytes())
    document["program"]["levels"][0]["light"][0]["constants"]["capture_ambient0"][0] += 0.5
    (tmp_path / "x.avatar").write_bytes(closed(header, document, data))
    found = [str(problem) for problem in validate_pack(tmp_path / "x.avatar")]
    assert any("levels[0].light[0].constants" in problem for problem in found), found
