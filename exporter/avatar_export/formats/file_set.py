"""Files that belong together: found in one folder of a zip or of a directory, and read by their bare names."""

from __future__ import annotations

import zipfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path, PurePosixPath

from avatar_export.formats.archive import IGNORED_FOLDERS, ZIP_FAULTS, Archive
from avatar_runtime.io.errors import AvatarError

MAX_FILE_BYTES = 512 << 20


def holds_together(path: Path, needed: Sequence[str]) -> bool:
    """Whether some folder of the zip or directory `path` holds every file of `needed`; never raises."""
    try:
        if path.is_dir():
            return bool(_folders((str(p.relative_to(path)) for p in _files_of(path)), needed))
        if not path.is_file():
            return False
        with zipfile.ZipFile(path) as archive:
            return bool(_folders(archive.namelist(), needed))
    except ZIP_FAULTS:
        return False


class FileSet:
    """The files beside `needed` in a zip or directory; `name` is that of the zip or directory.

    Raises AvatarError for a path that does not exist or a damaged zip, and unless exactly one folder holds `needed`.
    """

    def __init__(self, path: Path, needed: Sequence[str]):
        self._path, self._needed = path, tuple(needed)
        if path.is_dir():
            names = [str(p.relative_to(path).as_posix()) for p in _files_of(path)]
        elif path.is_file():
            with Archive(path) as archive:
                names = list(archive.names)
        else:
            raise AvatarError("no such file or folder", file=path)
        found = _folders(names, needed)
        if len(found) != 1:
            number = f"{len(found)} folders" if found else "no folder"
            raise AvatarError(f"has {number} with {' and '.join(needed)}, expected one", file=path)
        self._names = names
        self._folder = found[0]
        self.name = path.resolve().stem if path.is_file() else path.resolve().name

    def has(self, name: str) -> bool:
        """Whether a file of that name lies in the folder."""
        return str(self._folder / name) in self._names

    def files(self, *optional: str) -> dict[str, Path]:
        """Name -> path for the provenance: the zip itself, or of a directory the needed files and `optional` ones."""
        if self._path.is_file():
            return {self._path.name: self._path}
        used = (*self._needed, *filter(self.has, optional))
        return {name: self._path / self._folder / name for name in used}

    def read(self, name: str) -> bytes:
        """The bytes of a file. Raises AvatarError for one that is missing, damaged or above MAX_FILE_BYTES."""
        inner = str(self._folder / name)
        if self._path.is_dir():
            return _limited(name, (self._path / inner).stat().st_size, (self._path / inner).read_bytes)
        with Archive(self._path) as archive:
            return _limited(name, archive.size(inner), lambda: archive.read(inner))


def _limited(name: str, size: int, read: Callable[[], bytes]) -> bytes:
    if size > MAX_FILE_BYTES:
        raise AvatarError(f"is {size} bytes long; up to {MAX_FILE_BYTES} are read", file=name)
    try:
        return read()
    except OSError as error:
        raise AvatarError(f"cannot be read: {error.strerror or error}", file=name) from None


def _files_of(folder: Path) -> list[Path]:
    """The files in a folder and in its direct subfolders."""
    return [p for pattern in ("*", "*/*") for p in sorted(folder.glob(pattern)) if p.is_file()]


def _folders(names: Iterable[str], needed: Sequence[str]) -> list[PurePosixPath]:
    """The folders that hold every needed file."""
    paths = {PurePosixPath(name) for name in names}
    homes = sorted({p.parent for p in paths if p.name == needed[0] and p.parts[0] not in IGNORED_FOLDERS})
    return [home for home in homes if all(home / name in paths for name in needed)]
