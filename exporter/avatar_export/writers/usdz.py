"""A .usdz: a stored zip whose files each begin at a multiple of 64 bytes, the first being the stage.

The library's writer stores the current time; this one gives the same bytes for the same files.
"""

from __future__ import annotations

import io
import struct
import zipfile
import zlib
from collections.abc import Iterable, Iterator

from avatar_export.formats.archive import ZIP_FAULTS
from avatar_export.writers.usd.compare import same_usd
from avatar_runtime.io.errors import AvatarError

ALIGNMENT = 64
PADDING_ID = 0x1986  # extra field of USD's own writer; its content has no meaning
STAGE_SUFFIXES = (".usdc", ".usda", ".usd")
DATE, TIME = 1 << 5 | 1, 0  # 1980-01-01 00:00, the earliest of a zip
VERSION = 10  # of zip, needed to extract stored files
UTF8 = 1 << 11
LIMIT = 0xFFFFFFFF  # zip64 is not part of usdz


def usdz(files: Iterable[tuple[str, bytes]]) -> Iterator[bytes]:
    """The package in pieces; the first of `files` (name, contents) is the root layer.

    Raises ValueError for a name that leads out of the package or is a duplicate and for a first file that is not a
    stage, AvatarError above 4 GiB. Source: the usdz specification, https://openusd.org/release/spec_usdz.html.
    """
    at, directory, seen = 0, [], set[str]()
    for name, data in files:
        encoded = _checked_name(name, seen)
        flags = 0 if name.isascii() else UTF8
        sizes = (zlib.crc32(data), len(data), len(data), len(encoded))
        extra = _padding(at + 30 + len(encoded))
        if at + len(data) + len(extra) + 1024 > LIMIT:
            raise AvatarError(
                "is larger than 4 GiB, the limit of usdz; write the bundle without engine files", file=name
            )
        fixed = (VERSION, flags, 0, TIME, DATE, *sizes)
        directory.append(
            struct.pack("<IHHHHHHIIIHHHHHII", 0x02014B50, VERSION, *fixed, 0, 0, 0, 0, 0, at) + encoded
        )
        header = struct.pack("<IHHHHHIIIHH", 0x04034B50, *fixed, len(extra)) + encoded + extra
        yield header
        yield data
        at += len(header) + len(data)
    entries = b"".join(directory)
    yield entries
    count = len(directory)
    yield struct.pack("<IHHHHIIH", 0x06054B50, 0, 0, count, count, len(entries), at, 0)


def same_usdz(old: bytes, new: bytes) -> str | None:
    """None if the package `old` has the content of `new`, else one phrase that names the first difference.

    The zip must have the exact layout of `usdz`; the stages inside may differ as `same_usd` allows. Raises
    AvatarError if `old` is not such a zip or a stage cannot be read.
    """
    if bytes(old) == bytes(new):
        return None
    there, ours = _contents(bytes(old)), _contents(bytes(new))
    if [name for name, _ in there] != [name for name, _ in ours]:
        return f"does not contain exactly {', '.join(name for name, _ in ours)}"
    if b"".join(usdz(there)) != bytes(old):
        return "has another layout than a zip of this program"
    for (name, stored), (_, derived) in zip(there, ours, strict=True):
        found = same_usd(stored, derived)
        if found is not None:
            return f"{name} {found}"
    return None


def _contents(data: bytes) -> list[tuple[str, bytes]]:
    """(name, contents) of every file of a stored zip."""
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            infos = archive.infolist()
            if sum(info.file_size for info in infos) > len(data) or any(
                info.compress_type != zipfile.ZIP_STORED or info.flag_bits & 1 for info in infos
            ):
                raise AvatarError("must hold stored files only; convert again")
            return [(info.filename, archive.read(info)) for info in infos]
    except ZIP_FAULTS as error:
        raise AvatarError(f"is a damaged zip ({error}); convert again") from None


def _checked_name(name: str, seen: set[str]) -> bytes:
    parts = name.split("/")
    if "\\" in name or "\0" in name or any(part in ("", ".", "..") for part in parts) or name in seen:
        raise ValueError(f"{name!r} is not a plain relative path, or a duplicate")
    if not seen and not name.endswith(STAGE_SUFFIXES):
        raise ValueError(f"the first file {name!r} is not one of {', '.join(STAGE_SUFFIXES)}")
    seen.add(name)
    return name.encode()


def _padding(end_of_name: int) -> bytes:
    """The extra field that makes the data begin at a multiple of ALIGNMENT; its header takes 4 bytes."""
    size = -end_of_name % ALIGNMENT
    if 0 < size < 4:
        size += ALIGNMENT
    return struct.pack("<HH", PADDING_ID, size - 4) + bytes(size - 4) if size else b""
