"""Writing a bundle: bit-equal round trips, the same bytes twice, and nothing left behind by a crash."""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterable
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from avatar_export.writers import bundle
from avatar_export.writers.bundle import write_bundle
from avatar_export.writers.table import WRITERS, Export
from avatar_runtime.avatar import Avatar, Blendshapes, Driving, Gaussians, Group, Rules, SparseRows
from avatar_runtime.bundle import load
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.io.errors import AvatarError
from tests import bundles
from tests.avatars import COUNT, assert_same, bits, full_avatar, leaves, surface_avatar

NAMES = ("out", "out.avatar.zip")


def test_the_full_avatar_has_a_value_of_its_own_in_every_field() -> None:
    """Else a round trip would not notice a field that is lost, or swapped with its neighbour."""
    avatar = full_avatar()
    seen: dict[bytes, str] = {}
    for path, value in leaves(avatar).items():
        if isinstance(value, np.ndarray):
            assert value.size and value.any(), path
            assert value.tobytes() not in seen, f"{path} equals {seen.get(value.tobytes())}"
            seen[value.tobytes()] = path
    for part in (avatar.raster, avatar.driving):
        for field in fields(part):
            assert bits(getattr(part, field.name)) != bits(field.default), field.name
    assert avatar.sh_degree != avatar.gaussians.sh_degree
    assert avatar.training_per_bundle != 1 and avatar.delta_threshold and avatar.provenance and avatar.extras
    assert {group.binding for group in avatar.groups} == {"skin", "anchor", "joint_mix", "none"}
    assert_same(avatar, full_avatar())
    assert not np.array_equal(avatar.gaussians.mean, full_avatar(1).gaussians.mean)


@pytest.mark.parametrize("name", NAMES)
def test_bundle_to_avatar_to_bundle_is_bit_equal(tmp_path: Path, name: str) -> None:
    avatar = full_avatar()
    parts = {"preview": False, "reference": name == "out"}  # a zip holds what the folder holds
    write_bundle(avatar, tmp_path / name, **parts)
    again = load(tmp_path / name)
    assert_same(avatar, again)
    write_bundle(again, tmp_path / f"again-{name}", **parts)
    assert bundles.contents(tmp_path / name) == bundles.contents(tmp_path / f"again-{name}")


def bare() -> Avatar:
    """No rig, no expressions, one Gaussian of SH degree 0: every part empty."""
    avatar = full_avatar()
    g = avatar.gaussians
    return check_avatar(
        Avatar(
            "bare",
            Gaussians(g.mean[:1], g.log_scale[:1], g.quat_wxyz[:1], g.opacity_logit[:1], g.sh[:1, :1].copy()),
            (Group("all", 0, 1, "none"),),
            Rules("none", None, "world", "unique"),
            (),
            (),
            Blendshapes(
                SparseRows.empty(1, 0, {"mean": (3,), "quat_wxyz": (4,)}),
                SparseRows.empty(1, 0, {"log_scale": (3,), "opacity_logit": (), "sh": (1, 3)}),
                SparseRows.empty(1, 0, {"mean": (3,)}),
                SparseRows.empty(1, 0, {"mean": (3,)}),
            ),
            SparseRows.empty(1, 0, {"weight": ()}),
            None,
            0,
            provenance={"system": "made_for_tests"},
        )
    )


VARIANTS: dict[str, Callable[[Avatar], Avatar]] = {
    "no rig": lambda a: bare(),
    "on a surface": lambda a: surface_avatar(),
    "in triangles": lambda a: surface_avatar(
        rules=Rules("triangle_frame", position="triangle_frame", scale="triangle_linear")
    ),
    "turned by joints": lambda a: surface_avatar(
        rules=Rules("bary_vertex_lbs", position="interpolated_normal")
    ),
    "on a surface without a rig": lambda a: surface_avatar(rigged=False),
    "head_bone": lambda a: replace(a, rules=Rules("head_bone", "jaw", "world", "repeats")),
    "rotation none": lambda a: replace(a, rules=Rules("none")),
    "driven by names": lambda a: replace(a, driving=Driving("names")),
    "not driven": lambda a: replace(a, driving=Driving()),
    "random background": lambda a: replace(a, raster=replace(a.raster, background="random")),
    "per view background": lambda a: replace(a, raster=replace(a.raster, background="per_view")),
    "head pose in the camera": lambda a: replace(a, head_pose_in="camera"),
    "no extras": lambda a: replace(a, extras={}),
    "the ends of float32": lambda a: replace(
        a, gaussians=replace(a.gaussians, mean=np.tile(np.float32([3e38, -1e-45, -0.0]), (COUNT, 1)))
    ),
}


