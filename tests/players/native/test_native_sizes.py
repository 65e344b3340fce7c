"""Structs of the C interface may grow: a program sees what it knows, whichever of it and the library is newer."""

from __future__ import annotations

import re
from pathlib import Path

from avatar_schema.version import __version__
from tests.players.native import need_compilers, run
from tests.session.native import NATIVE, SANITIZED, build

HEADERS = ("avatar_player.h", "avatar_conform.h")
CHANGES = {  # of each struct: its last field is not there yet, or a field has come
    "older": (r"\n    [^\n]+;[^;]*\n\} (Avatar\w+);", r"\n} \1;"),
    "same": ("", ""),
    "newer": (r"\n\} (Avatar\w+);", r"\n    uint64_t added;\n} \1;"),
}
LATER = {
    "AvatarSceneChunk": "0",
    "AvatarCamera": "0",
}  # what a last field of 0 makes of them: no splats, no image


def unit(folder: Path, who: str) -> Path:
    """The program's part that knows the structs of `who`."""
    folder.mkdir()
    for name in HEADERS:
        text, changed = re.subn(*CHANGES[who], (NATIVE / "include" / name).read_text())
        assert who == "same" or changed >= 2
        (folder / name).write_text(text if who != "same" else (NATIVE / "include" / name).read_text())
    made = folder / f"{who}.c"
    head = f'#define WHO {who}\n#define {who.upper()}\n#include "{folder}/avatar_conform.h"\n'
    made.write_text(f'{head}{"#define MAIN" if who == "same" else ""}\n#include "{NATIVE}/tests/sizes.c"\n')
    return made


def test_structs_may_grow(unity_cases: Path, tmp_path: Path) -> None:
    need_compilers()
    program = build("sizes", [unit(tmp_path / who, who) for who in CHANGES], SANITIZED)
    case = unity_cases / "joints"
    files = (
        case / "pack.avatar",
        unity_cases / "recording.csv",
        case / "driving.json",
        case / "driving.safetensors",
    )
    older, same, newer = re.split(r"same\n|newer\n", run(program, list(map(str, files))))
    structs = {
        name
        for header in HEADERS
        for name in re.findall(r"\} (Avatar\w+);", (NATIVE / "include" / header).read_text())
    }
    assert {word for word in re.findall(r"Avatar\w+", same)} == structs
    assert newer == same
    for before, now in zip(older.splitlines(), same.splitlines(), strict=True):
        *_, zero, large = now.split()
        assert (zero, large) in {("0", "0"), ("-1", "-1")}, now  # a size of 0, and one that is too large
        kind = now.removeprefix("read ").split()[0]
        if now.startswith("read") and kind in LATER:
            assert before.split()[2] == LATER[kind] and now.split()[2] != LATER[kind]
        else:
            assert before == now


def test_the_header_has_the_version_of_the_library(tmp_path: Path) -> None:
    text = (NATIVE / "include" / HEADERS[0]).read_text()
    parts = [re.findall(rf"AVATAR_PLAYER_VERSION_{part} (\d+)", text) for part in ("MAJOR", "MINOR", "PATCH")]
    assert ".".join(part for (part,) in parts) == re.match(r"[\d.]+\d", __version__)[0]
