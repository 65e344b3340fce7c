"""The stored zip of avatar.usdz, read by Python's zipfile, by USD, and by hand."""

from __future__ import annotations

import io
import os
import resource
import struct
import subprocess
import sys
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pxr import Sdf, Usd, UsdValidation

from avatar_export.writers.usd.compare import same_usd
from avatar_export.writers.usd.difference import _limit_memory, difference
from avatar_export.writers.usd.layer import layer_bytes, open_layer
from avatar_export.writers.usd.stage import MESH, ROOT, SPLATS, rig_usdc
from avatar_export.writers.usdz import same_usdz, usdz
from avatar_runtime.io.errors import AvatarError
from tests.avatars import full_avatar

GOOD = rig_usdc(full_avatar())
PACKED = b"".join(usdz([("rig.usdc", GOOD)]))


def zipped(*files: tuple[str, bytes], method: int = zipfile.ZIP_STORED) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, data in files:
            archive.writestr(zipfile.ZipInfo(name), data, method)
    return buffer.getvalue()


def test_usd_opens_it_and_its_validators_are_content(tmp_path: Path) -> None:
    file = tmp_path / "avatar.usdz"
    file.write_bytes(PACKED)
    stage = Usd.Stage.Open(str(file))
    assert stage.GetPrimAtPath(MESH) and stage.GetPrimAtPath(SPLATS)
    registry = UsdValidation.ValidationRegistry()
    validators = registry.GetOrLoadAllValidators()
    assert any("UsdzPackage" in validator.GetMetadata().name for validator in validators)
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    assert [found.GetMessage() for found in errors] == []


NAMES = st.text("abcé日/._", min_size=1, max_size=90)


@given(st.lists(st.tuples(NAMES, st.binary(max_size=200)), max_size=5))
def test_every_file_begins_at_a_multiple_of_64_behind_a_sound_extra_field(
    rest: list[tuple[str, bytes]],
) -> None:
    files = {"rig.usdc": b"root"}
    for name, data in rest:
        if all(part not in ("", ".", "..") for part in name.split("/")):
            files.setdefault(name, data)
    packed = b"".join(usdz(files.items()))
    with zipfile.ZipFile(io.BytesIO(packed)) as archive:
        assert {info.filename: archive.read(info) for info in archive.infolist()} == files
        assert archive.namelist()[0] == "rig.usdc"
        for info in archive.infolist():
            assert info.compress_type == zipfile.ZIP_STORED and info.extra == b""
            assert info.date_time == (1980, 1, 1, 0, 0, 0)
            name_size, extra_size = struct.unpack_from("<HH", packed, info.header_offset + 26)
            extra_at = info.header_offset + 30 + name_size
            assert (extra_at + extra_size) % 64 == 0
            assert not extra_size or struct.unpack_from("<H", packed, extra_at + 2)[0] == extra_size - 4 < 64
            assert struct.unpack_from("<I", packed, info.header_offset + 14)[0] == info.CRC


@pytest.mark.parametrize(
    "names", [("a.txt",), ("../rig.usdc",), ("/rig.usdc",), ("a\\rig.usdc",), ("",), ("rig.usdc", "rig.usdc")]
)
def test_names_that_lead_out_and_other_roots_are_refused(names: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match=r"relative path|is not one of .usdc"):
        list(usdz((name, b"") for name in names))


def test_more_than_a_zip_holds_is_refused() -> None:
    class Huge(bytes):
        def __len__(self) -> int:
            return 1 << 32

    with pytest.raises(AvatarError, match="4 GiB"):
        list(usdz([("rig.usdc", Huge())]))


def test_a_stored_package_is_compared_by_its_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    assert same_usdz(PACKED, PACKED) is None
    module = sys.modules[same_usdz.__module__]
    monkeypatch.setattr(module, "same_usd", lambda old, new: None if old == new else "differs")
    other = b"".join(usdz([("rig.usdc", GOOD + b"\0")]))
    assert same_usdz(other, PACKED) == "rig.usdc differs"
    for stored, said in (
        (zipped(("rig.usdc", GOOD)), "has another layout than a zip"),
        (b"x" + PACKED, "has another layout than a zip"),
        (b"".join(usdz([("rig.usdc", GOOD), ("more.usdc", b"")])), "does not contain exactly rig.usdc"),
        (b"".join(usdz([("a.usdc", GOOD)])), "does not contain exactly rig.usdc"),
    ):
        assert (same_usdz(stored, PACKED) or "").startswith(said)


