"""`validate` makes derived files again and compares them."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from avatar_export.images import png
from avatar_export.writers.bundle import write_bundle
from tests import bundles
from tests.avatars import full_avatar, surface_avatar
from tests.exporter.checks.conftest import found


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of bundles with every derived file, one of each kind of avatar."""
    folder = tmp_path_factory.mktemp("whole")
    for kind, avatar in (("skin", full_avatar()), ("surface", surface_avatar())):
        write_bundle(avatar, folder / kind)
    return folder


Derived = Callable[[str], Path]


@pytest.fixture
def derived(whole: Path, tmp_path: Path) -> Derived:
    return lambda kind: Path(shutil.copytree(whole / kind, tmp_path / "whole"))


@pytest.mark.parametrize("kind", ["skin", "surface"])
def test_derived_files_are_made_again_and_are_the_same(derived: Derived, kind: str) -> None:
    assert found(derived(kind)) == []


TAMPERED: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "preview.png": (lambda data: image(0), "pixels, expected"),
    "rig.glb": (lambda data: data.replace(b"jawOpen", b"jawOpem"), "jawOpe"),
    "splats.glb": (lambda data: data[:-4] + b"\0\0\x80?", "values"),
    "rig.usdc": (lambda data: data[:-8], ""),
    "avatar.usdz": (lambda data: data + b"\0", ""),
    "embedding.json": (lambda data: data.replace(b"0", b"1", 1), "first difference is at byte"),
}


def image(value: int) -> bytes:
    return png(np.full((8, 8, 3), value, np.uint8))


def test_a_derived_file_that_is_not_what_the_others_give(derived: Derived) -> None:
    bundle = derived("surface")
    for name, (change, _) in TAMPERED.items():
        data = (bundle / name).read_bytes()
        assert change(data) != data
        (bundle / name).write_bytes(change(data))
    assert len(found(bundle)) == len(TAMPERED), "damage without a new hash is one problem each"
    bundles.sign(bundle)
    problems = dict((path, message) for path, message, _ in found(bundle))
    assert set(problems) == set(TAMPERED)
    for name, (_, phrase) in TAMPERED.items():
        assert phrase in problems[name], problems[name]
        assert "\n" not in problems[name] and len(problems[name]) < 400


def test_what_the_manifest_says_of_the_engine_files_is_measured_again(derived: Derived) -> None:
    bundle = derived("skin")
    assert bundles.manifest(bundle)["engine"]["late_morph_mm"] > 0
    bundles.edit(bundle, lambda d: d["engine"].update(late_morph_mm=0.0))
    ((path, message, warning),) = found(bundle)
    assert path == "avatar.json: $.engine.late_morph_mm" and not warning
    assert message.startswith("is 0.0, but measures ")


def test_what_validators_of_the_format_miss_is_looked_for(
    derived: Derived, monkeypatch: pytest.MonkeyPatch
) -> None:
    bundle = derived("surface")
    monkeypatch.setattr("avatar_export.writers.usd.checks.usd_problems", lambda data: ["a joint too many"])
    assert found(bundle) == [("rig.usdc", "a joint too many", False)]


def test_splats_that_the_embedding_does_not_give(tmp_path: Path) -> None:
    avatar = surface_avatar()
    moved, turned = avatar.gaussians.mean.copy(), avatar.gaussians.quat_wxyz.copy()
    moved[3, 1] += 1e-3
    turned[5] = turned[5, ::-1]
    gaussians = replace(avatar.gaussians, mean=moved, quat_wxyz=turned)
    bundles.write(tmp_path / "out", replace(avatar, gaussians=gaussians))
    assert [path for path, _, _ in found(tmp_path / "out") if "bounds" not in path] == [
        "gaussians.ply: xyz[3]",
        "gaussians.ply: rot[5]",
    ]
