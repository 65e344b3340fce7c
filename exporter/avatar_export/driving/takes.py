"""Reads a recorded take of any known format: one row of TAKE_READERS per format, recognised by content."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from avatar_export.driving.expression_json import FILE, is_expression_json, read_expression_json
from avatar_export.driving.frames import DrivingTake
from avatar_export.driving.live_link_csv import is_live_link_csv, read_live_link_csv
from avatar_export.driving.live_link_udp import is_live_link_udp, read_live_link_udp
from avatar_export.formats.file_set import FileSet, holds_together
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes

MAX_FILE_BYTES = 256 << 20


class TakeReader(NamedTuple):
    """How one format is recognised by its first bytes, and read."""

    name: str
    what: str
    matches: Callable[[bytes], bool]
    read: Callable[[bytes, str], DrivingTake]


TAKE_READERS: tuple[TakeReader, ...] = (
    TakeReader("live_link_udp", "recorded Live Link Face packets", is_live_link_udp, read_live_link_udp),
    TakeReader("live_link_csv", "Live Link Face CSV", is_live_link_csv, read_live_link_csv),
    TakeReader(
        "expression_json", "JSON with ARKit weights over time", is_expression_json, read_expression_json
    ),
)


def read_take(path: Path | str) -> DrivingTake:
    """The take in the file `path`, its format recognised by content, or in a zip or folder with a bsData.json.

    Raises AvatarError for anything else.
    """
    if holds_together(Path(path), (FILE,)):
        return take_of(FileSet(Path(path), (FILE,)).read(FILE), FILE)
    return take_of(read_bytes(Path(path), MAX_FILE_BYTES), Path(path).name)


def take_of(data: bytes, name: str) -> DrivingTake:
    """The take in the bytes of the file `name`. Raises AvatarError as `read_take`."""
    for reader in TAKE_READERS:
        if reader.matches(data):
            return reader.read(data, name)
    known = " nor ".join(reader.what for reader in TAKE_READERS)
    raise AvatarError(f"is neither {known}", file=name)


def is_json_take(path: Path) -> bool:
    """Whether `path` is a .json with ARKit weights over time; never raises."""
    try:
        return path.suffix.lower() == ".json" and is_expression_json(read_bytes(path, MAX_FILE_BYTES))
    except AvatarError:
        return False
