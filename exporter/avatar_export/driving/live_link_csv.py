"""Live Link Face CSV: a timecode, a count and up to 61 named columns per row.

Columns are matched by name in any order and case; unknown columns are ignored. The timecode is
HH:MM:SS:FF.sss, where FF.sss counts frames of a rate that the file does not store: the smallest common rate
above the highest FF. (The shared 300-row recording counts FF to 58 in steps of 2: base 60, recorded at 30 fps.)
"""

from __future__ import annotations

import csv
import io
import re
from array import array
from collections.abc import Iterator

import numpy as np

from avatar_export.driving.frames import CHANNEL_LIMIT, DrivingTake, take
from avatar_runtime.avatar import F64
from avatar_runtime.driving.arkit import CHANNELS, canonical, rotation_channel
from avatar_runtime.io.errors import AvatarError, no_such

TIMECODE_BASES = (24, 25, 30, 48, 50, 60, 120, 240)
# Live Link Face counts 60 frames per second; used if the file does not cross a full second.
DEFAULT_BASE = 60
DAY = 86400.0

_TIMECODE = re.compile(r"(\d{1,2}):(\d{1,2}):(\d{1,2})[:;](\d{1,3}(?:\.\d{1,9})?)", re.ASCII)


def is_live_link_csv(data: bytes) -> bool:
    """Whether `data` begins with a header line that names a timecode column."""
    line = data[:8192].split(b"\n", 1)[0].lower()
    return b"timecode" in line and b"," in line


def read_live_link_csv(data: bytes, source: str) -> DrivingTake:
    """The take in the bytes of a Live Link Face CSV; AvatarError names the row (from 1) and the column.

    A row whose BlendShapeCount is 0 has no face: it is left out and counted in `without_face`.
    """
    rows = _rows(data, source)
    header = next(rows, (1, []))[1]
    columns = _columns(header, source)
    codes, values, without_face = array("d"), array("d"), 0
    for number, row in rows:
        if not row:
            continue
        if len(row) != len(header):
            raise AvatarError(
                f"row {number} has {len(row)} fields, but the header has {len(header)}", file=source
            )
        if _no_face(row, columns):
            without_face += 1
            continue
        codes.extend(_timecode(row[columns["timecode"]], number, source))
        for channel in CHANNELS:
            at = columns.get(channel)
            values.append(0.0 if at is None else _number(row[at], number, header[at].strip(), source))
    missing = tuple(c for c in CHANNELS if c not in columns)
    return take(
        _seconds(np.array(codes).reshape(-1, 2), source),
        np.array(values).reshape(-1, len(CHANNELS)),
        source,
        missing=missing,
        without_face=without_face,
    )


def _rows(data: bytes, source: str) -> Iterator[tuple[int, list[str]]]:
    """(row number from 1, fields) of every line."""
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise AvatarError(f"is not UTF-8 text (byte {error.start})", file=source) from None
    try:
        yield from enumerate(csv.reader(io.StringIO(text, newline=""), strict=True), 1)
    except csv.Error as error:
        raise AvatarError(f"is not valid CSV: {error}", file=source) from None


def _columns(header: list[str], source: str) -> dict[str, int]:
    """Column index by "timecode", "blendshapecount" or canonical channel name."""
    columns: dict[str, int] = {}
    for at, title in enumerate(header):
        plain = title.strip().lower()
        name = (
            plain if plain in ("timecode", "blendshapecount") else canonical(title) or rotation_channel(title)
        )
        if name is None:
            continue
        if name in columns:
            raise AvatarError(f"columns {columns[name] + 1} and {at + 1} are both {name}", file=source)
        columns[name] = at
    if "timecode" not in columns:
        raise AvatarError("has no Timecode column; a Live Link Face CSV is needed", file=source)
    if not any(channel in columns for channel in CHANNELS):
        raise no_such("ARKit column", ", ".join(header)[:60], CHANNELS, file=source)
    return columns


def _no_face(row: list[str], columns: dict[str, int]) -> bool:
    at = columns.get("blendshapecount")
    return at is not None and row[at].strip() == "0"


def _number(text: str, row: int, column: str, source: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not abs(value) <= CHANNEL_LIMIT:
        raise AvatarError(f"row {row}: {text[:40]!r} is not a weight or angle", file=source, field=column)
    return value


def _timecode(text: str, row: int, source: str) -> tuple[float, float]:
    """(whole seconds of the day, frames into the second)."""
    match = _TIMECODE.fullmatch(text.strip())
    if match is None:
        raise AvatarError(
            f"row {row}: {text[:40]!r} is not a timecode HH:MM:SS:FF.sss", file=source, field="Timecode"
        )
    hours, minutes, seconds = (int(part) for part in match.groups()[:3])
    frames = float(match[4])
    if hours > 23 or minutes > 59 or seconds > 59 or frames >= TIMECODE_BASES[-1]:
        raise AvatarError(f"row {row}: {text[:40]!r} is not a time of day", file=source, field="Timecode")
    return 3600.0 * hours + 60 * minutes + seconds, frames


def _seconds(codes: F64, source: str) -> F64:
    """Times [F] in seconds from timecodes [F, 2]; midnight may be crossed once."""
    if len(codes) == 0:
        return np.zeros(0)
    highest = codes[:, 1].max()
    crosses = len(np.unique(codes[:, 0])) > 1
    base = next(b for b in TIMECODE_BASES if b > highest and (crosses or b >= DEFAULT_BASE))
    time = codes[:, 0] + codes[:, 1] / base
    falls = np.flatnonzero(np.diff(time) < -DAY / 2)
    if len(falls) == 1:
        time[falls[0] + 1 :] += DAY
    back = np.flatnonzero(np.diff(time) < 0)
    if len(back):
        raise AvatarError(
            f"frame {int(back[0]) + 1} is earlier than the one before", file=source, field="Timecode"
        )
    return time
