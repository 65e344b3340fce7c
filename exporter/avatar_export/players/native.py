"""The files of the native player."""

from __future__ import annotations

from avatar_export.players.sources import folder


def native_files() -> dict[str, bytes]:
    """{path below the player's folder: content}."""
    root = folder("native")
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in root.rglob("*") if path.is_file()}
