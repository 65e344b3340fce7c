"""The stored zip of avatar.usdz, read by Python's zipfile, by USD, and by hand."""

from __future__ import annotations

import io
import struct
import sys
import zipfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pxr import Usd, UsdValidation

from avatar_export.writers.usd.stage import MESH, SPLATS, rig_usdc
from avatar_export.writers.usdz import same_usdz, usdz
from avatar_runtime.io.errors import AvatarError
from tests.avatars import full_avatar

GOOD = rig_usdc(full_avatar())
PACKED = b"".join(usdz([("rig.usdc", GOOD)]))


def zipped(*files: tuple[str, bytes], method: int = zipfile.ZIP_STORED) -> bytes:
    """A zip by Python's own writer."""
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


def test_it_holds_the_stage_alone_and_no_clock() -> None:
    with zipfile.ZipFile(io.BytesIO(PACKED)) as archive:
        assert archive.testzip() is None
        (info,) = archive.infolist()
        assert (info.filename, info.date_time) == ("rig.usdc", (1980, 1, 1, 0, 0, 0))
        assert archive.read(info) == GOOD
    assert b"".join(usdz([("rig.usdc", GOOD)])) == PACKED


@given(
    st.lists(
        st.tuples(st.text("abcé日/._", min_size=1, max_size=90), st.binary(max_size=200)),
        min_size=0,
        max_size=5,
    )
)
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
            name_size, extra_size = struct.unpack_from("<HH", packed, info.header_offset + 26)
            extra_at = info.header_offset + 30 + name_size
            assert (extra_at + extra_size) % 64 == 0
            if extra_size:
                _, size = struct.unpack_from("<HH", packed, extra_at)
                assert size == extra_size - 4 < 64
            local = packed[info.header_offset + 4 : info.header_offset + 26]
            assert struct.unpack_from("<I", local, 10)[0] == info.CRC


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