@pytest.mark.parametrize("name", VARIANTS)
@pytest.mark.filterwarnings("ignore:overflow encountered:RuntimeWarning")
def test_variants_survive_the_round_trip(tmp_path: Path, name: str) -> None:
    avatar = check_avatar(VARIANTS[name](full_avatar()))
    write_bundle(avatar, tmp_path / "out", preview=False, engine_files=False, reference=False)
    assert_same(avatar, load(tmp_path / "out"))


@pytest.mark.parametrize("name", NAMES)
def test_the_same_avatar_gives_the_same_bytes(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    drawn = name == "out"  # a zip holds what the folder holds
    write_bundle(full_avatar(), tmp_path / name, preview=drawn, reference=drawn)
    first = (tmp_path / name).read_bytes() if name.endswith(".zip") else bundles.contents(tmp_path / name)
    monkeypatch.setattr("time.time", lambda: 2e9)
    monkeypatch.setattr("time.localtime", lambda *_: (2033, 5, 18, 3, 33, 20, 2, 138, 0))
    monkeypatch.setattr(os, "getpid", lambda: 12345)
    write_bundle(full_avatar(), tmp_path / name, preview=drawn, reference=drawn, force=True)
    second = (tmp_path / name).read_bytes() if name.endswith(".zip") else bundles.contents(tmp_path / name)
    assert first == second


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
    written = [w for w in WRITERS if w.path != "embedding.safetensors"]
    assert names == [w.path for w in written] + ["avatar.json"], "the manifest is written last"
    assert [(e["path"], e["derived"]) for e in document["files"]] == [(w.path, w.derived) for w in written]


def test_a_rigless_avatar_has_no_rig_file(tmp_path: Path) -> None:
    document = write_bundle(bare(), tmp_path / "out", preview=False, engine_files=False, reference=False)
    assert document["joints"] is None
    assert set(bundles.contents(tmp_path / "out")) == {
        "avatar.json",
        "gaussians.ply",
        "blendshapes.safetensors",
    }


class Interrupted(Exception):
    pass


def breaks_half_way(_: Export) -> Iterable[bytes]:
    yield b"half a file"
    raise Interrupted


def full_disk(_: Export) -> Iterable[bytes]:
    yield b"half a file"
    raise OSError(28, "No space left on device")


CRASHES = {
    "first file": ("gaussians.ply", breaks_half_way, Interrupted),
    "last file": ("preview.png", breaks_half_way, Interrupted),
    "disk full": ("rig.safetensors", full_disk, AvatarError),
}


@pytest.mark.parametrize("crash", CRASHES)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("existing", [False, True])
def test_a_crash_leaves_everything_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, crash: str, name: str, existing: bool
) -> None:
    out = tmp_path / name
    if existing:
        write_bundle(full_avatar(seed=9), out, preview=False, reference=False)
    before = bundles.contents(out) if existing else None
    file, pieces, error = CRASHES[crash]
    broken = tuple(replace(w, pieces=pieces) if w.path == file else w for w in WRITERS)
    monkeypatch.setattr(bundle, "WRITERS", broken)
    with pytest.raises(error):
        write_bundle(full_avatar(), out, force=True, reference=False)
    assert os.listdir(tmp_path) == ([name] if existing else [])
    if existing:
        assert bundles.contents(out) == before


@pytest.mark.parametrize("step", ["bounds", "manifest_bytes"])
def test_a_crash_at_the_manifest_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    def raises(*_: object) -> Any:
        raise Interrupted

    monkeypatch.setattr(bundle, step, raises)
    with pytest.raises(Interrupted):
        write_bundle(full_avatar(), tmp_path / "out", preview=False, reference=False)
    assert os.listdir(tmp_path) == []


def test_what_a_killed_process_left_is_removed_by_the_next(tmp_path: Path) -> None:
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    for name in NAMES:
        (tmp_path / f".{name}.{dead.pid}.partial").mkdir()
        (tmp_path / f".{name}.{dead.pid}.partial" / "half").write_bytes(b"half")
        (tmp_path / f".{name}.{os.getpid()}.partial").write_bytes(b"of an earlier process of this number")
    kept = {
        f".{NAMES[0]}.{os.getppid()}.partial",  # is being written
        f".other.{dead.pid}.partial",
        f".{NAMES[0]}.x.partial",
    }
    for name in kept:
        (tmp_path / name).write_bytes(b"")
    for name in NAMES:
        write_bundle(full_avatar(), tmp_path / name, preview=False, reference=False, engine_files=False)
    assert set(os.listdir(tmp_path)) == {*NAMES, *kept}


