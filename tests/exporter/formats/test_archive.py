"""Zips from strangers: what a file manager writes is read, what attacks is refused before it is unpacked."""

from __future__ import annotations

import io
import stat
import zipfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from avatar_export.formats import archive
from avatar_export.formats.archive import Archive
from avatar_runtime.io.errors import AvatarError
from tests.hostile import MANGLING, mangled, only_avatar_errors, peak_bytes


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
        with pytest.raises(AvatarError, match=r"no file p2-1/\.DS_Store"):
            zip_file.read("p2-1/.DS_Store")
        with pytest.raises(AvatarError, match="at most 3 are read"):
            zip_file.read("p2-1/skin.glb", limit=3)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("../up.ply", "leads out"),
        ("a/../../up.ply", "leads out"),
        ("a/..", "leads out"),
        ("./a", "leads out"),
        ("a//b", "leads out"),
        ("/etc/passwd", "absolute"),
        ("C:/windows", "absolute"),
        ("c:a", "absolute"),
        ("a\\b", "absolute"),
        ("..\\up", "absolute"),
        ("a\nb", "unprintable"),
        ("a\x00b", "unprintable"),
        ("", "leads out"),
        ("__MACOSX/../../up", "leads out"),
    ],
)
def test_names_that_leave_the_archive_are_refused(tmp_path: Path, name: str, message: str) -> None:
    path = zipped(tmp_path / "a.zip", {"fine": b"1", "PLACE": b"2"})
    path.write_bytes(
        path.read_bytes().replace(b"PLACE", name.encode()) if len(name) == 5 else rename(path, name)
    )
    with pytest.raises(AvatarError, match=message) as caught:
        Archive(path)
    assert caught.value.file == str(path)


def rename(path: Path, name: str) -> bytes:
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as file:
        placeholder = "P" * max(1, len(name))
        file.writestr(placeholder, b"2")
    return (
        stream.getvalue().replace(placeholder.encode(), name.encode()) if name else unnamed(stream.getvalue())
    )


def unnamed(data: bytes) -> bytes:
    """The one-entry zip with an empty name: both name lengths 0, the name cut out."""
    b = bytearray(data)
    directory = b.index(b"PK\x01\x02")
    del b[directory + 46]
    b[directory + 28 : directory + 30] = b"\0\0"
    del b[30]
    b[26:28] = b"\0\0"
    end = b.index(b"PK\x05\x06")
    b[end + 12 : end + 16] = (int.from_bytes(b[end + 12 : end + 16], "little") - 1).to_bytes(4, "little")
    b[end + 16 : end + 20] = (int.from_bytes(b[end + 16 : end + 20], "little") - 1).to_bytes(4, "little")
    return bytes(b)


@pytest.mark.parametrize("mode", [stat.S_IFLNK, stat.S_IFIFO, stat.S_IFCHR])
def test_links_and_devices_are_refused(tmp_path: Path, mode: int) -> None:
    with zipfile.ZipFile(tmp_path / "a.zip", "w") as file:
        info = zipfile.ZipInfo("skin.glb")
        info.external_attr = (mode | 0o777) << 16
        file.writestr(info, "/etc/passwd")
    with pytest.raises(AvatarError, match="link or device"):
        Archive(tmp_path / "a.zip")


@pytest.mark.parametrize("second", ["skin.glb", "SKIN.glb"])
def test_two_files_of_one_name_are_refused(tmp_path: Path, second: str) -> None:
    path = tmp_path / "a.zip"
    zipped(path, {"skin.glb": b"1", "skan.glb": b"2"})
    path.write_bytes(path.read_bytes().replace(b"skan.glb", second.encode()))
    with pytest.raises(AvatarError, match="is a duplicate"):
        Archive(path)


def test_encryption_and_other_compression_are_refused(tmp_path: Path) -> None:
    path = zipped(tmp_path / "a.zip", {"a": b"1"})
    data = bytearray(path.read_bytes())
    data[6] |= 1
    data[data.index(b"PK\x01\x02") + 8] |= 1
    path.write_bytes(data)
    with pytest.raises(AvatarError, match="encrypted"):
        Archive(path)
    for kind in (zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA):
        with pytest.raises(AvatarError, match="uses compression"):
            Archive(zipped(path, {"a": b"1" * 99}, kind))


def test_a_bomb_is_refused_by_ratio_total_and_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = zipped(tmp_path / "a.zip", {"zeros": bytes(1 << 20), "more": bytes(1 << 20)})
    Archive(path).__exit__(None, None, None)  # small zeros are not a zip bomb
    with monkeypatch.context() as patch:
        patch.setattr(archive, "RATIO_FREE_BYTES", 1 << 19)
        with pytest.raises(AvatarError, match="more than 200 times"):
            Archive(path)
    with monkeypatch.context() as patch:
        patch.setattr(archive, "MAX_TOTAL_BYTES", (2 << 20) - 1)
        with pytest.raises(AvatarError, match="inflates to 2097152 bytes"):
            Archive(path)
    with monkeypatch.context() as patch:
        patch.setattr(archive, "MAX_ENTRIES", 1)
        with pytest.raises(AvatarError, match="has 2 entries"):
            Archive(path)


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
        with pytest.raises(AvatarError, match="damaged zip"):
            Archive(path)
    for missing in (tmp_path / "missing.zip", tmp_path):
        with pytest.raises(AvatarError, match="cannot be read"):
            Archive(missing)


@MANGLING
@given(data=st.data())
def test_mangled_zips_give_bytes_or_an_avatar_error(
    tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    path = tmp_path_factory.getbasetemp() / "mangled.zip"
    zipped(path, {"a/offset.ply": b"ply\nformat" * 30, "a/b": b"\0" * 500, "a/": b""})
    path.write_bytes(data.draw(mangled(path.read_bytes())))

    def read() -> None:
        with Archive(path) as zip_file:
            for name in zip_file.names:
                assert len(zip_file.read(name)) == zip_file.size(name)

    only_avatar_errors(read)
