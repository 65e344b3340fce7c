"""The files of the unreal player."""

from __future__ import annotations

from avatar_export.players.sources import folder


def unreal_files() -> dict[str, bytes]:
    """{path below the player's folder: content}."""
    root = folder("unreal")
    return {path.relative_to(root).as_posix(): path.read_bytes() for path in root.rglob("*") if path.is_file()}
