"""The folder of dumps: dumps.json, drivers.npz and frames/00000.ply, frames/00001.ply, ...

Lengths are in the unit of dumps.json, those of drivers.npz, too.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.distill.drivers import FILE as DRIVERS
from avatar_export.distill.drivers import Drivers, read
from avatar_export.formats.json_text import parse_json
from avatar_runtime.avatar import F64
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes
from avatar_schema.validate import parse_version, schema_problems

DOCUMENT, FRAMES = "dumps.json", "frames"
VERSION = "1.0"
NOTHING: Mapping[str, Any] = {}
OWNER = "distill"
MAX_JSON_BYTES = 1 << 22
FEWEST_FRAMES, MOST_FRAMES = 4, 100_000
UP: Mapping[str, list[list[int]]] = {  # up axis: what turns it to +y
    "+y": [[1, 0, 0], [0, 1, 0], [0, 0, 1]],
    "-y": [[1, 0, 0], [0, -1, 0], [0, 0, -1]],
    "+z": [[1, 0, 0], [0, 0, 1], [0, -1, 0]],
    "-z": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
}


@dataclass(frozen=True)
class Encoding:
    """How the numbers of a frame are to be read; each value is defined in dumps.schema.json."""

    scale: str = "log"
    opacity: str = "logit"
    quaternion: str = "wxyz"
    colour: str = "sh"
    sh: str = "rotated"


@dataclass(frozen=True)
class Dumps:
    """A folder of dumps whose documents are sound; the frames themselves are not read yet."""

    folder: Path
    document: Mapping[str, Any]
    encoding: Encoding
    drivers: Drivers

    @property
    def name(self) -> str:
        """The name of the avatar."""
        return str(self.document["name"])

    @property
    def unit(self) -> float:
        """Metres in one unit of the dumps."""
        return float(self.document["unit"])

    @property
    def turn(self) -> F64:
        """[3, 3] bundle axes (+Y up) from the axes of the dumps."""
        return np.array(UP[self.document["up_axis"]], np.float64)

    def frame(self, index: int) -> Path:
        """The .ply of a frame."""
        return self.folder / FRAMES / frame_name(index)

    def take_name(self, take: int) -> str:
        """The name of a take."""
        names: Sequence[str] = self.document.get("take_names", ())
        return names[take] if take < len(names) else f"take_{take}"


def frame_name(index: int) -> str:
    """`00012.ply`."""
    return f"{index:05d}.ply"


def open_dumps(folder: Path) -> Dumps:
    """The dumps in `folder`.

    Raises AvatarError for a document that is missing or unsound, for drivers whose lengths differ, and for a frame that
    is missing or too many.
    """
    if not folder.is_dir():
        raise AvatarError(f"is not a folder; pass the one with {DOCUMENT}", file=folder, owner=OWNER)
    document = _document(folder / DOCUMENT)
    drivers = read(folder / DRIVERS)
    if not FEWEST_FRAMES <= drivers.frames <= MOST_FRAMES:
        raise AvatarError(
            f"has {drivers.frames} frames; {FEWEST_FRAMES} to {MOST_FRAMES} are read",
            file=folder / DRIVERS,
            field="take",
        )
    _expect_frames(folder / FRAMES, drivers.frames)
    takes = set(drivers.take.tolist())
    unknown = [take for take in document.get("held_out", ()) if take not in takes]
    if unknown:
        raise AvatarError(
            f"names take {unknown[0]}, which no frame in {DRIVERS} has",
            file=folder / DOCUMENT,
            field="held_out",
        )
    known = {name: document["encoding"][name] for name in Encoding.__dataclass_fields__}
    return Dumps(folder, document, Encoding(**known), drivers)


def _document(file: Path) -> dict[str, Any]:
    document = parse_json(read_bytes(file, MAX_JSON_BYTES), file)
    version = parse_version(document.get("version")) if isinstance(document, dict) else None
    if version is not None and version[0] > 1:
        raise AvatarError(f"is newer than {VERSION}: update avatar-export", file=file, field="version")
    for problem in schema_problems(document, "dumps"):
        raise AvatarError(problem.message, file=file, field=problem.path.removeprefix("$."))
    return dict(document)


def _expect_frames(folder: Path, count: int) -> None:
    """Raise AvatarError unless `folder` has the frames 0 to count - 1, and no other .ply."""
    found = {path.name for path in folder.glob("*.ply")} if folder.is_dir() else set()
    wanted = [frame_name(index) for index in range(count)]
    missing = [name for name in wanted if name not in found]
    if missing:
        more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
        raise AvatarError(
            f"is missing{more}; {DRIVERS} has {count} frames: dump it again, or take its row out of {DRIVERS}",
            file=folder / missing[0],
        )
    extra = sorted(found - set(wanted))
    if extra:
        raise AvatarError(
            f"has no row in {DRIVERS}, which has {count} frames: add its drivers, or remove it",
            file=folder / extra[0],
        )


def write_document(folder: Path, name: str, encoding: Encoding, more: Mapping[str, Any] = NOTHING) -> None:
    """Write dumps.json: unit 1, +y up, space avatar, unless `more` says otherwise."""
    document = {
        "version": VERSION,
        "name": name,
        "unit": 1.0,
        "up_axis": "+y",
        "space": "avatar",
        "encoding": {key: getattr(encoding, key) for key in Encoding.__dataclass_fields__},
        **more,
    }
    (folder / DOCUMENT).write_text(json.dumps(document, indent=1) + "\n", "utf-8")
