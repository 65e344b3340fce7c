"""The house keeps its shape: rooms stand in an order, nothing imports in a circle, folders and files stay small."""

from __future__ import annotations

import pytest
from tools.structure import players

from tools import structure

# Rooms of each package, from the ground up. A room may import what stands before it, never what stands after.
# fmt: off
ORDER = {
    "avatar_runtime": (
        "io", "rotation", "rules", "version", "avatar", "checks", "camera", "pose", "clips", "topology", "program",
        "codec", "handedness", "driving", "subset", "stages", "packs", "bundle", "enhance", "engine_pose", "posed",
        "backends", "player", "conformance",
    ),
    "avatar_export": (
        "notes", "options", "provenance", "sparse", "version", "formats", "driving", "bodies", "asm", "ops", "images",
        "measure", "levels", "clips", "fit", "rigs", "readers", "writers", "packing", "checks", "playing",
        "convert_options", "conversion",
        "summary", "distill", "live", "owned", "serving", "players", "drop", "batch", "commands", "cli", "__main__",
    ),
    "avatar_trainer": (
        "settings", "tensors", "normals", "captures", "enhancer", "parameters", "stages", "kernels", "raster", "losses",
        "asm", "systems", "bundles", "evaluation", "loop", "commands", "cli", "__main__",
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


def test_circles_of_players_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also one that is closed by a type, by an import at run time, by a header or by a namespace."""
    texts = {
        "players/a/x.ts": 'import {\n  one,\n} from "./y.js";\n',
        "players/a/y.ts": 'import type { X } from "../a/x.js";\n',
        "players/a/z.ts": 'export { x } from "./x.js";\nconst w = await import("./w.js");\n',
        "players/a/w.ts": 'import worker from "inline-worker:./z.js";\n',
        "players/b/include/p.h": '#include "../src/q.h"\n',
        "players/b/src/q.h": '#include "p.h"\n',
        "players/c/A.cs": "using N.B;\n\nnamespace N.A\n{\n}\n",
        "players/c/B.cs": "using N.A;\n\nnamespace N.B\n{\n}\n",
    }
    monkeypatch.setattr(players, "files", lambda: texts)
    assert sorted(players.file_circles()) == [
        ["players/a/w.ts", "players/a/z.ts"],
        ["players/a/x.ts", "players/a/y.ts"],
        ["players/b/include/p.h", "players/b/src/q.h"],
    ]
    assert players.namespace_circles() == [["N.A", "N.B"]]


def test_every_public_name_has_a_docstring() -> None:
    assert not structure.without_docstring()


def test_circles_are_found() -> None:
    graph = {"a": {"b"}, "b": {"c"}, "c": {"b"}, "d": {"a"}}
    assert structure.circles(graph) == [["b", "c"]]


def test_circles_of_rooms_are_found_in_any_folder(monkeypatch: pytest.MonkeyPatch) -> None:
    """a.b imports a.d through its file c, and a.d imports another file of a.b. The face of a is not a room in it."""
    graph = {"a": {"a.d"}, "a.b.c": {"a.d"}, "a.d": {"a.b.e", "a"}, "a.b.e": set()}
    monkeypatch.setattr(structure, "imports", lambda: graph)
    assert structure.room_circles() == [["a.b", "a.d"]]
