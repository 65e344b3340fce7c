"""Reads a recorded take of any known format: one row of TAKE_READERS per format, recognised by content."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from avatar_export.driving.frames import DrivingTake
from avatar_export.driving.live_link_csv import is_live_link_csv, read_live_link_csv
from avatar_export.driving.live_link_udp import is_live_link_udp, read_live_link_udp
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
)


def read_take(path: Path | str) -> DrivingTake:
    """The take in the file `path`, its format recognised by content. Raises AvatarError for anything else."""
    data = read_bytes(Path(path), MAX_FILE_BYTES)
    for reader in TAKE_READERS:
        if reader.matches(data):
            return reader.read(data, Path(path).name)
    known = " nor ".join(reader.what for reader in TAKE_READERS)
    raise AvatarError(f"is neither {known}", file=Path(path).name)
