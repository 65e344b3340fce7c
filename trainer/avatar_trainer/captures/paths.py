"""Paths that a capture's own text names."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

from avatar_runtime import AvatarError

MAX_PATH, MAX_NAME = 1000, 250  # bytes; endings are added to names


def inside(folder: Path, text: str, file: Path, field: str) -> Path:
    """The path `text` (/ between folders) below `folder`. Raises AvatarError for one that leaves it."""
    path = PurePosixPath(text)
    leaves = path.is_absolute() or not path.parts or ".." in path.parts or ":" in path.parts[0]
    if leaves or "\\" in text:
        raise AvatarError(
            f"{text[:80]!a} leaves the capture's folder; name files below it, with / between folders",
            file=file,
            field=field,
        )
    sizes = [len(part.encode(errors="replace")) for part in path.parts]
    if not text.isprintable() or sum(sizes) > MAX_PATH or max(sizes) > MAX_NAME:
        raise AvatarError(f"{text[:80]!a} is not a valid path", file=file, field=field)
    return folder / path
