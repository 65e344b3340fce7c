"""The house keeps its shape: rooms stand in an order, nothing imports in a circle, folders and files stay small."""

from __future__ import annotations

import pytest
from tools.structure import players

from tools import structure

# Rooms of each package, from the ground up. A room may import what stands before it, never what stands after.
# fmt: off
ORDER = {
    "avatar_runtime": (
        "io", "rotation", "rules", "version", "avatar", "checks", "camera", "pose", "clips", "topology", "light",
        "program", "codec", "handedness", "driving", "subset", "stages", "packs", "bundle", "enhance", "engine_pose",
        "posed", "backends", "player", "conformance",
    ),
    "avatar_export": (
        "notes", "options", "provenance", "sparse", "version", "formats", "driving", "bodies", "asm", "ops", "images",
        "measure", "levels", "clips", "fit", "relight", "rigs", "readers", "writers", "packing", "checks", "playing",
        "convert_options", "conversion",
        "summary", "distill", "live", "owned", "serving", "players", "drop", "batch", "making", "commands", "cli",
        "__main__",
    ),
    "avatar_trainer": (
        "head", "settings", "tensors", "normals", "captures", "enhancer", "parameters", "stages", "kernels", "raster",
        "losses", "asm", "systems", "bundles", "evaluation", "loop", "film", "commands", "cli", "__main__",
    ),
}
# fmt: on


def test_no_rooms_import_each_other_in_a_circle() -> None:
    assert not structure.room_circles()


def test_no_files_import_each_other_in_a_circle() -> None:
    assert not structure.file_circles()


@pytest.mark.parametrize("package", ORDER)
def test_the_rooms_of_a_package_stand_in_their_order(package: str) -> None:
    order = {f"{package}.{room}": floor for floor, room in enumerate(ORDER[package])}
    rooms = {structure.child(package, name) for name in structure.modules()} - {None}
    assert rooms == set(order), "each room has its place in ORDER"
    for name, targets in structure.imports().items():
        room = structure.child(package, name)
        for target in targets:
            below = structure.child(package, target)
            if room in order and below in order:
                assert order[below] <= order[room], f"{name} imports {target}, which stands above it"


def test_folders_and_files_stay_small() -> None:
    assert not [f for f, count in structure.full_folders().items() if count > structure.MOST_MODULES]
    assert not [f for f, lines in structure.long_files().items() if lines > structure.MOST_LINES]


def test_players_import_nothing_in_a_circle() -> None:
    assert not players.file_circles() + players.namespace_circles() + players.assembly_circles()


def test_folders_and_files_of_players_stay_small() -> None:
    assert not [f for f, count in players.full_folders().items() if count > structure.MOST_MODULES]
    assert not [f for f, lines in players.long_files().items() if lines > structure.MOST_LINES]


def test_every_public_name_has_a_docstring() -> None:
    assert not structure.without_docstring()
