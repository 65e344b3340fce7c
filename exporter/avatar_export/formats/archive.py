"""Zip files from untrusted sources: listed and read within limits, never extracted by the names inside."""

from __future__ import annotations

import os
import re
import stat
import struct
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Self

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.files import open_file

MAX_ENTRIES = 10_000
MAX_TOTAL_BYTES = 8 << 30
MAX_READ_BYTES = 2 << 30  # of one file
MAX_RATIO = 200  # of entries above RATIO_FREE_BYTES; small arrays of zeros compress a thousandfold
RATIO_FREE_BYTES = 64 << 20
CHUNK_BYTES = 1 << 20
IGNORED_FOLDERS = ("__MACOSX",)
IGNORED_FILES = (".DS_Store",)
READABLE = (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED)
ZIP_FAULTS = (zipfile.BadZipFile, zipfile.LargeZipFile, zlib.error, struct.error, EOFError, OSError,
              RuntimeError, NotImplementedError, ValueError, KeyError, IndexError, OverflowError,
              MemoryError)  # fmt: skip

FIRST, LAST = b"PK\x03\x04", b"PK\x05\x06"  # signatures of a zip's first file and of the record at its end
LONGEST_END = 22 + 65_535  # bytes of that record with its comment
TRUNCATED = "is a truncated zip: it ends before its directory, so copy or download it again"


def is_truncated(path: Path) -> bool:
    """Whether `path` is a file that begins as a zip and lacks the end of one; never raises."""
    try:
        with open_file(path) as file:
            begins = file.read(len(FIRST)) == FIRST
            file.seek(max(0, file.seek(0, os.SEEK_END) - LONGEST_END))
            return begins and LAST not in file.read(LONGEST_END)
    except OSError:
        return False


class Archive:
    """An opened zip whose names and sizes have been checked; use it in a `with`.

    `names` are the files in it, without folders and the extra files that macOS adds. Raises AvatarError for names
    that leave the archive (`..`, absolute, drive letters, backslashes), links, duplicates, encryption,
    unknown compression, and sizes beyond the limits of this module.
    """

    def __init__(self, path: Path):
        self.path = path
        try:
            self._file = open_file(path)
        except OSError as error:
            raise AvatarError(f"cannot be read ({error.strerror or error})", file=path) from None
        try:
            self._zip = zipfile.ZipFile(self._file)
        except ZIP_FAULTS as error:
            self._file.close()
            raise self._wrong(TRUNCATED) if is_truncated(path) else self._damaged(error) from error
        try:
            self._entries = self._checked(self._zip.infolist())
        except AvatarError:
            self.close()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file; `with` does it."""
        self._zip.close()
        self._file.close()

    @property
    def names(self) -> tuple[str, ...]:
        """The paths of the files in the zip, in its order."""
        return tuple(self._entries)

    def size(self, name: str) -> int:
        """Size of a file in bytes, as the zip's directory says."""
        return self._entry(name).file_size

    def read(self, name: str, limit: int = MAX_READ_BYTES) -> bytes:
        """The bytes of a file. Raises AvatarError if it is missing, damaged or over `limit`."""
        if self.size(name) > limit:
            raise self._wrong(f"has {self.size(name)} bytes, at most {limit} are read", name)
        return b"".join(self.chunks(name))

    def chunks(self, name: str) -> Iterator[bytes]:
        """The bytes of a file in chunks, never more than the zip's directory says."""
        entry = self._entry(name)
        left = entry.file_size
        try:
            with self._zip.open(entry) as stream:
                while piece := stream.read(CHUNK_BYTES):
                    left -= len(piece)
                    if left < 0:
                        raise self._wrong("inflates to more than the zip's directory says", name)
                    yield piece
        except ZIP_FAULTS as error:
            raise self._damaged(error, name) from error
        if left:
            raise self._wrong(f"ends {left} bytes early; the zip is damaged", name)

    def _entry(self, name: str) -> zipfile.ZipInfo:
        if name not in self._entries:
            raise AvatarError(f"there is no file {name} in the zip", file=self.path)
        return self._entries[name]

    def _checked(self, infos: list[zipfile.ZipInfo]) -> dict[str, zipfile.ZipInfo]:
        if len(infos) > MAX_ENTRIES:
            raise self._wrong(f"has {len(infos)} entries, at most {MAX_ENTRIES} are read")
        seen: set[str] = set()
        files: dict[str, zipfile.ZipInfo] = {}
        for info in infos:
            self._check_entry(info)
            if info.filename.casefold() in seen:
                raise self._wrong("is a duplicate in the zip", info.filename)
            seen.add(info.filename.casefold())
            parts = info.filename.split("/")
            if not info.is_dir() and parts[0] not in IGNORED_FOLDERS and parts[-1] not in IGNORED_FILES:
                files[info.filename] = info
        total = sum(info.file_size for info in infos)
        if total > MAX_TOTAL_BYTES:
            raise self._wrong(f"inflates to {total} bytes, at most {MAX_TOTAL_BYTES} are read")
        return files

    def _check_entry(self, info: zipfile.ZipInfo) -> None:
        name, kind = info.orig_filename, stat.S_IFMT(info.external_attr >> 16)
        parts = name.rstrip("/").split("/")
        if not name.isprintable() or "\\" in name or re.match("[A-Za-z]:|/", name):
            raise self._wrong(
                "is an absolute or unprintable name; a zip with such a name is not opened", name
            )
        if any(part in ("", ".", "..") for part in parts):
            raise self._wrong("leads out of the archive; a zip with such a name is not opened", name)
        if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
            raise self._wrong("is a link or device; zip the file itself", name)
        if info.flag_bits & 1:
            raise self._wrong("is encrypted; zip it without a password", name)
        if info.compress_type not in READABLE:
            raise self._wrong(f"uses compression {info.compress_type}; zip it stored or deflated", name)
        if info.file_size > RATIO_FREE_BYTES and info.file_size > MAX_RATIO * info.compress_size:
            raise self._wrong(
                f"{info.compress_size} bytes inflate to {info.file_size}, more than {MAX_RATIO} times", name
            )

    def _wrong(self, message: str, name: str | None = None) -> AvatarError:
        return AvatarError(message, file=self.path, field=None if name is None else ascii(name[:120])[1:-1])

    def _damaged(self, error: BaseException, name: str | None = None) -> AvatarError:
        return self._wrong(f"is a damaged zip, or not a zip ({str(error)[:80]!a})", name)