def test_a_bundle_that_a_killed_process_had_moved_away_is_put_back(tmp_path: Path) -> None:
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    out = bundles.write(tmp_path / "out", full_avatar(seed=9))
    before = bundles.contents(out)
    out.rename(tmp_path / f".out.{dead.pid}.old")
    with pytest.raises(AvatarError, match="exists; pass --force"):
        write_bundle(full_avatar(), out, preview=False, reference=False, engine_files=False)
    assert os.listdir(tmp_path) == ["out"] and bundles.contents(out) == before


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("force", [False, True])
def test_of_two_processes_that_write_one_new_bundle_one_is_told(
    tmp_path: Path, name: str, force: bool
) -> None:
    plain = {"preview": False, "reference": False, "engine_files": False}
    out, first = tmp_path / name, tmp_path / "first" / name

    def other(file: str) -> None:
        if file == "avatar.json":
            write_bundle(full_avatar(seed=9), first, **plain)
            first.rename(out)

    if force:
        write_bundle(full_avatar(), out, force=True, progress=other, **plain)
        assert_same(load(out), full_avatar())
    else:
        with pytest.raises(AvatarError, match="exists; pass --force"):
            write_bundle(full_avatar(), out, progress=other, **plain)
        assert_same(load(out), full_avatar(seed=9))


def test_what_appears_meanwhile_and_is_no_bundle_is_not_replaced(tmp_path: Path) -> None:
    def other(file: str) -> None:
        if file == "avatar.json":
            (tmp_path / "out").write_bytes(b"dear")

    with pytest.raises(AvatarError, match="is not a bundle"):
        write_bundle(
            full_avatar(), tmp_path / "out", force=True, progress=other, preview=False, reference=False
        )
    assert (tmp_path / "out").read_bytes() == b"dear"


def test_a_link_that_leads_to_itself_is_refused(tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to("loop")
    with pytest.raises(AvatarError, match="loop: is a link that leads to itself"):
        write_bundle(full_avatar(), tmp_path / "loop", preview=False, reference=False)


def refused(avatar: Avatar, out: Path, **options: Any) -> str:
    before = {p: p.is_file() and p.read_bytes() for p in sorted(out.parent.rglob("*"))}
    with pytest.raises(AvatarError) as caught:
        write_bundle(avatar, out, preview=False, reference=False, **options)
    assert {p: p.is_file() and p.read_bytes() for p in sorted(out.parent.rglob("*"))} == before
    return str(caught.value)


def test_what_exists_is_only_replaced_by_force_and_only_if_it_is_a_bundle(tmp_path: Path) -> None:
    for name in NAMES:
        write_bundle(full_avatar(seed=9), tmp_path / name, preview=False, reference=False)
        assert "exists; pass --force" in refused(full_avatar(), tmp_path / name)
        write_bundle(full_avatar(), tmp_path / name, preview=False, reference=False, force=True)
        assert_same(load(tmp_path / name), full_avatar())
    photos = tmp_path / "photos"
    photos.mkdir()
    (photos / "holiday.jpg").write_bytes(b"dear")
    thesis = tmp_path / "thesis.avatar.zip"
    thesis.write_bytes(b"dearer")
    for path in (photos, thesis):
        assert "exists; pass --force" in refused(full_avatar(), path)
        assert "exists and is not a bundle; it is not replaced" in refused(full_avatar(), path, force=True)
    (tmp_path / "empty").mkdir()
    write_bundle(full_avatar(), tmp_path / "empty", preview=False, reference=False, force=True)


def test_any_other_zip_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "backup.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("thesis.tex", "dear")
    assert "exists and is not a bundle" in refused(full_avatar(), path, force=True)


def test_an_unsound_avatar_is_not_written(tmp_path: Path) -> None:
    avatar = full_avatar()
    mean = avatar.gaussians.mean.copy()
    mean[5, 1] = np.nan
    broken = replace(avatar, gaussians=replace(avatar.gaussians, mean=mean))
    assert "gaussians.mean: is nan at row 5" in refused(broken, tmp_path / "out")
    assert "background" in refused(
        replace(avatar, raster=replace(avatar.raster, background="sky")), tmp_path / "out"
    )
    assert os.listdir(tmp_path) == []


def test_where_nothing_can_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    assert "cannot be written" in refused(full_avatar(), tmp_path / "file" / "out")


def test_the_layout_in_memory_does_not_show(tmp_path: Path) -> None:
    avatar = full_avatar()
    g = avatar.gaussians
    odd = replace(avatar, gaussians=replace(g, mean=np.asfortranarray(g.mean), sh=np.asfortranarray(g.sh)))
    write_bundle(avatar, tmp_path / "a", preview=False, reference=False)
    write_bundle(odd, tmp_path / "b", preview=False, reference=False)
    assert bundles.contents(tmp_path / "a") == bundles.contents(tmp_path / "b")
