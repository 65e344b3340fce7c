"""Files that belong together in one folder of a zip or of a directory."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from avatar_export.formats import file_set
from avatar_export.formats.file_set import FileSet, holds_together
from avatar_runtime.io.errors import AvatarError

NEEDED = ("a.bin", "b.bin")


def _zip(path: Path, *names: str) -> Path:
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            archive.writestr(name, name.encode())
    return path


@pytest.mark.parametrize("folder", ["", "someone/", "deep/er/"])
def test_a_zip_and_the_folder_it_unpacks_to(folder: str, tmp_path: Path) -> None:
    names = [folder + name for name in (*NEEDED, "c.bin")]
    path = _zip(tmp_path / "set.zip", *names, "__MACOSX/x/a.bin", "__MACOSX/x/b.bin")
    assert holds_together(path, NEEDED)
    files = FileSet(path, NEEDED)
    assert files.name == "set"
    assert files.has("c.bin") and not files.has("d.bin")
    assert files.read("a.bin") == (folder + "a.bin").encode()
    assert files.files() == {"set.zip": path}
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path / "unpacked", [name for name in archive.namelist() if name in names])
    at = tmp_path / "unpacked" / folder
    unpacked = FileSet(at, NEEDED)
    assert unpacked.read("b.bin") == (folder + "b.bin").encode()
    assert unpacked.files() == {name: at / name for name in NEEDED}


def test_what_is_not_one_set_is_refused(tmp_path: Path) -> None:
    half = _zip(tmp_path / "half.zip", "x/a.bin", "y/b.bin")
    two = _zip(tmp_path / "two.zip", *(f"{folder}/{name}" for folder in "xy" for name in NEEDED))
    text = tmp_path / "text.zip"
    text.write_text("not a zip")
    for path in (half, text, tmp_path / "absent"):
        assert not holds_together(path, NEEDED)
    with pytest.raises(AvatarError, match=r"half\.zip: has no folder with a\.bin and b\.bin, expected one"):
        FileSet(half, NEEDED)
    with pytest.raises(AvatarError, match=r"two\.zip: has 2 folders with a\.bin and b\.bin, expected one"):
        FileSet(two, NEEDED)
    for path in (text, tmp_path / "absent"):
        with pytest.raises(AvatarError):
            FileSet(path, NEEDED)


def test_a_file_above_the_limit_is_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_set, "MAX_FILE_BYTES", 4)
    files = FileSet(_zip(tmp_path / "set.zip", *NEEDED), NEEDED)
    with pytest.raises(AvatarError, match=r"a\.bin: is 5 bytes long; up to 4 are read"):
        files.read("a.bin")
