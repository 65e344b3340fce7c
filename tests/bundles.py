"""Bundles to damage: write one, change its manifest or files, sign it again, pack it into a zip."""

from __future__ import annotations

import hashlib
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

from avatar_export.writers.bundle import write_bundle
from avatar_runtime.avatar import Avatar
from tests.avatars import full_avatar

Document = dict[str, Any]


def write(folder: Path, avatar: Avatar | None = None) -> Path:
    """The bundle of `avatar`, by default `full_avatar()`, its normative files only, in the new folder `folder`."""
    write_bundle(avatar or full_avatar(), folder, preview=False, engine_files=False, reference=False)
    return folder


def manifest(folder: Path) -> Document:
    document: Document = json.loads((folder / "avatar.json").read_text("utf-8"))
    return document


def save(folder: Path, document: Document) -> None:
    (folder / "avatar.json").write_text(json.dumps(document), "utf-8")


def edit(folder: Path, change: Callable[[Document], Any]) -> None:
    """Apply `change` to the manifest in place."""
    document = manifest(folder)
    change(document)
    save(folder, document)


def sign(folder: Path) -> None:
    """Sizes and hashes of the files as they are now: damage that hashes do not show."""

    def resign(document: Document) -> None:
        for entry in document["files"]:
            data = (folder / entry["path"]).read_bytes()
            entry |= {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}

    edit(folder, resign)


def zipped(folder: Path, path: Path, compression: int = zipfile.ZIP_STORED) -> Path:
    """The bundle as one zip."""
    with zipfile.ZipFile(path, "w", compression) as archive:
        for file in sorted(path for path in folder.rglob("*") if path.is_file()):
            archive.write(file, file.relative_to(folder))
    return path


def contents(path: Path) -> dict[str, bytes]:
    """Every file of a bundle folder or zip."""
    if path.is_dir():
        return {str(p.relative_to(path)): p.read_bytes() for p in sorted(path.rglob("*")) if p.is_file()}
    with zipfile.ZipFile(path) as archive:
        return {name: archive.read(name) for name in archive.namelist()}
