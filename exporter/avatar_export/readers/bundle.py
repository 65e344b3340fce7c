"""An existing bundle, read again to write the files that it lacks, or another form of it."""

from __future__ import annotations

import contextlib
import zipfile
from dataclasses import replace
from pathlib import Path

from avatar_export.formats.archive import ZIP_FAULTS
from avatar_export.notes.text import from_stored
from avatar_export.options import ReadOptions
from avatar_runtime.avatar import Avatar
from avatar_runtime.bundle import MANIFEST, load
from avatar_runtime.packs import is_pack

SYSTEM = "bundle"
FILES = (f"{MANIFEST} and the files that it names; a folder or a stored zip", "or a pack, NAME.avatar")
WITHOUT_RIG = ReadOptions()
USED_OPTIONS = ("name",)


def detect(path: Path) -> bool:
    """Whether `path` holds a manifest, valid or not, or is a pack; never raises."""
    try:
        if path.is_dir():
            return (path / MANIFEST).exists()
        if is_pack(path):
            return True
        with zipfile.ZipFile(path) if path.is_file() else contextlib.nullcontext() as archive:
            return archive is not None and MANIFEST in archive.namelist()
    except ZIP_FAULTS:
        return False


def read(path: Path, options: ReadOptions) -> Avatar:
    """The avatar of the normative files, with its clips and provenance. Raises AvatarError as `bundle.load`."""
    options.refuse_others(USED_OPTIONS, SYSTEM, "a bundle contains all its inputs")
    avatar = load(path)
    notes = from_stored(avatar.provenance.get("notes"))
    provenance = {**avatar.provenance, "notes": notes} if notes else avatar.provenance
    return replace(avatar, name=avatar.name if options.name is None else options.name, provenance=provenance)
