"""Zips from strangers: what a file manager writes is read, what attacks is refused before it is unpacked."""

from __future__ import annotations

import io
import stat
import zipfile
from pathlib import Path

import pytest

from avatar_export.formats import archive
from avatar_export.formats.archive import Archive
from avatar_runtime.io.errors import AvatarError
from tests.exporter.refusals import refused
from tests.hostile import only_avatar_errors, peak_bytes


def zipped(path: Path, entries: dict[str, bytes], kind: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", kind) as file:
        for name, data in entries.items():
            info = zipfile.ZipInfo(name)
            info.filename = name  # as it is, backslashes too
            file.writestr(info, data, compress_type=kind)
    return path


@pytest.mark.parametrize("kind", [zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED])
def test_files_are_listed_and_read_without_litter(tmp_path: Path, kind: int) -> None:
    entries = {
        "p2-1/": b"",
        "p2-1/offset.ply": b"ply" * 999_999,
        "p2-1/skin.glb": b"glTF",
        "p2-1/empty": b"",
        "__MACOSX/p2-1/._skin.glb": b"litter",
        "p2-1/.DS_Store": b"litter",
    }
    with Archive(zipped(tmp_path / "a.zip", entries, kind)) as zip_file:
        assert zip_file.names == ("p2-1/offset.ply", "p2-1/skin.glb", "p2-1/empty")
        assert zip_file.size("p2-1/offset.ply") == 2_999_997
        for name in zip_file.names:
            assert zip_file.read(name) == entries[name]
        assert [len(piece) for piece in zip_file.chunks("p2-1/offset.ply")] == [1 << 20, 1 << 20, 902_845]
        refused(r"no file p2-1/\.DS_Store", zip_file.read, "p2-1/.DS_Store")
        refused("at most 3 are read", zip_file.read, "p2-1/skin.glb", limit=3)


NAMES = {
    "leads out": ("../up.ply", "a/../../up.ply", "a/..", "./a", "a//b", "__MACOSX/../../up"),
    "absolute": ("/etc/passwd", "C:/windows", "c:a", "a\\b", "..\\up"),
    "unprintable": ("a\nb", "a\x00b"),
}


@pytest.mark.parametrize(
    ("name", "message"), [(name, says) for says, names in NAMES.items() for name in names]
)
def test_names_that_leave_the_archive(tmp_path: Path, name: str, message: str) -> None:
    path = tmp_path / "a.zip"
    path.write_bytes(named(name))
    assert refused(message, Archive, path).file == str(path)


def named(name: str) -> bytes:
    """A zip of one file of this name."""
    stream, placeholder = io.BytesIO(), "P" * len(name)
    with zipfile.ZipFile(stream, "w") as file:
        file.writestr(placeholder, b"2")
    return stream.getvalue().replace(placeholder.encode(), name.encode())


@pytest.mark.parametrize("mode", [stat.S_IFLNK, stat.S_IFIFO, stat.S_IFCHR])
def test_links_and_devices_are_refused(tmp_path: Path, mode: int) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as file:
        info = zipfile.ZipInfo("skin.glb")
        info.external_attr = (mode | 0o777) << 16
        file.writestr(info, "/etc/passwd")
    refused("link or device", Archive, tmp_path / "a.zip")


@pytest.mark.parametrize("second", ["skin.glb", "SKIN.glb"])
def test_two_files_of_one_name_are_refused(tmp_path: Path, second: str) -> None:
    path = tmp_path / "a.zip"
    zipped(path, {"skin.glb": b"1", "skan.glb": b"2"})
    path.write_bytes(path.read_bytes().replace(b"skan.glb", second.encode()))
    refused("is a duplicate", Archive, path)


def test_encryption_and_other_compression(tmp_path: Path) -> None:
    path = zipped(tmp_path / "a.zip", {"a": b"1"})
    data = bytearray(path.read_bytes())
    data[6] |= 1
    data[data.index(b"PK\x01\x02") + 8] |= 1
    path.write_bytes(data)
    refused("encrypted", Archive, path)
    for kind in (zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA):
        refused("uses compression", Archive, zipped(path, {"a": b"1" * 99}, kind))


def test_a_bomb_is_refused_by_ratio_total_and_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = zipped(tmp_path / "a.zip", {"zeros": bytes(1 << 20), "more": bytes(1 << 20)})
    Archive(path).__exit__(None, None, None)  # small zeros are not a zip bomb
    for limit, value, says in (
        ("RATIO_FREE_BYTES", 1 << 19, "more than 200 times"),
        ("MAX_TOTAL_BYTES", (2 << 20) - 1, "inflates to 2097152 bytes"),
        ("MAX_ENTRIES", 1, "has 2 entries"),
    ):
        with monkeypatch.context() as patch:
            patch.setattr(archive, limit, value)
            refused(says, Archive, path)


@pytest.mark.parametrize("claimed", [100, (1 << 20) - 1, (1 << 20) + 1])
def test_a_size_that_lies_stops_the_inflating(tmp_path: Path, claimed: int) -> None:
    path = zipped(tmp_path / "a.zip", {"zeros": bytes(1 << 20)})
    data = bytearray(path.read_bytes())
    size = data.index(b"PK\x01\x02") + 24
    data[size : size + 4] = claimed.to_bytes(4, "little")
    path.write_bytes(data)
    with Archive(path) as zip_file:
        assert peak_bytes(lambda: only_avatar_errors(lambda: zip_file.read("zeros"))) < 4 << 20
        with pytest.raises(AvatarError):
            zip_file.read("zeros")


def test_what_is_no_zip_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.zip"
    for data in (b"", b"PK\x05\x06", b"ply\n" * 99):
        path.write_bytes(data)
        refused("damaged zip", Archive, path)
    for missing in (tmp_path / "missing.zip", tmp_path):
        refused("cannot be read", Archive, missing)