@pytest.mark.parametrize(
    "stored",
    [
        b"",
        b"PK\x05\x06",
        PACKED[:-1],
        PACKED[: len(PACKED) // 2],
        zipped(("rig.usdc", bytes(1 << 20)), method=zipfile.ZIP_DEFLATED),
        PACKED.replace(GOOD[:64], bytes(64), 1),
    ],
)
def test_what_is_no_sound_zip_is_refused(stored: bytes) -> None:
    with pytest.raises(AvatarError, match="convert again"):
        same_usdz(stored, PACKED)


def test_one_file_listed_many_times_is_not_read_many_times() -> None:
    *files, entry, end = usdz([("rig.usdc", GOOD)])
    end = end[:8] + struct.pack("<HHI", 9, 9, 9 * len(entry)) + end[16:]
    with pytest.raises(AvatarError, match="stored files only"):
        same_usdz(b"".join([*files, entry * 9, end]), PACKED)


@given(st.data())
def test_damaged_packages_give_an_avatar_error_or_a_difference(data: st.DataObject) -> None:
    damaged = bytearray(PACKED)
    headers = [*range(64), *range(len(PACKED) - 120, len(PACKED))]
    for at in data.draw(st.lists(st.sampled_from(headers), min_size=1, max_size=4)):
        damaged[at] = data.draw(st.integers(0, 255))
    try:
        found = same_usdz(bytes(damaged), PACKED)
    except AvatarError:
        return
    assert (found is None) == (bytes(damaged) == PACKED)


Edit = Callable[[Any], object]


def edited(edit: Edit) -> Any:
    layer = open_layer(GOOD)
    edit(layer)
    return layer


def scaled(path: str, factor: float) -> Edit:
    """All numbers of an attribute, default and samples, times a factor."""

    def apply(layer: Any) -> None:
        attribute = layer.GetAttributeAtPath(path)

        def times(value: Any) -> Any:
            array = np.array(value)
            return type(value).FromNumpy((array * array.dtype.type(factor)).astype(array.dtype))

        if attribute.default is not None:
            attribute.default = times(attribute.default)
        for time in layer.ListTimeSamplesForPath(path):
            layer.SetTimeSample(path, time, times(layer.QueryTimeSample(path, time)))

    return apply


@pytest.mark.parametrize(
    "attribute",
    [
        f"{MESH}.points",
        f"{MESH}.primvars:skel:jointWeights",
        f"{SPLATS}.orientations",
        f"{SPLATS}.radiance:sphericalHarmonicsCoefficients",
        "/avatar/world_from_avatar/skeleton.bindTransforms",
        "/avatar/clips/nod.rotations",
        "/avatar/clips/nod.blendShapeWeights",
        f"{ROOT}.extent",
    ],
)
def test_numbers_may_differ_by_rounding_only(attribute: str) -> None:
    new = open_layer(GOOD)
    assert difference(edited(scaled(attribute, 1 + 4e-7)), new) is None
    found = difference(edited(scaled(attribute, 1 + 4e-6)), new)
    assert found is not None and found.startswith(f"{attribute} has another ")


def set_first(path: str, value: Any) -> Edit:
    def edit(layer: Any) -> None:
        attribute = layer.GetAttributeAtPath(path)
        attribute.default = type(attribute.default)([value, *list(attribute.default)[1:]])

    return edit


def to_the_end(layer: Any) -> None:
    path, aside = "/avatar/clips/nod", open_layer(GOOD)
    del layer.GetPrimAtPath(path).nameParent.nameChildren[Sdf.Path(path).name]
    assert Sdf.CopySpec(aside, path, layer, path)


def info(name: str, value: Any) -> Edit:
    return lambda layer: layer.GetPrimAtPath(ROOT).SetInfo(name, value)


@pytest.mark.parametrize(
    ("said", "edit"),
    [
        ("is missing", lambda layer: layer.GetPrimAtPath(MESH).nameChildren.__delitem__("jawOpen")),
        ("is not expected", lambda layer: Sdf.PrimSpec(layer.GetPrimAtPath(ROOT), "more", Sdf.SpecifierDef)),
        ("on one side only", info("hidden", True)),
        ("on one side only", lambda layer: layer.subLayerPaths.append("a.usda")),
        ("another displayName", info("displayName", "x")),
        ("another default", set_first(f"{MESH}.faceVertexIndices", 7)),
        ("another default", set_first(f"{MESH}.skel:blendShapes", "x")),
        ("another framesPerSecond", lambda layer: setattr(layer, "framesPerSecond", 25)),
        ("another timeSamples", lambda layer: layer.EraseTimeSample("/avatar/clips/nod.rotations", 1)),
        ("another customData", info("customData", {"avatar": {"formatVersion": "9.0", "generator": "x"}})),
        ("children in another order", to_the_end),
    ],
)
def test_exact_values_and_structure_may_not_differ(said: str, edit: Edit) -> None:
    ours = open_layer(GOOD)
    assert said in str(difference(edited(edit), ours))
    newer = {**ours.GetPrimAtPath(ROOT).GetInfo("customData")["avatar"], "generator": "avatar-export 99"}
    assert difference(edited(info("customData", {"avatar": newer})), ours) is None


def test_other_bytes_of_the_same_layer_are_the_same(tmp_path: Path) -> None:
    """As an older release of the library packs it."""
    good, old = tmp_path / "good.usdc", tmp_path / "old.usdc"
    good.write_bytes(GOOD)
    program = f"from pxr import Sdf; Sdf.Layer.FindOrOpen({str(good)!r}).Export({str(old)!r})"
    environment = {**os.environ, "USD_WRITE_NEW_USDC_FILES_AS_VERSION": "0.7.0"}
    subprocess.run([sys.executable, "-c", program], env=environment, check=True, capture_output=True)
    assert old.read_bytes()[8:11] == b"\0\7\0" != GOOD[8:11]
    assert same_usd(old.read_bytes(), GOOD) is None
    other = rig_usdc(replace(full_avatar(), name="Somebody else"))
    assert same_usd(other, GOOD) == f"{ROOT} has another displayName"


def test_equal_bytes_are_not_opened(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(subprocess, "run", lambda *_, **__: pytest.fail("a process was started"))
    assert same_usd(GOOD, GOOD) is None
    for data in (b"", b"PXR-USD", b"#usda 1.0"):
        with pytest.raises(AvatarError, match="is not a USD crate file"):
            same_usd(data, GOOD)
    assert same_usd(GOOD + bytes(100_000), GOOD) == f"{len(GOOD) + 100_000} bytes, expected about {len(GOOD)}"


def test_damaged_files_differ_or_cannot_be_read() -> None:
    rng = np.random.default_rng(5)
    damaged = bytearray(GOOD)
    for at in rng.integers(8, len(GOOD), 300):
        damaged[at] ^= int(rng.integers(1, 256))
    with pytest.raises(AvatarError, match="convert again"):
        same_usd(bytes(damaged), GOOD)


@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "can be read"),
        ("raise MemoryError", "can be read"),
        ("print('no answer')", "can be read"),
        ("import time; time.sleep(60)", "takes more than 0.2 s"),
    ],
)
def test_a_reader_that_crashes_or_hangs_ends_nothing_here(
    program: str, said: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    python = tmp_path / "python"
    python.write_text(f"#!{sys.executable}\n{program}\n")
    python.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(python))
    with pytest.raises(AvatarError, match=said):
        same_usd(GOOD[:-1] + b"x", GOOD, seconds=0.2 if "sleep" in program else 60)


def test_no_module_of_the_current_folder_is_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("pxr", "numpy", "json"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text(f"open({str(tmp_path / 'ran')!r}, 'w')")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", ["", ".", *sys.path])
    assert same_usd(layer_bytes(edited(info("displayName", "x"))), GOOD) == f"{ROOT} has another displayName"
    assert not (tmp_path / "ran").exists()


def test_memory_is_limited(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: dict[int, Any] = {}
    monkeypatch.setattr(resource, "setrlimit", asked.__setitem__)
    _limit_memory(1 << 20)
    assert asked == {resource.RLIMIT_AS: (4096 + 64 << 20,) * 2, resource.RLIMIT_CORE: (0, 0)}
