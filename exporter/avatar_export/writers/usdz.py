"""A .usdz: a stored zip whose files each begin at a multiple of 64 bytes, the first being the stage.

The library's own writer stamps the time of day; this one writes the same bytes for the same files.
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
PADDING_ID = 0x1986  # extra field of USD's own writer; its contents mean nothing
STAGES = (".usdc", ".usda", ".usd")
DATE, TIME = 1 << 5 | 1, 0  # 1980-01-01 00:00, the earliest that a zip can say
VERSION = 10  # of zip, to extract: stored files
UTF8 = 1 << 11
LIMIT = 0xFFFFFFFF  # zip64 is not part of usdz


def usdz(files: Iterable[tuple[str, bytes]]) -> Iterator[bytes]:
    """The package in pieces; the first of `files` (name, contents) is the root layer.

    Raises ValueError for a name that leads out of the package or stands twice, a first file that is no stage, and
    AvatarError beyond 4 GiB. Source: the usdz specification, https://openusd.org/release/spec_usdz.html.
    """
    at, directory, seen = 0, [], set[str]()
    for name, data in files:
        encoded = _checked_name(name, seen)
        flags = 0 if name.isascii() else UTF8
        sizes = (zlib.crc32(data), len(data), len(data), len(encoded))
        extra = _padding(at + 30 + len(encoded))
        if at + len(data) + len(extra) + 1024 > LIMIT:
            raise AvatarError("is more than the 4 GiB that a usdz may have; write fewer Gaussians", file=name)
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
    """None where the package `old` holds what `new` holds, or one phrase naming the first difference.

    The zip has to be byte for byte as `usdz` lays out its contents; the stages inside may differ as `same_usd` allows.
    Raises AvatarError if `old` is no such zip or a stage cannot be read.
    """
    if bytes(old) == bytes(new):
        return None
    there, ours = _contents(bytes(old)), _contents(bytes(new))
    if [name for name, _ in there] != [name for name, _ in ours]:
        return f"does not hold exactly {', '.join(name for name, _ in ours)}"
    if b"".join(usdz(there)) != bytes(old):
        return "is laid out as another zip than this program writes"
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
        raise AvatarError(f"is no sound zip ({error}); convert again") from None


def _checked_name(name: str, seen: set[str]) -> bytes:
    parts = name.split("/")
    if "\\" in name or "\0" in name or any(part in ("", ".", "..") for part in parts) or name in seen:
        raise ValueError(f"{name!r} is no plain relative path, or stands twice")
    if not seen and not name.endswith(STAGES):
        raise ValueError(f"{name!r} comes first and is none of {', '.join(STAGES)}")
    seen.add(name)
    return name.encode()


def _padding(end_of_name: int) -> bytes:
    """The extra field that ends at a multiple of ALIGNMENT; it takes 4 bytes for its own header."""
    size = -end_of_name % ALIGNMENT
    if 0 < size < 4:
        size += ALIGNMENT
    return struct.pack("<HH", PADDING_ID, size - 4) + bytes(size - 4) if size else b""
