"""`assemble` puts a player together: the one function that `drop`, `make dist` and the tests use."""

from __future__ import annotations

from collections.abc import Callable

from avatar_export.players.godot import godot_files
from avatar_export.players.native import native_files
from avatar_export.players.unity import unity_files
from avatar_export.players.unreal import unreal_files
from avatar_export.players.web import web_files

PLAYERS: dict[str, Callable[[], dict[str, bytes]]] = {
    "unity": unity_files,
    "unreal": unreal_files,
    "godot": godot_files,
    "native": native_files,
    "web": web_files,
}


def assemble(player: str) -> dict[str, bytes]:
    """{path below the player's folder: content}, in the order of the paths. KeyError for an unknown player."""
    return dict(sorted(PLAYERS[player]().items()))
