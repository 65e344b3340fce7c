"""Writes a bundle: every file under a temporary name, the manifest last, then one rename."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from avatar_export.ops.bounds import bounds
from avatar_export.version import GENERATOR
from avatar_export.writers.reference import reference_facts
from avatar_export.writers.table import INFLUENCES, WRITERS, Export, Piece, engine_facts
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import MANIFEST, opener, read_manifest
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.codec import manifest as codec
from avatar_runtime.conformance import RUNTIME, Maker
from avatar_runtime.handedness import HANDEDNESS, mirrored_boxes
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.staging import followed, heal, staged
from avatar_schema.validate import manifest_problems

FORMAT = "avatar-export"  # what avatar.json calls itself
ZIP_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest date of a zip, so that the same input gives the same bytes
Sink = Callable[[str, Iterable[Piece]], None]


def write_bundle(
    avatar: Avatar,
    out: Path,
    *,
    preview: bool = True,
    engine_files: bool = True,
    reference: bool = True,
    influences: int = INFLUENCES[0],
    handedness: str = "right",
    maker: Maker = RUNTIME,
    force: bool = False,
    progress: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """Write `avatar` to the folder `out`, or to a stored zip if it ends in `.zip`; returns the manifest.

    - `preview`: write preview.png; `engine_files`: write the derived glTF, USD and JSON; `reference`: write vectors and
      images for ports, which `maker` computes.
    - `influences`: joints per vertex in rig.glb, 4 or 8.
    - `handedness`: "left" writes the normative files in a left-handed frame; files for engines follow their standards.
    - `progress` is called with the name of the next file.

    Same avatar and options, same bytes. After a crash or a kill `out` is what it was. Raises AvatarError if the avatar
    is unsound, or if `out` exists (`force` replaces an older bundle, nothing else), also at the end; ValueError for an
    unknown handedness.
    """
    if handedness not in HANDEDNESS:
        raise ValueError(f"{handedness!r} is not one of {', '.join(HANDEDNESS)}")
    check_avatar(avatar)
    export = Export(avatar, influences, handedness, maker)
    wanted = {"engine": engine_files, "reference": reference, "preview": preview}
    parts = {"avatar", "enhancer", *(part for part, asked in wanted.items() if asked)}
    out = followed(out)  # "." gets a name
    heal(out)
    may_replace(out, force)
    with staged(out, force=force) as partial:
        if out.suffix.lower() == ".zip":
            with zipfile.ZipFile(partial, "x", zipfile.ZIP_STORED) as archive:
                document = _write(export, _zip_sink(archive), parts, progress)
        else:
            partial.mkdir()
            document = _write(export, _folder_sink(partial), parts, progress)
        may_replace(out, force)  # what another process wrote meanwhile is no less dear
    return document


def _write(export: Export, sink: Sink, parts: set[str], progress: Callable[[str], None]) -> dict[str, Any]:
    files = []
    for writer in WRITERS:
        if writer.part not in parts:
            continue
        progress(writer.path)
        pieces = writer.pieces(export)
        if pieces is None:
            continue
        meter = _Meter(pieces)
        sink(writer.path, meter)
        files.append(
            {"path": writer.path, "bytes": meter.size, "sha256": meter.digest(), "derived": writer.derived}
        )
        if writer.part == "avatar":
            export.sha256[writer.path] = meter.digest()
    progress(MANIFEST)
    engine = engine_facts(export) if "engine" in parts else None
    boxes = bounds(export.avatar)
    if export.handedness == "left":
        boxes = mirrored_boxes(boxes)
    reference = reference_facts(export.reference) if "reference" in parts else None
    document = codec.encode(export.stored, files, boxes, GENERATOR, engine, reference, export.handedness)
    problems = manifest_problems(document)
    if problems:
        raise AvatarError(problems[0].message, file=MANIFEST, field=problems[0].path)
    sink(MANIFEST, [manifest_bytes(document)])
    return document


def manifest_bytes(document: dict[str, Any]) -> bytes:
    """The bytes of avatar.json."""
    return (
        json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False, default=_plain) + "\n"
    ).encode()


class _Meter:
    """Passes pieces on, and counts their size and hash."""

    def __init__(self, pieces: Iterable[Piece]) -> None:
        self._pieces, self._hash, self.size = pieces, hashlib.sha256(), 0

    def __iter__(self) -> Any:
        for piece in self._pieces:
            self._hash.update(piece)
            self.size += len(piece)
            yield piece

    def digest(self) -> str:
        return self._hash.hexdigest()


def _folder_sink(folder: Path) -> Sink:
    def write(name: str, pieces: Iterable[Piece]) -> None:
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        with path.open("xb") as file:
            _pour(pieces, file)

    return write


def _zip_sink(archive: zipfile.ZipFile) -> Sink:
    def write(name: str, pieces: Iterable[Piece]) -> None:
        with archive.open(zipfile.ZipInfo(name, ZIP_DATE), "w", force_zip64=True) as file:
            _pour(pieces, file)  # type: ignore[arg-type]

    return write


def _pour(pieces: Iterable[Piece], file: BinaryIO) -> None:
    for piece in pieces:
        file.write(piece)


def may_replace(out: Path, force: bool) -> None:
    """Raise AvatarError if `out` exists; with `force`, if it is neither a bundle nor an empty folder."""
    if not out.exists():
        return
    if not force:
        raise AvatarError("exists; pass --force to replace it", file=out)
    if not (out.is_dir() and not any(out.iterdir())) and not _is_bundle(out):
        raise AvatarError("exists and is not a bundle; it is not replaced", file=out)


def _is_bundle(path: Path) -> bool:
    try:
        return read_manifest(opener(path)).get("format") == FORMAT
    except AvatarError:
        return False


def _plain(value: object) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    raise TypeError(f"{type(value).__name__} cannot be written to a manifest")
