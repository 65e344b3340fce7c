"""Writing a bundle: bit-equal round trips, the same bytes twice, and nothing left behind by a crash."""

from __future__ import annotations

import os
import subprocess
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.writers import bundle
from avatar_export.writers.bundle import write_bundle
from avatar_export.writers.table import WRITERS, Export
from avatar_runtime.avatar import Avatar, Rules
from avatar_runtime.bundle import load
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.handedness import mirrored
from avatar_runtime.io.errors import AvatarError
from tests import bundles
from tests.avatars import COUNT, assert_same, avatar_of, full_avatar, surface_avatar

NAMES = ("out", "out.avatar.zip")
PLAIN = {"preview": False, "reference": False, "engine_files": False}
BARE = replace(avatar_of(), provenance={"system": "made_for_tests"})


@pytest.mark.parametrize("name", NAMES)
def test_bundle_to_avatar_to_bundle_is_bit_equal(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Later, and in another process, too."""
    parts = {"preview": False, "reference": name == "out"}  # a zip holds what the folder holds
    write_bundle(full_avatar(), tmp_path / name, **parts)
    again = load(tmp_path / name)
    assert_same(full_avatar(), again)
    monkeypatch.setattr("time.time", lambda: 2e9)
    monkeypatch.setattr("time.localtime", lambda *_: (2033, 5, 18, 3, 33, 20, 2, 138, 0))
    monkeypatch.setattr(os, "getpid", lambda: 12345)
    write_bundle(again, tmp_path / f"again-{name}", **parts)
    first, second = tmp_path / name, tmp_path / f"again-{name}"
    assert bundles.contents(first) == bundles.contents(second)
    assert name == "out" or first.read_bytes() == second.read_bytes()


VARIANTS: dict[str, Callable[[Avatar], Avatar]] = {
    "no rig": lambda a: BARE,
    "on a surface": lambda a: surface_avatar(),
    "in triangles": lambda a: surface_avatar(
        rules=Rules("triangle_frame", position="triangle_frame", scale="triangle_linear")
    ),
    "turned by joints": lambda a: surface_avatar(
        rules=Rules("bary_vertex_lbs", position="interpolated_normal")
    ),
    "on a surface without a rig": lambda a: surface_avatar(rigged=False),
    "head_bone": lambda a: replace(a, rules=Rules("head_bone", "jaw", "world", "repeats")),
    "random background": lambda a: replace(a, raster=replace(a.raster, background="random")),
    "head pose in the camera": lambda a: replace(a, head_pose_in="camera"),
    "as it is": lambda a: a,
    "the ends of float32": lambda a: replace(
        a, gaussians=replace(a.gaussians, mean=np.tile(np.float32([3e38, -1e-45, -0.0]), (COUNT, 1)))
    ),
}


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.parametrize("handedness", ["right", "left"])
@pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning")
def test_variants_survive_the_round_trip(tmp_path: Path, name: str, handedness: str) -> None:
    avatar = check_avatar(VARIANTS[name](full_avatar()))
    write_bundle(avatar, tmp_path / "out", handedness=handedness, **PLAIN)
    assert bundles.manifest(tmp_path / "out")["frame"]["handedness"] == handedness
    assert_same(load(tmp_path / "out"), avatar)
    stored = mirrored(avatar) if handedness == "left" else avatar
    assert_same(load(tmp_path / "out", as_stored=True), stored)


def test_the_zip_is_stored_and_holds_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = tuple(replace(w, pieces=lambda _: [b"a picture"]) if w.derived else w for w in WRITERS)
    monkeypatch.setattr(bundle, "WRITERS", drawn)
    folder, packed = (tmp_path / name for name in NAMES)
    document = write_bundle(full_avatar(), folder)
    assert write_bundle(full_avatar(), packed) == document
    assert bundles.contents(folder) == bundles.contents(packed)
    with zipfile.ZipFile(packed) as archive:
        names = archive.namelist()
        assert all(info.compress_type == zipfile.ZIP_STORED for info in archive.infolist())
    written = [w for w in WRITERS if w.path not in ("embedding.safetensors", "light.safetensors")]
    assert names == [w.path for w in written] + ["avatar.json"], "the manifest is written last"
    assert [(e["path"], e["derived"]) for e in document["files"]] == [(w.path, w.derived) for w in written]


def breaks_half_way(_: Export) -> Iterable[bytes]:
    yield b"half a file"
    raise OSError(28, "No space left on device")


@pytest.mark.parametrize("file", ["gaussians.ply", "preview.png"])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("existing", [False, True])
def test_a_crash_leaves_everything_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, file: str, name: str, existing: bool
) -> None:
    out = tmp_path / name
    if existing:
        write_bundle(full_avatar(seed=9), out, **PLAIN)
    before = bundles.contents(out) if existing else None
    broken = tuple(replace(w, pieces=breaks_half_way) if w.path == file else w for w in WRITERS)
    monkeypatch.setattr(bundle, "WRITERS", broken)
    with pytest.raises(AvatarError):
        write_bundle(full_avatar(), out, force=True, reference=False, engine_files=False)
    assert os.listdir(tmp_path) == ([name] if existing else [])
    assert not existing or bundles.contents(out) == before


@pytest.fixture(scope="module")
def dead() -> int:
    with subprocess.Popen(["true"]) as process:
        return process.pid


def test_what_a_killed_process_left_is_removed_by_the_next(dead: int, tmp_path: Path) -> None:
    for name in NAMES:
        (tmp_path / f".{name}.{dead}.partial").mkdir()
        (tmp_path / f".{name}.{dead}.partial" / "half").write_bytes(b"half")
        (tmp_path / f".{name}.{os.getpid()}.partial").write_bytes(b"of an earlier process of this number")
    kept = {
        f".out.{os.getppid()}.partial",
        f".other.{dead}.partial",
        ".out.x.partial",
    }  # one is being written
    for name in kept:
        (tmp_path / name).write_bytes(b"")
    for name in NAMES:
        write_bundle(full_avatar(), tmp_path / name, **PLAIN)
    assert set(os.listdir(tmp_path)) == {*NAMES, *kept}


def test_a_bundle_that_a_killed_process_had_moved_away_is_put_back(dead: int, tmp_path: Path) -> None:
    out = bundles.write(tmp_path / "out", full_avatar(seed=9))
    before = bundles.contents(out)
    out.rename(tmp_path / f".out.{dead}.old")
    with pytest.raises(AvatarError, match="exists; pass --force"):
        write_bundle(full_avatar(), out, **PLAIN)
    assert os.listdir(tmp_path) == ["out"] and bundles.contents(out) == before


def refused(avatar: Avatar, out: Path, **options: Any) -> str:
    before = {p: p.is_file() and p.read_bytes() for p in sorted(out.parent.rglob("*"))}
    with pytest.raises(AvatarError) as caught:
        write_bundle(avatar, out, **PLAIN, **options)
    assert {p: p.is_file() and p.read_bytes() for p in sorted(out.parent.rglob("*"))} == before
    return str(caught.value)


def test_what_exists_is_only_replaced_by_force_and_only_if_it_is_a_bundle(tmp_path: Path) -> None:
    for name in NAMES:
        write_bundle(full_avatar(seed=9), tmp_path / name, **PLAIN)
        assert "exists; pass --force" in refused(full_avatar(), tmp_path / name)
        write_bundle(full_avatar(), tmp_path / name, force=True, **PLAIN)
        assert_same(load(tmp_path / name), full_avatar())
    photos, thesis, backup = (tmp_path / name for name in ("photos", "thesis.avatar.zip", "backup.zip"))
    photos.mkdir()
    (photos / "holiday.jpg").write_bytes(b"dear")
    thesis.write_bytes(b"dearer")
    with zipfile.ZipFile(backup, "w") as archive:
        archive.writestr("thesis.tex", "dear")
    for path in (photos, thesis, backup):
        assert "exists; pass --force" in refused(full_avatar(), path)
        assert "is not a bundle" in refused(full_avatar(), path, force=True)
    (tmp_path / "empty").mkdir()
    write_bundle(full_avatar(), tmp_path / "empty", force=True, **PLAIN)


def test_what_cannot_be_written(tmp_path: Path) -> None:
    avatar = full_avatar()
    mean = avatar.gaussians.mean.copy()
    mean[5, 1] = np.nan
    broken = replace(avatar, gaussians=replace(avatar.gaussians, mean=mean))
    assert "gaussians.mean: is nan at row 5" in refused(broken, tmp_path / "out")
    sky = replace(avatar, raster=replace(avatar.raster, background="sky"))
    assert "background" in refused(sky, tmp_path / "out")
    (tmp_path / "file").write_text("")
    assert "cannot be written" in refused(avatar, tmp_path / "file" / "out")
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(AvatarError, match="loop: is a link that leads to itself"):
        write_bundle(avatar, tmp_path / "loop", **PLAIN)
